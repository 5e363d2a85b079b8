"""Every environment that can be generated."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from tools.bear.environment import write
from tools.bear.generated import PLACES as GENERATED
from tools.bear.generated import generated
from tools.bear.house import house
from tools.bear.miniroom_variants import miniroom_variant

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tools.bear.environment import Environment

VARIANTS = range(1, 6)
# How a variant of a place is made; the folder is the one that layouts are written to.
PLACES: dict[str, Callable[[int, Path], Environment]] = {
    "miniroom": miniroom_variant,
    "house": house,
    **{name: partial(generated, name) for name in GENERATED},
}


def names() -> list[str]:
    """The environments, as `name:variant`."""
    return [f"{place}:{variant}" for place in PLACES for variant in VARIANTS]


def generate(name: str, folder: Path) -> str:
    """Write all files of an environment (`name:variant`) under `folder`; return a summary line.

    What the first variant is written to must be there for the others: they are differences to it.
    """
    place, variant = name.split(":")
    return write(PLACES[place](int(variant), folder / "layouts"), folder)
