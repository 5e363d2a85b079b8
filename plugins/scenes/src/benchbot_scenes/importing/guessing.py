"""Estimates of a file's unit, up axis and floor height from its contents."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from benchbot_scenes.importing import names
from benchbot_scenes.importing.model import Model, UpAxis
from benchbot_scenes.importing.vocabulary import TYPICAL_SIZE_M
from benchbot_scenes.scene import SceneGeometry

UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
# What is taken when all else is equal: metres first, feet never without being told.
_RELUCTANCE = {"m": 0.0, "cm": 0.05, "mm": 0.1, "in": 0.2}
_GLTF_RELUCTANCE = {"m": 0.0, "cm": 1.5, "mm": 1.5, "in": 2.0}
ROOM_HEIGHT_M, ROOM_LENGTH_M = (2.0, 4.5), (2.0, 40.0)
_LEVEL_NOUNS = frozenset(("floor", "ground", "ceiling", "roof", "rug", "carpet", "flooring", "lawn", "terrain"))
LOWNESS, PRIOR = 0.7, 0.2
LEVEL_COSINE = 0.95
FLOOR_BIN_M = 0.02
# Undersides count less: that of a floor slab is as large as the floor.
UNDERSIDE_WEIGHT = 0.25
FLOOR_SHARE = 0.4
# The ends of a room along an axis: floor and ceiling, or two walls.
END_SHARE = 0.05


def up_axis(model: Model, prior: UpAxis) -> tuple[UpAxis, str]:
    """Return the axis that points up, and the reason; `prior` is the usual one in files of this kind."""
    if model.up is not None:
        return model.up, "the file's format says so"
    boxes = _boxes(model.geometry)
    votes = {axis: _level_things(boxes, model.paths, axis) for axis in ("y", "z")}
    if votes["y"] != votes["z"]:
        most: UpAxis = "y" if votes["y"] > votes["z"] else "z"
        return most, f"{votes[most]} of its floors, ceilings and rugs lie flat then"
    extent = np.ptp(model.geometry.vertices, axis=0)
    scores = {
        axis: _standing(model.geometry, axis)
        + LOWNESS * math.log(max(extent) / max(float(extent[_column(axis)]), 1e-9))
        + (PRIOR if axis == prior else 0.0)
        for axis in ("y", "z")
    }
    if abs(scores["y"] - scores["z"]) < 0.1:
        return prior, "files of this kind mostly have it so; nothing in this one says otherwise"
    best: UpAxis = "y" if scores["y"] > scores["z"] else "z"
    return best, "it is low along this axis, and what is level lies in its lower half"


def unit(geometry: SceneGeometry, paths: Sequence[tuple[str, ...]], *, is_gltf: bool) -> tuple[str, str]:
    """Return the unit of a scene with z up, in which named objects and rooms have usual sizes, and the reason."""
    named = _named_sizes(geometry, paths)
    extent = np.ptp(geometry.vertices.astype(np.float64), axis=0)
    reluctance = _GLTF_RELUCTANCE if is_gltf else _RELUCTANCE

    def misfit(name: str) -> float:
        scale = UNITS_M[name]
        room = _beyond(extent[2] * scale, ROOM_HEIGHT_M) + _beyond(float(extent[:2].max()) * scale, ROOM_LENGTH_M)
        things = [abs(math.log(size * scale / typical)) for size, typical in named]
        return reluctance[name] + room + (2.0 * float(np.median(things)) if things else 0.0)

    best = min(reluctance, key=misfit)
    size = " x ".join(f"{value * UNITS_M[best]:.1f}" for value in extent)
    things = f", and {len(named)} named things have usual sizes" if named else ""
    if is_gltf and best == "m":
        return best, f"glTF is in metres; the scene is {size} m then"
    return best, f"the scene is {size} m then{things}"


def floor_z_m(geometry: SceneGeometry) -> tuple[float, str]:
    """The height of the floor of a scene in metres, z up: its lowest large level surface, or else its lowest point."""
    height, area = _level_surfaces(geometry, 2)
    low, high = float(geometry.vertices[:, 2].min()), float(geometry.vertices[:, 2].max())
    is_low = height <= low + 0.6 * (high - low)
    if not is_low.any():
        return low, "it has no level surface; this is its lowest point"
    bins = ((height[is_low] - low) / FLOOR_BIN_M).astype(np.int64)
    by_height = np.convolve(np.bincount(bins, area[is_low]), [1.0, 1.0, 1.0], mode="same")
    first = int(np.flatnonzero(by_height >= FLOOR_SHARE * by_height.max())[0])
    near = is_low & (np.abs(height - (low + (first + 0.5) * FLOOR_BIN_M)) <= 1.5 * FLOOR_BIN_M + 1e-6)
    order = np.argsort(height[near])
    shares = np.cumsum(area[near][order])
    middle = height[near][order][int(np.searchsorted(shares, 0.5 * shares[-1]))]
    return round(float(middle), 4), f"the lowest large level surface is there: about {shares[-1]:.0f} m² of it"


def _column(axis: str) -> int:
    return {"x": 0, "y": 1, "z": 2}[axis]


def _level_surfaces(geometry: SceneGeometry, column: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Middles along an axis, and areas, of the triangles that are level."""
    corners = geometry.vertices[geometry.triangles].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_area = np.linalg.norm(cross, axis=1)
    slope = cross[:, column] / double_area
    is_level = np.abs(slope) > LEVEL_COSINE
    weight = np.where(slope > 0, 1.0, UNDERSIDE_WEIGHT)
    return corners[is_level, :, column].mean(axis=1), (weight * double_area / 2)[is_level]


def _standing(geometry: SceneGeometry, axis: str) -> float:
    """In -2 … 2: how much more level surface lies low along an axis than high, of furniture and of the two ends."""
    height, area = _level_surfaces(geometry, _column(axis))
    low, high = geometry.vertices[:, _column(axis)].min(), geometry.vertices[:, _column(axis)].max()
    place = (height - low) / max(high - low, 1e-9)

    def surplus(below: npt.NDArray[np.bool_], above: npt.NDArray[np.bool_]) -> float:
        first, second = float(area[below].sum()), float(area[above].sum())
        return (first - second) / max(first + second, 1e-9)

    is_end = (place < END_SHARE) | (place > 1 - END_SHARE)
    return surplus(~is_end & (place < 0.5), ~is_end & (place >= 0.5)) + surplus(
        is_end & (place < 0.5), is_end & (place >= 0.5)
    )


def _level_things(
    boxes: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]], paths: Sequence[tuple[str, ...]], axis: str
) -> int:
    """The number of objects that should lie flat and do so when an axis points up."""
    count = 0
    for low, high, path in zip(*boxes, paths, strict=True):
        found = names.meaning(path[-1]) if path else None
        size = high - low
        if found and found.noun in _LEVEL_NOUNS and np.isfinite(size).all():
            count += size[_column(axis)] < 0.25 * np.delete(size, _column(axis)).min()
    return count


def _named_sizes(geometry: SceneGeometry, paths: Sequence[tuple[str, ...]]) -> list[tuple[float, float]]:
    """Return the longest sides of objects whose usual size is known, in the file's unit, and that size in metres."""
    sizes = []
    for low, high, path in zip(*_boxes(geometry), paths, strict=True):
        found = names.meaning(path[-1]) if path else None
        typical = TYPICAL_SIZE_M.get(found.class_name or found.noun) if found and not found.is_plural else None
        longest = float((high - low).max())
        if typical is not None and math.isfinite(longest) and longest > 0:
            sizes.append((longest, typical))
    return sizes


def _boxes(geometry: SceneGeometry) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Low and high corners (I, 3) of all instances, infinite for those without triangles."""
    count = len(geometry.instances)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    order = np.argsort(geometry.triangle_instance, kind="stable")
    numbers, first = np.unique(geometry.triangle_instance[order], return_index=True)
    corners = geometry.vertices[geometry.triangles[order]]
    low[numbers - 1] = np.minimum.reduceat(corners.min(axis=1), first, axis=0)
    high[numbers - 1] = np.maximum.reduceat(corners.max(axis=1), first, axis=0)
    return low, high


def _beyond(value: float, allowed: tuple[float, float]) -> float:
    """The distance of a size from its usual range, in powers of e."""
    return max(math.log(allowed[0] / max(value, 1e-9)), math.log(max(value, 1e-9) / allowed[1]), 0.0)
