"""An item of the pack: the maker of its model, and its entry in the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from tools.household.model import Model

Size: TypeAlias = tuple[float, float, float]
Nodes: TypeAlias = Mapping[str, Model]


@dataclass(frozen=True)
class Surface:
    """A horizontal rectangle that things can stand on, in the finished model's frame, in metres."""

    z_m: float
    low_m: tuple[float, float]
    high_m: tuple[float, float]
    headroom_m: float


@dataclass(frozen=True)
class Item:
    """A model to make.

    `make` yields the model facing +x, or several named nodes of it (a door's `leaf`). Where its origin lies does not
    matter; it is moved to the middle of the bottom face. `surfaces` yields what things can stand on, from the
    finished size. Textures are reduced to `texture_px` pixels a side.
    """

    id: str
    kind: str
    make: Callable[[], Model | Nodes]
    category: str | None = None
    placement: str = "surface"
    surfaces: Callable[[Size], tuple[Surface, ...]] | None = None
    is_group: bool = False
    texture_px: int = 256


OPEN_ABOVE_M = 1.2


def top(inset_m: float = 0.04, z_m: float | None = None) -> Callable[[Size], tuple[Surface, ...]]:
    """The whole upper face but for a margin; at `z_m` when that is not the box's top."""

    def surfaces(size: Size) -> tuple[Surface, ...]:
        x, y = size[0] / 2 - inset_m, size[1] / 2 - inset_m
        return (Surface(size[2] if z_m is None else z_m, (-x, -y), (x, y), OPEN_ABOVE_M),)

    return surfaces


def round_top() -> Callable[[Size], tuple[Surface, ...]]:
    """The square within a round table's top."""

    def surfaces(size: Size) -> tuple[Surface, ...]:
        x, y = 0.34 * size[0], 0.34 * size[1]
        return (Surface(size[2], (-x, -y), (x, y), OPEN_ABOVE_M),)

    return surfaces


def shelves(
    levels_m: tuple[float, ...], headroom_m: float, side_m: float = 0.04, front_m: float = 0.02, with_top: bool = False
) -> Callable[[Size], tuple[Surface, ...]]:
    """Boards at these heights, and the top on request; `side_m` and `front_m` are margins."""

    def surfaces(size: Size) -> tuple[Surface, ...]:
        x, y = size[0] / 2 - front_m, size[1] / 2 - side_m
        boards = tuple(Surface(z, (-x, -y), (x, y), headroom_m) for z in levels_m)
        return boards + ((Surface(size[2], (-x, -y), (x, y), OPEN_ABOVE_M),) if with_top else ())

    return surfaces
