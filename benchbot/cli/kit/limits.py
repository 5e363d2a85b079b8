"""The options of `submit` that limit what a solution uses, and how sizes are written."""

import re
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.submission.modes import ProcessLimits

Memory = Annotated[
    str | None,
    typer.Option("--memory", metavar="SIZE", help="It may use so much, e.g. 512MiB. [default: 8GiB]"),
]
Processes = Annotated[
    int | None,
    typer.Option(
        "--processes",
        metavar="N",
        min=1,
        help="It may have so many processes and threads. [default: 512]",
    ),
]
CpuTime = Annotated[
    float | None,
    typer.Option("--cpu-time", metavar="SECONDS", min=1, help="It may use so much time of processors."),
]
FileSize = Annotated[
    str | None,
    typer.Option("--file-size", metavar="SIZE", help="It may write files of so much each. [default: 1GiB]"),
]

_UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12, "ki": 2**10, "mi": 2**20, "gi": 2**30, "ti": 2**40}
_SIZE = re.compile(r"(\d+(?:\.\d+)?) *([kmgt]i?)?b?", re.IGNORECASE)


def process_limits(
    memory: str | None, processes: int | None, cpu_time_s: float | None, file_size: str | None
) -> "ProcessLimits":
    """Return the limits that were asked for; raises BenchbotError for a size that is none."""
    from benchbot.submission.modes import ProcessLimits

    return ProcessLimits(_bytes("--memory", memory), processes, cpu_time_s, _bytes("--file-size", file_size))


def _bytes(option: str, text: str | None) -> int | None:
    """Return a size in bytes: `8GiB`, `500MB`, `1048576`."""
    if text is None:
        return None
    found = _SIZE.fullmatch(text.strip())
    count = 0 if found is None else int(float(found[1]) * _UNITS[(found[2] or "").lower()])
    if count <= 0:
        raise BenchbotError(
            f"{option} {text} is no size.",
            "A size is a number and a unit: KiB, MiB, GiB, or kB, MB, GB; bytes without one.",
            f"Write it like this: {option} 2GiB",
        )
    return count
