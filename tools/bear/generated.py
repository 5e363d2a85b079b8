"""Apartment, office and company: drawn once by the generator and kept as data; truths and maps are measured on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot_scenes.layout import read_layout
from tools.bear.environment import Environment

PACKAGE = Path(str(files("benchbot_envs_bear")))


@dataclass(frozen=True)
class Place:
    """The parameters of a place; `north_deg` is the direction of north in its map."""

    north_deg: float
    lamps_k: float
    description: str


PLACES = {
    "apartment": Place(60.0, 2700.0, "A generated apartment of five rooms."),
    "office": Place(90.0, 4000.0, "A generated office: open workplaces, offices, a meeting room."),
    "company": Place(120.0, 4000.0, "A generated company: lobby, workplaces, offices, a pantry."),
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


def generated(name: str, variant: int, layouts: Path) -> Environment:
    """A variant of one of `PLACES`, with the layout and the poses in the package; `layouts` holds its base, if any.

    What the generator makes of a seed changes from version to version, and these places must not.
    """
    place, stem = PLACES[name], f"{name}_{variant}"
    layout = read_layout(PACKAGE / "layouts" / f"{stem}.yaml")
    if layout.base is not None:
        layout = replace(layout, base=layouts / layout.base.name)
    declared = schema.read(PACKAGE / "environments" / f"{stem}.yaml")
    poses = tuple(tuple(pose) for pose in declared["trajectory_poses"])
    start = tuple(declared["start_pose"])
    return Environment(name, variant, place.description, layout, start, poses, lighting(place, variant))


def lighting(place: Place, variant: int) -> dict[str, Any]:
    """Daylight with lamps off, or night with lamps on."""
    lamps = {"on": "all", "temperature_k": place.lamps_k} if variant in NIGHTS else {"on": "none"}
    return {**LIGHT[variant], "latitude_deg": LATITUDE_DEG, "north_deg": place.north_deg, "lamps": lamps}
