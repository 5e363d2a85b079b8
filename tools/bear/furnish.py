"""Placements: models fitted into published boxes, and set down as carriers and decoration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from benchbot_scenes.catalogue import AssetModel, load_catalogue, packs
from benchbot_scenes.layout import Placement

if TYPE_CHECKING:
    from tools.bear.published import Box

Size: TypeAlias = tuple[float, float, float]
Side = Literal["west", "south", "east", "north"]

PACK = "household"
# What stands at a side of a room looks into it; models face +x.
FACING_DEG: dict[Side, float] = {"west": 0.0, "south": 90.0, "east": 180.0, "north": -90.0}
_INTO_ROOM: dict[Side, tuple[int, int]] = {"west": (1, 0), "south": (0, 1), "east": (-1, 0), "north": (0, -1)}
WALL_GAP_M = 0.003


@dataclass(frozen=True)
class Choice:
    """The model of a published object and its direction: models face +x, turned by quarters."""

    model: str
    yaw_deg: float = 0.0


def asset(name: str, size: Size | None = None) -> AssetModel:
    """The pack's model of this id, or the one of this kind that needs the least stretching to a size.

    Raises BenchbotError when there is neither.
    """
    catalogue = load_catalogue(packs()[PACK])
    of_kind = catalogue.of_kind(name)
    if name in catalogue.models or not of_kind:
        return catalogue.model(name)
    return min(of_kind, key=lambda model: _stretch(model.size_m, size or model.size_m))


def fitted(box: Box, choice: Choice) -> Placement:
    """The placement whose axis-aligned box, once turned, is the published one."""
    quarter = choice.yaw_deg % 180 == 90
    extent = (box.extent[1], box.extent[0], box.extent[2]) if quarter else box.extent
    model = asset(choice.model)
    x, y, z = box.centroid
    return Placement(
        box.instance,
        model.id,
        (x, y, z - box.extent[2] / 2),
        choice.yaw_deg,
        extent,
        None if model.class_name == box.category else box.category,
        None if model.is_group == box.is_group else box.is_group,
    )


def stand(
    name: str, model: str, at: tuple[float, float], z_m: float = 0.0, yaw_deg: float = 0.0, size: Size | None = None
) -> Placement:
    """A carrier or decoration, which no map names: the middle of its bottom at a place, in its own size by default."""
    found = asset(model, size)
    return Placement(name, found.id, (*at, z_m), yaw_deg, size, "" if found.class_name else None)


def against(
    name: str,
    model: str,
    side: Side,
    wall_m: float,
    along_m: float,
    z_m: float = 0.0,
    size: Size | None = None,
    gap_m: float = WALL_GAP_M,
) -> Placement:
    """The same with its back at a wall: `wall_m` is where the wall's face is, `along_m` the place along it."""
    found = asset(model, size)
    depth = (size or found.size_m)[0] / 2 + gap_m
    step = _INTO_ROOM[side]
    at = (wall_m + step[0] * depth, along_m) if side in ("west", "east") else (along_m, wall_m + step[1] * depth)
    return stand(name, model, at, z_m, FACING_DEG[side], size)


def hanging(name: str, model: str, at: tuple[float, float], ceiling_m: float) -> Placement:
    """A lamp whose top is at the ceiling."""
    return stand(name, model, at, ceiling_m - asset(model).size_m[2])


def _stretch(size: Size, wanted: Size) -> float:
    """The unevenness of scaling a size to another one: the ratio of two axes' scales, and a little of the scale."""
    scale = np.log(np.array(wanted) / np.array(size))
    return float(np.ptp(scale) + 0.2 * abs(scale.mean()))
