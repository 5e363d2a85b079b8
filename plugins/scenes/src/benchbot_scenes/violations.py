"""Everything that a place may have wrong: what floats, intersects, has no real size, or is neither reached nor seen."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml

from benchbot_scenes.catalogue import AssetModel, pack
from benchbot_scenes.coverage import room_of
from benchbot_scenes.differences import furnished
from benchbot_scenes.free_space import free_space
from benchbot_scenes.intersections import intersecting
from benchbot_scenes.layout import Layout
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.soundness import floating, in_walls
from benchbot_scenes.visibility import CARTER, Observer, targets, unseen

Floats = npt.NDArray[np.float64]

FLOATING, OFF_FLOOR, IN_WALL, INTERSECTING = "floating", "off the floor", "in a wall", "intersecting"
SIZE, NOT_REACHED, NOT_SEEN, TIGHT = "size", "not reached", "not seen", "tight"
OFF_FLOOR_M = 0.02
"""The thickness of a rug: what is for the floor may stand on one."""

WALL_DEPTH_M = 0.01
REACH_M = 1.5
"""How near to each object of a class the middle of the robot comes, seen from above."""

_MEAN_SHARES = (0.5, 1.8)


@dataclass(frozen=True)
class Violation:
    """One thing that is wrong: its kind, the object (and the other one of a pair), and the figure that tells."""

    kind: str
    name: str
    other: str = ""
    figure: str = ""


def placing_violations(layout: Layout, geometry: SceneGeometry) -> list[Violation]:
    """What is wrong with how the objects of a layout stand; `geometry` is its composed scene.

    All placed objects are looked at, labelled or not, and the doors, windows, sills and casings that they may reach
    into. Other parts of the building and the objects of a finished base are not.
    """
    scene = furnished(layout)
    models = {item.id: pack(name).model(item.model) for name, item in scene.objects}
    bodies = _bodies(geometry, models)
    standing = [name for name, model in models.items() if model.placement in ("floor", "surface")]
    found = [Violation(FLOATING, name) for name in floating(geometry, standing)]
    for name, model in models.items():
        bottom_m = float(bodies[name][..., 2].min())
        if model.placement == "floor" and bottom_m > OFF_FLOOR_M:
            found.append(Violation(OFF_FLOOR, name, figure=f"{bottom_m:.2f} m up"))
    if scene.building is not None:
        found += [Violation(IN_WALL, name) for name in in_walls(geometry, scene.building, list(models), WALL_DEPTH_M)]
    openings = scene.building.openings if scene.building is not None else ()
    fitted = {name for opening in openings for name in (opening.name, f"trim {opening.name}")}
    fixed = _bodies(geometry, sorted(fitted & {instance.name for instance in geometry.instances}))
    pairs = intersecting(bodies | fixed)
    found += [Violation(INTERSECTING, *pair) for pair in pairs if not fitted.issuperset(pair)]
    sizes = {item.id: item.size_m or models[item.id].size_m for _, item in scene.objects}
    found += _unreal(models, sizes)
    return found


def driving_violations(
    geometry: SceneGeometry, poses: Sequence[Sequence[float]], robot: Observer = CARTER
) -> list[Violation]:
    """What a robot does not come near to or never sees on its trajectory, and where it has too little room."""
    space = free_space(geometry, robot.z_min_m, robot.z_max_m)
    room_m = room_of(geometry, space, poses, robot)
    found = [] if room_m >= robot.radius_m else [Violation(TIGHT, "trajectory", figure=f"{room_m:.3f} m")]
    found += [Violation(NOT_SEEN, name) for name in unseen(geometry, poses, robot)]
    reached = np.argwhere(space.region((poses[0][4], poses[0][5]), robot.radius_m))
    places = np.array(space.low_m) + (reached + 0.5) * space.cell_m
    for thing in targets(geometry):
        low, high = thing.points[:, :2].min(axis=0), thing.points[:, :2].max(axis=0)
        off = np.maximum(np.maximum(low - places, places - high), 0.0)
        distance_m = float(np.hypot(off[:, 0], off[:, 1]).min(initial=math.inf))
        if distance_m > REACH_M:
            found.append(Violation(NOT_REACHED, thing.name, figure=f"{distance_m:.2f} m away"))
    return found


def _bodies(geometry: SceneGeometry, names: Collection[str]) -> dict[str, Floats]:
    """The triangles (T, 3, 3) of each named object."""
    order = np.argsort(geometry.triangle_instance, kind="stable")
    ends = np.searchsorted(geometry.triangle_instance[order], [instance.index for instance in geometry.instances])
    parts: dict[str, list[npt.NDArray[np.int64]]] = {name: [] for name in names}
    for instance, start in zip(geometry.instances, ends, strict=True):
        if instance.name in parts:
            count = int(np.searchsorted(geometry.triangle_instance[order], instance.index, side="right")) - int(start)
            parts[instance.name].append(order[start : start + count])
    return {
        name: geometry.vertices[geometry.triangles[np.concatenate(own)]].astype(np.float64)
        for name, own in parts.items()
    }


def _unreal(models: Mapping[str, AssetModel], sizes_m: Mapping[str, tuple[float, float, float]]) -> Iterator[Violation]:
    """Objects that are smaller or larger than real ones of their class or kind."""
    for name, model in models.items():
        ranges = size_ranges().get(model.kind) or size_ranges().get(model.class_name or "")
        if ranges is None:
            continue
        x, y, z = sizes_m[name]
        for side, value, (least, most) in zip(
            ("long", "short", "height"), (max(x, y), min(x, y), z), ranges, strict=True
        ):
            if not least <= value <= most:
                figure = f"{side} {value:.2f} m, not {least:.2f} to {most:.2f}"
                yield Violation(SIZE, name, figure=figure)


@cache
def size_ranges() -> dict[str, tuple[tuple[float, float], ...]]:
    """The least and the most of the longer side, the shorter side and the height of each kind or class (sizes.yaml)."""
    table = yaml.safe_load(Path(__file__).with_name("sizes.yaml").read_text(encoding="utf-8"))
    ranges = {}
    for name, entry in table.items():
        if "mean" in entry:
            ranges[name] = tuple((_MEAN_SHARES[0] * mean, _MEAN_SHARES[1] * mean) for mean in entry["mean"])
        else:
            ranges[name] = tuple(
                (float(low), float(high)) for low, high in (entry["long"], entry["short"], entry["height"])
            )
    return ranges
