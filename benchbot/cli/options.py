"""Options that several commands share, and how a command is made so that it starts fast."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

QUICK: dict[str, Any] = {"default_map": {"help": False, "install_completion": False, "show_completion": False}}
"""Context settings of commands that must start fast: typer imports pydantic to read a flag that defaults to None."""

Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Requirements = Annotated[
    list[str] | None,
    typer.Option(
        "--require", metavar="SCORE>=X", help="Exit with 4 unless the score is reached (of an error: <=X); repeatable."
    ),
]

Method = Annotated[
    str | None,
    typer.Option("--method", "-m", metavar="METHOD", help="How to score. [default: the one that fits the task]"),
]
GroundTruths = Annotated[
    list[Path] | None,
    typer.Option(
        "--ground-truth",
        metavar="GT.json",
        help="Use this ground truth, or a folder of them, instead of the installed ones; repeatable.",
    ),
]
RequiredTask = Annotated[
    str | None, typer.Option("--required-task", metavar="TASK", help="Leave out results of other tasks.")
]
RequiredEnvs = Annotated[
    str | None,
    typer.Option(
        "--required-envs",
        metavar="ENV,ENV",
        help="These environments count, with a result or without; results of others are left out.",
    ),
]
RequiredEnvsBatch = Annotated[
    str | None, typer.Option("--required-envs-batch", metavar="BATCH", help="The same, as a batch names them.")
]
Missing = Annotated[
    Literal["zero", "leave-out"],
    typer.Option(
        metavar="zero|leave-out",
        help="How results that are missing, broken or of failed episodes count: as zero, or not at all.",
    ),
]
Over = Annotated[
    Literal["places", "environments"],
    typer.Option(
        metavar="places|environments",
        help="What is taken for a sample of many: places, each with all its variants, or environments, to speak of the "
        "variants of just these places.",
    ),
]

Record = Annotated[
    list[str] | None,
    typer.Option("--record", metavar="RECORDER=FOLDER", help="Record what happens, e.g. frames=FOLDER; repeatable."),
]

Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change the environment for this run, e.g. lighting.time=21:30; repeatable.",
    ),
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
