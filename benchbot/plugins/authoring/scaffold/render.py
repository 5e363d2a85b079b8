"""Projects from templates: files beside this one, whose paths and texts are filled in."""

import importlib.util
import json
import keyword
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import yaml

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError

_TEMPLATES = Path(__file__).parent / "templates"
_SUFFIX = ".j2"
_DISTRIBUTION = re.compile(r"[a-z](?:[a-z0-9]|-(?=[a-z0-9]))*")
MOST_LETTERS = 60

KINDS = ("plugin", "task", "robot", "environment", "evaluator", "simulator", "driver", "agent")
"""The kinds of projects: a folder of templates each, with the values that they are filled with in `kind.yaml`."""
ORIGINS = {"simulator": ("gymnasium", "mujoco", "ros2")}
"""What projects of a kind can start from: further folders of templates, KIND-ORIGIN."""


def create(kind: str, name: str, parent: Path) -> Path:
    """Write a new project of a kind into the folder `parent / name`, and return it; it is there whole or not at all.

    Raises BenchbotError for a name that cannot be, for a folder that exists and for one that cannot be written.
    """
    package = package_of(name)
    target = parent / name
    if target.exists() or target.is_symlink():
        raise BenchbotError(
            f"{target} is there already.",
            "Nothing is ever overwritten.",
            "Choose another name, or another folder with --output-location.",
        )
    try:
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=parent, prefix=f".{name}-") as temporary:
            folder = Path(temporary) / name
            for path, text in _files(kind, name, package):
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_text(text, encoding="utf-8")
            # A temporary folder is private; a project is as readable as any other folder of the user.
            shutil.copymode(folder / "src", folder)
            folder.rename(target)
    except OSError as error:
        raise BenchbotError(
            f"{target} cannot be written.",
            f"{error.strerror or error}.",
            "Name a folder that you may write to with --output-location.",
        ) from error
    return target


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


def _files(kind: str, name: str, package: str) -> Iterator[tuple[Path, str]]:
    """Yield the path of each file in the project, and its text."""
    from jinja2 import Environment, StrictUndefined

    # Not the usual braces: Python, YAML and the language of CI files have those, too.
    # Nothing is escaped: the output is source code, and names are checked.
    environment = Environment(  # noqa: S701
        variable_start_string="<<",
        variable_end_string=">>",
        block_start_string="<%",
        block_end_string="%>",
        keep_trailing_newline=True,
        trim_blocks=True,
        undefined=StrictUndefined,
    )
    # As in BenchBot's own distributions: benchbot-sim-taichi brings the simulator sim_taichi.
    short = package.removeprefix("benchbot_")
    described = (_TEMPLATES / kind / "kind.yaml").read_text("utf-8")
    about = yaml.safe_load(environment.from_string(described).render(package=package, short=short))
    values = {
        **about,
        "kind": kind.partition("-")[0],
        "name": name,
        "package": package,
        "short": short,
        "places": about["places"].items(),
    }
    for root in (_TEMPLATES / "common", _TEMPLATES / kind):
        for template in sorted(root.rglob(f"*{_SUFFIX}")):
            relative = str(template.relative_to(root)).removesuffix(_SUFFIX)
            if relative.endswith(".yaml"):
                folder, _, file = relative.rpartition("/")
                relative = f"{folder}/{file.replace('PACKAGE', short)}"
            path = Path(relative.replace("PACKAGE", package).replace("dot_", "."))
            yield path, environment.from_string(template.read_text("utf-8")).render(values)
    for declared in about["schemas"]:
        text = json.dumps(schema.schema(declared), indent=2, ensure_ascii=False) + "\n"
        yield Path(".schemas") / f"{declared}.json", text
