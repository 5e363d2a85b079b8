"""v2's options that answer a question and end the command: `--list-tasks`, `--show-task NAME`."""

from collections.abc import Callable
from typing import Any

import typer


def listing(kind: str, *flags: str) -> Any:
    """Return v2's option that lists a kind and ends, such as `--list-tasks`."""
    return typer.Option(*flags, callback=_ending(_list, kind), is_eager=True, help=f"List the {kind} and exit.")


def showing(kind: str, *flags: str) -> Any:
    """Return v2's option that shows one thing of a kind and ends, such as `--show-task NAME`."""
    what = f"Print one of the {kind} and exit."
    return typer.Option(*flags, metavar="NAME", callback=_ending(_show, kind), is_eager=True, help=what)


def _ending(action: Callable[[str, Any], None], kind: str) -> Callable[[Any], None]:
    def callback(value: Any) -> None:
        if value:
            action(kind, value)
            raise typer.Exit

    return callback


def _list(kind: str, _wanted: bool) -> None:
    from benchbot.cli import list as lists

    lists.show(kind)


def _show(kind: str, name: str) -> None:
    from benchbot.cli import show

    if kind == "methods":
        show.record("evaluators", name)
    else:
        show.declaration(kind, name)
