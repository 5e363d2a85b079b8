"""The kitchen: units and machines."""

from tools.household import kitchen, materials
from tools.household.item import Item, top
from tools.household.model import Model

_LACQUER, _LIGHT = "#5f6f6a", "#e4e1d9"


def _unit(width_m: float, fronts: str, code: str = _LACQUER) -> Model:
    return kitchen.base_unit(width_m, fronts, materials.paint(code, 0.45), materials.worktop(), materials.brass())


ITEMS = (
    Item("kitchen_counter_doors", "kitchen counter", lambda: _unit(0.60, "doors"), None, "floor", top(0.05)),
    Item("kitchen_counter_drawers", "kitchen counter", lambda: _unit(0.60, "drawers"), None, "floor", top(0.05)),
    Item("kitchen_counter_wide", "kitchen counter", lambda: _unit(1.20, "drawers", _LIGHT), None, "floor", top(0.05)),
    Item(
        "wall_cupboard",
        "wall cupboard",
        lambda: kitchen.wall_unit(0.80, materials.paint(_LACQUER, 0.45), materials.brass()),
        None,
        "wall",
    ),
    Item(
        "sink_unit",
        "sink",
        lambda: kitchen.sink_unit(
            0.80, materials.paint(_LACQUER, 0.45), materials.worktop(), materials.brass(), materials.ceramic()
        ),
        "sink",
        "floor",
    ),
    Item(
        "oven_cooker_white",
        "stove",
        lambda: kitchen.cooker(0.60, materials.paint("#eeeeec", 0.25), "ceramic"),
        "oven",
        "floor",
    ),
    Item("oven_range_steel", "stove", lambda: kitchen.cooker(0.76, materials.brushed_steel(), "gas"), "oven", "floor"),
    Item(
        "oven_built_in",
        "oven",
        lambda: kitchen.built_in_oven(0.60, materials.paint(_LACQUER, 0.45), materials.brass()),
        "oven",
        "floor",
    ),
    Item(
        "refrigerator_white",
        "refrigerator",
        lambda: kitchen.refrigerator(
            0.60, 1.85, 0.34, materials.paint("#efefed", 0.22), materials.brushed_steel(), 0.010
        ),
        "refrigerator",
        "floor",
    ),
    Item(
        "refrigerator_retro",
        "refrigerator",
        lambda: kitchen.refrigerator(0.60, 1.50, -0.28, materials.paint("#8fb5ab", 0.18), materials.chrome(), 0.06),
        "refrigerator",
        "floor",
    ),
    Item(
        "refrigerator_steel",
        "refrigerator",
        lambda: kitchen.side_by_side(0.91, 1.78, materials.brushed_steel(), materials.chrome()),
        "refrigerator",
        "floor",
    ),
    Item(
        "microwave_black",
        "microwave",
        lambda: kitchen.microwave(0.48, 0.36, 0.28, materials.paint("#202224", 0.3), "buttons"),
        "microwave",
        surfaces=top(0.04),
    ),
    Item(
        "microwave_white",
        "microwave",
        lambda: kitchen.microwave(0.45, 0.34, 0.26, materials.paint("#ecebe7", 0.3), "dials"),
        "microwave",
        surfaces=top(0.04),
    ),
    Item(
        "microwave_steel",
        "microwave",
        lambda: kitchen.microwave(0.52, 0.40, 0.30, materials.brushed_steel(), "buttons"),
        "microwave",
        surfaces=top(0.04),
    ),
    Item(
        "toaster_steel",
        "toaster",
        lambda: kitchen.toaster(0.28, 0.17, 0.19, materials.brushed_steel(), materials.paint("#1d1e20", 0.4)),
        "toaster",
    ),
    Item(
        "toaster_red",
        "toaster",
        lambda: kitchen.toaster(0.30, 0.18, 0.20, materials.paint("#9b2f2a", 0.2), materials.chrome()),
        "toaster",
    ),
    Item(
        "toaster_cream",
        "toaster",
        lambda: kitchen.toaster(0.36, 0.16, 0.19, materials.paint("#e6dcc3", 0.25), materials.brushed_steel(), 1),
        "toaster",
    ),
)
