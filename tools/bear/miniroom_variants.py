"""The bed-sitting room's variants: the first is a finished scene; what differs from it in the others, and the light."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchbot_scenes.layout import Layout, Move
from tools.bear.environment import as_published
from tools.bear.furnish import PACK, Choice, against, fitted, stand
from tools.bear.miniroom import COUNTER_TOP, ROOM, miniroom
from tools.bear.published import load_published

if TYPE_CHECKING:
    from pathlib import Path

    from benchbot_scenes.layout import Placement
    from tools.bear.environment import Environment

NAME = "miniroom"

CHOICES = {
    "banana_8": Choice("banana_bunch"),
    "AIUE_V01_001_Books_14": Choice("magazines"),
    "SM_AI_vol4_2_set_book_1_20": Choice("book_lying"),
    "prop_wine_bottle_001_v1_11": Choice("bottle_wine"),
    "prop_wine_bottle_001_v1_2": Choice("bottle_wine"),
    "AIUE_V01_001_Bowl_17": Choice("bowl_wood"),
    "SM_AI_vol3_2_bowl_03_14": Choice("bowl_glazed"),
    "kitchen_006_bowl_v1_17": Choice("bowl_cereal"),
    "furniture_chair_002_v1_17": Choice("armchair_blue"),
    "SM_AI_vol5_2_alarmclock_01_13": Choice("clock_wall_station"),
    "SM_Laptop_5": Choice("laptop_silver", 180),
    "AIUE_V01_002_orange_11": Choice("orange_navel"),
    "AIUE_V01_002_orange_14": Choice("orange_mandarin"),
    "AIUE_V01_002_orange_8": Choice("orange_navel"),
    "average_man_02_person_8": Choice("person_man_standing", -90),
    "person_sit_7": Choice("person_woman_sitting", 90),
    "AIUE_V01_001_Flower5_10": Choice("plant_dracaena"),
    "SM_AI_vol4_5_Toaster_5": Choice("toaster_steel", -90),
    "toaster_2": Choice("toaster_cream"),
}

DESCRIPTIONS = {
    1: "A sunny bed-sitting room with a kitchenette and a dining corner.",
    2: "The bed-sitting room on a summer afternoon; some objects are elsewhere.",
    3: "The bed-sitting room at night in the light of its lamps; some objects are elsewhere.",
    4: "The bed-sitting room on a bright winter's day; many objects are elsewhere, and somebody is at home.",
    5: "The bed-sitting room at night in warm light; many objects are elsewhere, and somebody is at home.",
}

_PLACE = {"latitude_deg": 52.0, "north_deg": 90.0}
LIGHTING = {
    1: {
        "sun": {"azimuth_deg": 297.0, "elevation_deg": 36.0, "irradiance": [4.6, 4.25, 3.7]},
        "sky": {"zenith": [0.85, 1.15, 1.65], "horizon": [1.55, 1.66, 1.78], "ground": [0.30, 0.32, 0.26]},
    },
    2: {"time": "15:30", "date": "2023-06-21", **_PLACE, "lamps": {"on": "none"}},
    3: {"time": "22:30", "date": "2023-10-14", **_PLACE, "lamps": {"on": "all"}},
    4: {"time": "11:00", "date": "2023-02-10", **_PLACE, "lamps": {"on": "none"}},
    5: {"time": "23:00", "date": "2023-02-10", **_PLACE, "lamps": {"on": "all", "temperature_k": 2700}},
}

# The first variant's chest of drawers: its box, seen from above. Others have things on shelves there.
CHEST_LOW, CHEST_HIGH = (-0.895, 0.07), (-0.465, 1.19)
RACK_LEVELS_M = (0.119, 0.462, 0.965)
RACK_SHELF_M = RACK_LEVELS_M[0]

# What carried only what a variant has no more of.
_ORPHANS = {
    "SM_AI_vol3_2_plant_01_22": ("saucer",),
    "AIUE_V01_001_Books2_2": ("board",),
    "SM_AI_vol3_3_sink_01_0": ("tap",),
}


def miniroom_variant(variant: int, layouts: Path) -> Environment:
    """One variant; `layouts` is the folder of layouts, beside that of the finished scene, the base of the others."""
    published, first = load_published(NAME, str(variant)), load_published(NAME, "1")
    if variant == 1:
        return as_published(first, DESCRIPTIONS[1], miniroom(first), LIGHTING[1])
    known = {box.instance for box in first.objects}
    removed = sorted(known - {box.instance for box in published.objects})
    orphans = [name for instance in removed for name in _ORPHANS.get(instance, ())]
    added = [fitted(box, CHOICES[box.instance]) for box in published.objects if box.instance not in known]
    gone, moved, carriers = _CHANGES[variant]()
    layout = Layout(
        PACK,
        objects=(*added, *carriers),
        base=layouts.parent / "scenes" / "miniroom_1.glb",
        removed=(*removed, *orphans, *gone),
        moved=tuple(moved),
    )
    return as_published(published, DESCRIPTIONS[variant], layout, LIGHTING[variant])


Changes = tuple[list[str], list[Move], list["Placement"]]


def _second() -> Changes:
    """The stool was published in the air: it stands on a floor cushion."""
    return [], [], [stand("floor_cushion", "cushion", (-0.1797, -0.4709), size=(0.56, 0.56, 0.070))]


def _third() -> Changes:
    """Shelves instead of the chest, and a lamp that shines at night."""
    return ["chest_of_drawers", "floor_lamp"], [], [*_rack(), stand("reading_lamp", "floor_lamp_drum", (-0.66, 2.16))]


def _fourth() -> Changes:
    """A bowl on a wall shelf, a board over the basin's hole; the lamp makes way for a person."""
    shelf = against("bowl_shelf", "shelf_wall_oak", "west", ROOM.west, 0.49, 1.330, size=(0.37, 0.75, 0.167))
    cover = stand("chopping_board", "tray", (-0.59, 3.078), COUNTER_TOP, yaw_deg=90, size=(0.32, 0.37, 0.02))
    aside = Move("floor_lamp", (-0.68, -0.19, 0.0))
    return ["chest_of_drawers", "picture_1"], [aside], [*_rack(), shelf, cover]


def _fifth() -> Changes:
    """A clock on a bracket at the wall, and a lamp that shines at night where it leaves the clock free."""
    bracket = against("clock_shelf", "shelf_wall_oak", "west", ROOM.west, 2.0, 1.476, size=(0.13, 0.40, 0.100))
    lamp = stand("reading_lamp", "floor_lamp_drum", (-0.66, -0.17))
    return ["chest_of_drawers", "floor_lamp"], [], [*_rack(), bracket, lamp]


_CHANGES = {2: _second, 3: _third, 4: _fourth, 5: _fifth}


def _rack() -> list[Placement]:
    """Three wall shelves where the chest stood, the highest as high as it was."""
    depth, width = CHEST_HIGH[0] - CHEST_LOW[0], CHEST_HIGH[1] - CHEST_LOW[1]
    at = (CHEST_LOW[0] + CHEST_HIGH[0]) / 2, (CHEST_LOW[1] + CHEST_HIGH[1]) / 2
    return [
        stand(f"rack_{number}", "shelf_wall_white", at, top - RACK_SHELF_M, size=(depth, width, RACK_SHELF_M))
        for number, top in enumerate(RACK_LEVELS_M, 1)
    ]
