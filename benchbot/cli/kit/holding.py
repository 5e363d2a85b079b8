"""Options of commands that hold a solution while it runs: in which mode, with what limits; and holding it so."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import key_values
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.submission.modes import ProcessLimits, SolutionSpec

SandboxCommand = Annotated[
    str | None, typer.Option("--sandbox", metavar="COMMAND", help="Run this command, held in a sandbox.")
]
Sandboxed = Annotated[bool, typer.Option("--sandboxed", help="Hold the example in a sandbox, too.")]
Readable = Annotated[
    list[Path] | None,
    typer.Option("--readable", metavar="PATH", help="Let it read this file or folder in the sandbox; repeatable."),
]
Containerised = Annotated[
    Path | None,
    typer.Option(
        "--containerised", "-c", metavar="FOLDER", help="Build the Dockerfile in this folder, and run the container."
    ),
]
ExampleContainerised = Annotated[
    bool, typer.Option("--example-containerised", help="Run the example in a container instead.")
]
Cpus = Annotated[
    float | None, typer.Option("--cpus", metavar="N", min=0.01, help="The container may use so many CPUs.")
]
Gpus = Annotated[int, typer.Option("--gpus", metavar="N", min=0, help="Give the container so many GPUs.")]
V2Client = Annotated[
    bool, typer.Option("--v2-client", help="It uses the client of BenchBot v2: let that find the run and its result.")
]
WeakLimits = Annotated[
    bool, typer.Option("--weak-limits", help="Run it even where limits would not hold, if you trust it.")
]

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

LogLimit = Annotated[
    str | None,
    typer.Option("--log-limit", metavar="SIZE", help="Keep so much of its output: beginning and end. [default: 10MiB]"),
]

NATIVE, V2_CLIENT, SANDBOX, CONTAINER = "native", "v2-client", "sandbox", "container"
"""Modes that have options of their own on the command line; only the first is BenchBot's own."""
UNHELD = (NATIVE, V2_CLIENT)
"""Modes in which a solution has all rights of its user."""

_UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12, "ki": 2**10, "mi": 2**20, "gi": 2**30, "ti": 2**40}
_SIZE = re.compile(r"(\d+(?:\.\d+)?) *([kmgt]i?)?b?", re.IGNORECASE)


def process_limits(
    memory: str | None, processes: int | None, cpu_time_s: float | None, file_size: str | None
) -> "ProcessLimits":
    """Return the limits that were asked for; raises BenchbotError for a size that is none."""
    from benchbot.submission.modes import ProcessLimits

    return ProcessLimits(
        size_in_bytes("--memory", memory), processes, cpu_time_s, size_in_bytes("--file-size", file_size)
    )


def size_in_bytes(option: str, text: str | None) -> int | None:
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


def container_options(
    catalog: "Catalog", containerised: Path | None, example: str | None, others: Sequence[str | None], contained: bool
) -> dict[str, Any] | None:
    """Return the folder, and the file if it is named, to build the solution's image from; None without a container.

    `others` are the commands that were given, `contained` whether the example is to run in its container. Raises
    BenchbotError when the example has none, or something else is to be run, too.
    """
    if containerised is None and not contained:
        return None
    if containerised is not None:
        if contained or example is not None or any(other is not None for other in others):
            raise BenchbotError(
                "It is not clear what to submit.",
                "--containerised was given, and a command or an example.",
                "Give one; an example's own container: --example NAME --example-containerised",
            )
        return {"folder": str(containerised)}
    if example is None:
        raise BenchbotError(
            "It is not clear which example to run.",
            "--example-containerised was given, and no example.",
            "Name one: --example NAME --example-containerised; or build a folder of yours: --containerised FOLDER",
        )
    found = catalog.get("examples", example)
    folder, file = found.data.get("container_directory"), found.data.get("container_filename")
    if folder is None and file is None:
        raise BenchbotError(
            f"The example '{found.name}' has no container.",
            "Its declaration has neither container_directory nor container_filename.",
            f"Run it on this machine: --example {found.name}; or held in a sandbox: --sandboxed",
        )
    inside = found.path.parent / (folder or ".")
    return {"folder": str(inside)} | ({} if file is None else {"file": str(found.path.parent / file)})


def plugin_mode(name: str | None, options: list[str] | None, held: bool) -> tuple[str, dict[str, Any]]:
    """Return the mode that --mode names, and its options; native without one.

    `held` is whether other options hold the solution already. Raises BenchbotError when they do, or for options of no
    mode.
    """
    if name is not None and held:
        raise BenchbotError(
            "It is not clear how to hold the solution.",
            f"--mode {name} was given, and a sandbox or a container.",
            "Give one; a command in a mode that a plug-in brings: --mode NAME --native COMMAND",
        )
    if name in (V2_CLIENT, SANDBOX, CONTAINER):
        raise BenchbotError(
            f"The mode {name} has options of its own.",
            "--mode is for modes that a plug-in brings.",
            "Run it so: --v2-client, --sandbox COMMAND, --example NAME --sandboxed, or --containerised FOLDER",
        )
    if options and name in (None, NATIVE):
        raise BenchbotError(
            "There is no mode to tell.",
            "--mode-option is for a mode that a plug-in brings, and none was named.",
            "Name it: --mode NAME; these are installed: benchbot list modes",
        )
    return name or NATIVE, key_values("--mode-option", options)


def check_secret(secret: str | None, seen: Path) -> None:
    """Raise BenchbotError for a file of a secret that lies in the folder which a held solution sees."""
    if secret not in (None, "random") and Path(str(secret)).resolve().is_relative_to(seen.resolve()):
        raise BenchbotError(
            "The solution could read the secret of its run.",
            f"{secret} is in the folder that it sees, {seen}.",
            "Move it out of that folder, as all results with the same secret.",
        )


def check_options(mode: str, readable: object, limits: "ProcessLimits", weak_limits: bool, *container: object) -> None:
    """Raise BenchbotError for options that the mode does not know; `container` are those of containers."""
    from benchbot.submission.modes import DEFAULT_LIMITS

    if mode != CONTAINER and any(container):
        raise BenchbotError(
            "There is no container.",
            "--cpus and --gpus are about one.",
            "Run the solution in a container: --containerised FOLDER, or --example NAME --example-containerised",
        )
    if weak_limits and mode not in (*UNHELD, SANDBOX, CONTAINER):
        raise BenchbotError(
            f"--weak-limits says nothing to the mode {mode}.",
            "It is about the limits of a sandbox or a container.",
            "Leave it out; what the mode itself can be told: --mode-option KEY=VALUE",
        )
    if mode == CONTAINER and readable:
        raise BenchbotError(
            "A container sees nothing but its image.",
            "--readable is about what a sandbox shows of this machine.",
            "Have the Dockerfile copy what is needed: COPY my_file /solution/",
        )
    if mode in UNHELD and (readable or weak_limits or limits != DEFAULT_LIMITS):
        raise BenchbotError(
            "A native solution cannot be limited.",
            "--memory, --processes, --cpu-time, --file-size, --weak-limits and --readable are about what holds a "
            "solution, and nothing holds a native one.",
            "Run it in a sandbox: --sandbox COMMAND, --example NAME --sandboxed, or --containerised FOLDER",
        )


@contextmanager
def held(catalog: "Catalog", spec: "SolutionSpec", mode: str, options: Mapping[str, Any]) -> Iterator["SolutionSpec"]:
    """Yield the order as it is run in a mode, after proving that this machine can; says how the solution is held.

    A build of an image, which takes time, is followed on stderr. Raises BenchbotError when the mode does not work here.
    """
    if mode == NATIVE:
        yield spec
        return
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.submission.modes import holder_of

    with ExitStack() as stack:
        with StatusLine() as status:

            def tell(line: str) -> None:
                status.show(line, line, urgent=line.upper().startswith(("STEP ", "BUILDING ", "THE IMAGE ")))

            prepared = stack.enter_context(holder_of(catalog.plugins, mode).prepared(spec, options, tell))
        console.note(f"The solution runs {prepared.mode.describe()}.")
        if prepared.weak_limits:
            weak = ", ".join(prepared.weak_limits)
            console.note(f"Its limits are weak, each process for itself at most: {weak}. The result says so.")
        yield prepared
