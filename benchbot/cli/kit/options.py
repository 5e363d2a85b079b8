"""Options that several commands share, and how a command is made so that it starts fast."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer.core import TyperGroup

from benchbot.core.errors import BenchbotError

QUICK: dict[str, Any] = {
    "default_map": {"help": False, "install_completion": False, "show_completion": False},
    "help_option_names": ["--help", "-h"],
}
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

EpisodeNumber = Annotated[
    int | None,
    typer.Option("--episode", metavar="N", min=0, help="Which start and goal, in a task that has a list. [default: 0]"),
]
Seed = Annotated[
    int, typer.Option("--seed", metavar="N", min=0, max=2**63 - 1, help="Everything stochastic draws from it.")
]
Secret = Annotated[
    str | None,
    typer.Option(
        "--secret",
        metavar="FILE|random",
        help="And from this: 128 bits that a solution cannot know; they are disclosed in the result.",
    ),
]
MaxSteps = Annotated[int | None, typer.Option("--max-steps", metavar="N", min=1, help="End it after N actions.")]
MaxRestarts = Annotated[
    int | None, typer.Option("--max-restarts", metavar="N", min=0, help="Put the robot back N times at most.")
]
MaxSimulatedTime = Annotated[
    float | None,
    typer.Option("--max-simulated-time", metavar="SECONDS", min=0, help="End it after so much simulated time."),
]
MaxWallTime = Annotated[
    float | None, typer.Option("--max-wall-time", metavar="SECONDS", min=0, help="End it after so much real time.")
]

Record = Annotated[
    list[str] | None,
    typer.Option(
        "--record",
        metavar="RECORDER,…",
        help="Record what happens: mcap,video beside the result, or one into a folder: mcap=FOLDER; repeatable.",
    ),
]

Display = Annotated[
    Literal["auto", "rich", "plain", "json", "none"],
    typer.Option(
        metavar="auto|rich|plain|json|none",
        help="How stderr shows the status: a live line, plain lines, JSON lines or not; auto: what the terminal can.",
    ),
]

Despite = Annotated[
    list[str] | None,
    typer.Option(
        "--despite",
        metavar="NAME",
        help="Drive a real robot though this finding of its diagnosis is broken; the result says so; repeatable.",
    ),
]

Device = Annotated[
    Literal["auto", "cpu", "cuda"],
    typer.Option(metavar="auto|cpu|cuda", help="What to simulate on; auto: a GPU, if there is one and it is free."),
]

Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change the environment for this run, e.g. lighting.time=21:30; repeatable.",
    ),
]


def secret(given: str | None) -> str:
    """Return the secret of `--secret`, empty for none; raises BenchbotError when there is none in the file."""
    from benchbot.core import randomness

    if given is None:
        return ""
    return randomness.new_secret() if given == "random" else randomness.read_secret(Path(given))


def recordings(wanted: list[str] | None, result: Path | None = None) -> dict[str, Path]:
    """Return recorder name to folder from `--record NAME,NAME` and `--record NAME=FOLDER`.

    Recorders that name no folder write into `STEM-recordings/NAME` beside `STEM.json`, the result; without one, into a
    folder of BenchBot's own. Raises BenchbotError for a text that is neither, and for a recorder that is named twice.
    """
    found: dict[str, Path] = {}
    for text in wanted or ():
        name, equals, folder = text.partition("=")
        named = {name: Path(folder)} if equals else {one: _beside(result) / one for one in text.split(",")}
        if not all(named) or (equals and (not folder or "," in text)) or found.keys() & named.keys():
            mixed = equals and "," in text and all(part.strip("=") for part in text.split(","))
            meant = text.split(",") if mixed else ["mcap,video", "frames=FOLDER"]
            raise BenchbotError(
                f"--record {text} cannot be understood.",
                "It names recorders, each once, or one recorder and the folder that it writes into.",
                f"Write it like this: {' '.join(f'--record {part}' for part in meant)}. "
                "There are: benchbot list recorders",
            )
        found |= named
    return found


def key_values(option: str, texts: Sequence[str] | None) -> dict[str, Any]:
    """Return `KEY=VALUE` texts as a mapping; raises BenchbotError for one that is none."""
    found: dict[str, Any] = {}
    for text in texts or ():
        key, separator, value = text.partition("=")
        if not separator or not key:
            raise BenchbotError(
                f"{option} {text} sets nothing.",
                "An option is a name, an equals sign and a value.",
                f"Write it like this: {option} name=value",
            )
        found[key] = value
    return found


def _beside(result: Path | None) -> Path:
    if result is not None:
        file = result / "result.json" if result.is_dir() else result
        return file.parent / f"{file.stem}-recordings"
    from benchbot.core import resources

    return resources.state_dir() / "recordings" / time.strftime("%Y%m%d-%H%M%S")


def tell_recordings(folders: dict[str, Path]) -> None:
    """Say where recordings are, and what is missing from them."""
    if folders:
        from benchbot.cli.kit import console
        from benchbot.core import recording

        for name, folder in folders.items():
            console.note(f"Recording: {folder} ({name})")
        for problem in recording.problems(folders):
            console.note(f"Warning: {problem}")


def group(help_line: str, kind: type[TyperGroup] = TyperGroup) -> typer.Typer:
    """Return an app that holds sub-commands."""
    return typer.Typer(
        cls=kind,
        help=help_line,
        add_completion=False,
        no_args_is_help=True,
        rich_markup_mode=None,
        context_settings=QUICK,
    )
