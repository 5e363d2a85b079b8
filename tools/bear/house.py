"""The house: what its published objects are made of, and what carries those that were published in the air."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchbot_scenes.layout import Layout
from tools.bear import house_decor
from tools.bear import house_plan as plan
from tools.bear.environment import as_published
from tools.bear.furnish import PACK, against, fitted, stand
from tools.bear.house_models import CHOICES
from tools.bear.published import load_published

if TYPE_CHECKING:
    from pathlib import Path

    from benchbot_scenes.layout import Placement
    from tools.bear.environment import Environment

NAME = "house"
COUNTER_TOP_M, COUNTER_DEPTH_M, COUNTER_MODULES = 1.039, 0.62, 6

DESCRIPTIONS = {
    1: "A house with an open living room, kitchen, bedroom and two bathrooms, on a clear morning.",
    2: "The house on a summer afternoon; some objects are elsewhere.",
    3: "The house at night in the light of its lamps; some objects are elsewhere.",
    4: "The house late on a winter's day; many objects are elsewhere, and somebody is at home.",
    5: "The house at night in warm light; many objects are elsewhere, and somebody is at home.",
}

_PLACE = {"latitude_deg": 52.0, "north_deg": 90.0}
LIGHTING = {
    1: {"time": "10:00", "date": "2023-05-20", **_PLACE, "lamps": {"on": "none"}},
    2: {"time": "15:30", "date": "2023-06-21", **_PLACE, "lamps": {"on": "none"}},
    3: {"time": "22:30", "date": "2023-10-14", **_PLACE, "lamps": {"on": "all"}},
    4: {"time": "14:30", "date": "2023-02-10", **_PLACE, "lamps": {"on": "none"}},
    5: {"time": "23:00", "date": "2023-02-10", **_PLACE, "lamps": {"on": "all", "temperature_k": 2700, "scale": 0.8}},
}


def house(variant: int, layouts: Path) -> Environment:
    """One variant; `layouts` is the folder of layouts, in which a variant names the first one as its base."""
    published = load_published(NAME, str(variant))
    if variant == 1:
        objects = tuple(fitted(box, CHOICES[box.instance]) for box in published.objects)
        layout = Layout(PACK, plan.building(), (*objects, *_carriers(), *house_decor.decor()))
    else:
        first = {box.instance for box in load_published(NAME, "1").objects}
        kept = {box.instance for box in published.objects}
        added = tuple(fitted(box, CHOICES[box.instance]) for box in published.objects if box.instance not in first)
        layout = Layout(PACK, objects=added, base=layouts / "house_1.yaml", removed=tuple(sorted(first - kept)))
    return as_published(published, DESCRIPTIONS[variant], layout, LIGHTING[variant])


def _carriers() -> list[Placement]:
    """Furniture under what would float, at the heights that were published."""
    return [*_kitchen(), *_living(), *_bedroom(), *_bathroom()]


def _kitchen() -> list[Placement]:
    """A row of counters along the east wall, next to the refrigerator; the sideboard under the books."""
    south, north = 2.64, plan.KITCHEN_NORTH - 0.02
    width = (north - south) / COUNTER_MODULES
    row = [
        against(
            f"counter_{index + 1}",
            "kitchen counter",
            "east",
            plan.KITCHEN_EAST,
            south + (index + 0.5) * width,
            size=(COUNTER_DEPTH_M, width, COUNTER_TOP_M),
        )
        for index in range(COUNTER_MODULES)
    ]
    return [
        *row,
        stand(
            "bottle_riser",
            "shelf_wall_oak",
            (4.045, 5.579),
            COUNTER_TOP_M,
            yaw_deg=180,
            size=(0.34, 0.44, 0.084),
        ),
        against("dining_sideboard", "sideboard", "north", plan.KITCHEN_NORTH, 1.05, size=(0.46, 1.40, 0.672)),
    ]


def _living() -> list[Placement]:
    """The divider between dining corner and hall, the sideboards of living room and lounge."""
    divider = (0.37, 1.20, 1.083)
    return [
        *(
            stand(f"divider_{index + 1}", "bookcase", (x, 2.805), yaw_deg=-90, size=divider)
            for index, x in enumerate((-0.20, 1.005))
        ),
        against("living_sideboard", "sideboard", "west", plan.LIVING_WEST, 1.07, size=(0.42, 1.06, 0.671)),
        against("lounge_sideboard", "sideboard", "south", plan.LIVING_SOUTH, 1.00, size=(0.56, 1.20, 0.538)),
    ]


def _bedroom() -> list[Placement]:
    south = plan.BEDROOM_SOUTH
    return [
        against("desk", "desk_oak", "east", plan.BEDROOM_EAST, -7.70, size=(0.60, 1.72, 0.759)),
        stand("desk_drawers", "bedside table", (0.30, -8.22), yaw_deg=180, size=(0.46, 0.42, 0.427)),
        against("bedside_table_east", "bedside table", "south", south, -0.57, size=(0.42, 0.46, 0.589)),
        against("bedside_table_west", "bedside table", "south", south, -2.86, size=(0.48, 0.46, 0.574)),
        against("chest_of_drawers", "chest of drawers", "west", plan.BEDROOM_WEST, -7.22, size=(0.46, 0.95, 0.684)),
    ]


def _bathroom() -> list[Placement]:
    east = plan.BATH_EAST
    return [
        against("bathroom_cabinet", "chest of drawers", "east", east, -9.01, size=(0.52, 1.00, 1.140)),
        against("towel_cabinet", "chest of drawers", "east", east, -11.22, size=(0.46, 0.72, 1.132)),
        stand("plant_saucer", "tray_walnut", (2.701, -6.763), size=(0.36, 0.36, 0.027)),
    ]
