"""Names of new projects: of a distribution (PEP 503), and so of a package (PEP 8)."""

import importlib.util
import keyword
import re
import sys

from benchbot.core.errors import BenchbotError

_DISTRIBUTION = re.compile(r"[a-z](?:[a-z0-9]|-(?=[a-z0-9]))*")
MOST_LETTERS = 60


def package_of(name: str) -> str:
    """Return the package of a distribution: the same with underscores.

    Raises BenchbotError for a name that is not normal, that Python reserves, or that something installed has.
    """
    normal = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-").lstrip("0123456789-")[:MOST_LETTERS].strip("-")
    if not _DISTRIBUTION.fullmatch(name) or len(name) > MOST_LETTERS:
        raise BenchbotError(
            f"'{name}' is no name for a project.",
            "It starts with a letter and goes on with lower-case letters, digits and single hyphens (PEP 503), "
            f"{MOST_LETTERS} at most, so that its package can have the same (PEP 8).",
            f"Choose another, such as {normal or 'my-lab'}.",
        )
    package = name.replace("-", "_")
    if keyword.iskeyword(package) or package in sys.stdlib_module_names or package == "benchbot":
        raise BenchbotError(
            f"'{name}' is taken by Python or by BenchBot.",
            f"A package '{package}' would hide theirs.",
            f"Choose another, such as my-{name}.",
        )
    if importlib.util.find_spec(package) is not None:
        raise BenchbotError(
            f"'{name}' is taken by something that is installed here.",
            f"There is a package '{package}' already.",
            f"Choose another, such as my-{name}.",
        )
    return package
