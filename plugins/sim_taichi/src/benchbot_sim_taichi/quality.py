"""The rendering quality of colours: the option `quality`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from benchbot.plugin import BenchbotError, did_you_mean


@dataclass(frozen=True)
class Quality:
    """`samples` are paths per pixel: all that `path` takes, the most that `reference` takes, none in the others."""

    name: str
    samples: int


FAST = Quality("fast", 0)
REALTIME = Quality("realtime", 0)
PATH = Quality("path", 16)
REFERENCE = Quality("reference", 4096)
QUALITIES = {quality.name: quality for quality in (FAST, REALTIME, PATH, REFERENCE)}


def from_options(options: Mapping[str, Any]) -> Quality:
    """Read `quality` and `samples` of a simulator's options; raises BenchbotError."""
    name = options.get("quality", REALTIME.name)
    if name not in QUALITIES:
        raise BenchbotError(
            f"There is no quality {name!r}",
            f"Pictures are taken in one of: {', '.join(QUALITIES)}.",
            f"Choose one of those for the option quality.{did_you_mean(str(name), list(QUALITIES))}",
        )
    chosen = QUALITIES[name]
    if "samples" not in options:
        return chosen
    samples = options["samples"]
    if chosen in (FAST, REALTIME):
        raise BenchbotError(
            f"The option samples says nothing in the quality {chosen.name}",
            "Only path and reference take samples.",
            "Add the option quality: path, or remove samples.",
        )
    if isinstance(samples, bool) or not isinstance(samples, int) or not 1 <= samples <= 2**16:
        raise BenchbotError(
            "The option samples is no number of paths",
            f"It is {samples!r}.",
            "Write a whole number from 1 to 65536.",
        )
    return Quality(chosen.name, samples)
