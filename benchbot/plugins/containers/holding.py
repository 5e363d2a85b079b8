"""The submission mode `container` (`benchbot.submission.modes.Holder`): an image that is built from a Dockerfile.

Its options: `folder` and perhaps `file`, which `resolved` turns into `context` and `dockerfile`; `weak_limits`,
`processors` and `gpus`.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchbot.plugins.containers import context, mode
from benchbot.plugins.containers.context import Context
from benchbot.submission.modes import SolutionSpec

IMAGE = "container"
"""The name of all files that an image is built from, taken together."""


def resolved(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options with the Dockerfile found; raises BenchbotError when there is none."""
    rest = {key: value for key, value in options.items() if key not in ("folder", "file")}
    folder, file = Path(options["folder"]), options.get("file")
    found = context.find(folder) if file is None else context.find(Path(file), folder)
    return {**rest, "context": str(found.folder), "dockerfile": found.dockerfile}


@contextmanager
def prepared(spec: SolutionSpec, options: Mapping[str, Any], tell: Callable[[str], object]) -> Iterator[SolutionSpec]:
    """Yield the order as a container of its image; the words of its command go to the image's own.

    `tell` hears of the build. Raises BenchbotError when there is no engine, it would ignore the limits, or the image
    cannot be built.
    """
    source = _context(options)
    with mode.prepared(
        source,
        tell,
        weak_limits=options.get("weak_limits", False),
        processors=options.get("processors"),
        gpus=options.get("gpus", 0),
    ) as held:
        yield replace(spec, command=[held.image, *spec.command], folder=source.folder, mode=held)


def files(options: Mapping[str, Any]) -> Mapping[str, str] | None:
    """Return the hash of all that the image is built from."""
    # Which bases there are differs from machine to machine, and what they are called is in the Dockerfile.
    return {IMAGE: _context(options).digest(lambda _name: None)}


def _context(options: Mapping[str, Any]) -> Context:
    return Context(Path(options["context"]), options["dockerfile"])
