"""Formats of results and ground truths: a declaration's functions, resolved to Python."""

import pkgutil
from collections.abc import Callable
from functools import cache
from typing import Any

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError, ExitCode


def functions(declaration: Declaration) -> dict[str, Callable[..., Any]]:
    """Return a format's functions by name (`create`, `validate`, …), imported from where it is declared.

    Raises BenchbotError naming the declaration when one cannot be imported.
    """
    if declaration.folder is not None:
        return declaration.folder.functions(declaration.path, declaration.data["functions"])
    resolved = {}
    for name, target in declaration.data["functions"].items():
        try:
            resolved[name] = pkgutil.resolve_name(target)
        except (ImportError, AttributeError, ValueError) as error:
            raise BenchbotError(
                f"The format '{declaration.name}' names a function that cannot be imported.",
                f"{declaration.path}: functions/{name} is '{target}': {error}",
                f"Report this to the author of '{declaration.distribution}'.",
            ) from error
    return resolved


def call(declaration: Declaration, name: str, args: list[Any], kwargs: dict[str, Any]) -> Any:
    """Call one of a format's functions for a solution.

    Raises BenchbotError for an unknown function, for arguments that do not fit, and for whatever the function raises.
    """
    known = functions(declaration)
    if name not in known:
        raise BenchbotError(
            f"The format '{declaration.name}' has no function '{name}'.",
            f"It has: {', '.join(sorted(known))}.",
            "Call one of these.",
        )
    try:
        return known[name](*args, **kwargs)
    except BenchbotError:
        raise
    # A format's author may fail in any way at all; those of BenchBot v2 validate with `assert`.
    except Exception as error:
        title, why = f"{name}() failed.", f"{type(error).__name__}: {error}"
        if isinstance(error, TypeError):
            title, why = f"{name}() was called with arguments that do not fit.", str(error)
        fix = f"See the format with: benchbot show format {declaration.name}"
        raise BenchbotError(title, why, fix, exit_code=ExitCode.SUBMISSION_FAILED) from error


def validate(declaration: Declaration, instance: Any) -> None:
    """Check an instance with the format's own `validate`; a format without one accepts everything."""
    if "validate" in declaration.data["functions"]:
        call(declaration, "validate", [instance], {})


@cache
def _installed() -> Catalog:
    return Catalog(plugin_manager.load())


def check_format(name: str, instance: Any) -> None:
    """Check an instance with the installed format of a name; raises BenchbotError for one that it refuses."""
    validate(_installed().get("formats", name), instance)
