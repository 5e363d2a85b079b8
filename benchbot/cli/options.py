"""Options that several commands share, and how a command is made so that it starts fast."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

QUICK: dict[str, Any] = {"default_map": {"help": False, "install_completion": False, "show_completion": False}}
"""Context settings of commands that must start fast: typer imports pydantic to read a flag that defaults to None."""

Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Requirements = Annotated[
    list[str] | None,
    typer.Option("--require", metavar="SCORE>=X", help="Exit with 4 unless the score is reached; repeatable."),
]

Record = Annotated[
    list[str] | None,
    typer.Option("--record", metavar="RECORDER=FOLDER", help="Record what happens, e.g. frames=FOLDER; repeatable."),
]


def recordings(wanted: list[str] | None) -> dict[str, Path]:
    """Return recorder name to folder from `--record NAME=FOLDER`; raises BenchbotError for one without a folder."""
    from benchbot.core.errors import BenchbotError

    found: dict[str, Path] = {}
    for text in wanted or ():
        name, _, folder = text.partition("=")
        if not name or not folder:
            raise BenchbotError(
                f"--record {text} names no folder.",
                "A recording needs a recorder and a folder to write into.",
                f"Write it like this: --record {name or 'frames'}=FOLDER",
            )
        found[name] = Path(folder)
    return found


def group(help_line: str) -> typer.Typer:
    """Return an app that holds sub-commands."""
    return typer.Typer(
        help=help_line,
        add_completion=False,
        no_args_is_help=True,
        rich_markup_mode=None,
        context_settings=QUICK,
    )


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

    lists.methods() if kind == "methods" else lists.declared(kind)


def _show(kind: str, name: str) -> None:
    from benchbot.cli import show

    if kind == "methods":
        show.record("evaluators", name)
    else:
        show.declaration(kind, name)
