"""How `submit` runs a solution in a container: its options, the folder that its image is built from, its progress."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.containers.context import Context
    from benchbot.submission.episode import Order
    from benchbot.submission.modes import ProcessLimits

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
WeakLimits = Annotated[
    bool, typer.Option("--weak-limits", help="Run it even where the engine ignores limits, if you trust it.")
]


def context_of(
    catalog: "Catalog", containerised: Path | None, example: str | None, others: Sequence[str | None], contained: bool
) -> "Context | None":
    """Return what to build the solution's image from; None when it is not to run in a container.

    `others` are the commands that were given, `contained` whether the example is to run in its container. Raises
    BenchbotError when there is no Dockerfile, the example has none, or something else is to be run, too.
    """
    from benchbot.plugins.containers import context

    if containerised is None and not contained:
        return None
    if containerised is not None:
        if contained or example is not None or any(other is not None for other in others):
            raise BenchbotError(
                "It is not clear what to submit.",
                "--containerised was given, and a command or an example.",
                "Give one; an example's own container: --example NAME --example-containerised",
            )
        return context.find(containerised)
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
    return context.find(inside if file is None else found.path.parent / file, inside)


def check_options(context: "Context | None", readable: object, *others: object) -> None:
    """Raise BenchbotError for options of containers without one, and for `readable`, the sandbox's, with one."""
    if context is None and any(others):
        raise BenchbotError(
            "There is no container.",
            "--cpus, --gpus and --weak-limits are about one.",
            "Run the solution in a container: --containerised FOLDER, or --example NAME --example-containerised",
        )
    if context is not None and readable:
        raise BenchbotError(
            "A container sees nothing but its image.",
            "--readable is about what a sandbox shows of this machine.",
            "Have the Dockerfile copy what is needed: COPY my_file /solution/",
        )


@contextmanager
def in_container(
    context: "Context",
    words: list[str],
    timeout_s: float | None,
    limits: "ProcessLimits",
    *,
    cpus: float | None,
    gpus: int | None,
    weak_limits: bool,
) -> Iterator["Order"]:
    """Yield what to run: a container, on an engine that is reached meanwhile, of an image that is built, if need be.

    Raises BenchbotError when there is no engine, it would ignore the limits, or the image cannot be built.
    """
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.plugins.containers import mode
    from benchbot.submission.episode import Order

    with ExitStack() as stack:
        with StatusLine() as status:

            def tell(line: str) -> None:
                status.show(line, line, urgent=line.upper().startswith(("STEP ", "BUILDING ", "THE IMAGE ")))

            prepared = stack.enter_context(
                mode.prepared(context, tell, weak_limits=weak_limits, processors=cpus, gpus=gpus or 0)
            )
        console.note(f"The solution runs {prepared.describe()}.")
        yield Order([prepared.image, *words], context.folder, timeout_s=timeout_s, mode=prepared, limits=limits)
