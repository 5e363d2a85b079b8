"""Apartment, office and company: places drawn from a seed, and what differs in their variants."""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot_scenes.catalogue import pack
from benchbot_scenes.coverage import plan_coverage
from benchbot_scenes.generator.changes import changed
from benchbot_scenes.generator.generate import Generated, generate
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.layout import Layout, read_layout
from benchbot_scenes.scene_file import scene_file
from benchbot_scenes.visibility import CARTER
from tools.bear.environment import Environment

if TYPE_CHECKING:
    from benchbot_scenes.scene import SceneGeometry


@dataclass(frozen=True)
class Place:
    """The parameters of a place; `north_deg` is the direction of north in its map."""

    kind: str
    rooms: int
    seed: int
    north_deg: float
    lamps_k: float
    description: str


PLACES = {
    "apartment": Place("apartment", 5, 2, 60.0, 2700.0, "A generated apartment of five rooms."),
    "office": Place("office", 6, 11, 90.0, 4000.0, "A generated office: open workplaces, offices, a meeting room."),
    "company": Place("company", 7, 3, 120.0, 4000.0, "A generated company: lobby, workplaces, offices, a pantry."),
}

# As published: 1 is the base, 2 and 4 are by day, 3 and 5 by night; 4 and 5 differ in more.
LIGHT: dict[int, dict[str, Any]] = {
    1: {"time": "14:00", "date": "2023-04-20"},
    2: {"time": "10:30", "date": "2023-06-21"},
    3: {"time": "22:30", "date": "2023-11-10"},
    4: {"time": "16:00", "date": "2023-09-15"},
    5: {"time": "20:30", "date": "2023-01-20"},
}
NIGHTS = (3, 5)
LATITUDE_DEG = -27.5
# How many objects are removed, moved and added, and how many people come.
CHANGES = {2: (4, 1, 4, 0), 3: (3, 1, 3, 0), 4: (6, 2, 6, 1), 5: (5, 3, 6, 1)}


def generated(name: str, variant: int, layouts: Path) -> Environment:
    """A variant of one of `PLACES`; `layouts` is the folder that the first variant's layout is, or will be, in."""
    place = PLACES[name]
    base = _base(name)
    if variant == 1:
        layout = base.layout
    else:
        removed, moved, added, people = CHANGES[variant]
        file = layouts / f"{name}_1.yaml"
        layout = changed(base, file, variant, pack("household"), removed, moved, added, people)
    geometry = _composed(layout, base.layout, layouts / f"{name}_{variant}.yaml")
    start, poses = _trajectory(base, geometry, variant)
    return Environment(name, variant, place.description, layout, start, poses, lighting(place, variant))


def lighting(place: Place, variant: int) -> dict[str, Any]:
    """Daylight with lamps off, or night with lamps on."""
    lamps = {"on": "all", "temperature_k": place.lamps_k} if variant in NIGHTS else {"on": "none"}
    return {**LIGHT[variant], "latitude_deg": LATITUDE_DEG, "north_deg": place.north_deg, "lamps": lamps}


@cache
def _base(name: str) -> Generated:
    place = PLACES[name]
    return generate(place.seed, place.kind, place.rooms, pack("household"))


def _composed(layout: Layout, base: Layout, file: Path) -> SceneGeometry:
    """The scene of a layout that may not be on disk yet."""
    from benchbot_scenes.layout import write_layout

    with tempfile.TemporaryDirectory() as folder:
        beside = Path(folder, file.name)
        if layout.base is not None:
            written = Path(folder, layout.base.name)
            write_layout(written, base)
            layout = replace(layout, base=written)
        write_layout(beside, layout)
        read_layout(beside)
        return load_scene(scene_file(beside, Path(folder, "cache")))


def _trajectory(
    base: Generated, geometry: SceneGeometry, variant: int
) -> tuple[tuple[float, ...], tuple[tuple[float, ...], ...]]:
    """Each variant starts somewhere else on the base's way."""
    ways = base.trajectory_poses
    first = len(ways) * (variant - 1) // 5
    for pose in (*ways[first:], *ways[:first]):
        heading = 2 * math.atan2(pose[3], pose[0])
        coverage = plan_coverage(geometry, (pose[4], pose[5], heading), CARTER)
        if coverage.poses:
            return coverage.poses[0], coverage.poses
    raise RuntimeError("the robot fits nowhere on its way")
