"""Lamps. A shade radiates about what a 60 W bulb behind cloth does, a bare bulb some ten times as much."""

from tools.household import lamps, materials, textures
from tools.household.item import Item
from tools.household.lamps import glow
from tools.household.model import Material


def _glaze() -> Material:
    return Material("lamp glaze", base_color_texture=textures.reactive_glaze(), roughness=0.3)


ITEMS = (
    Item(
        "floor_lamp_drum",
        "floor lamp",
        lambda: lamps.floor_lamp(1.62, materials.black_steel(), glow("shade", 0.5)),
        None,
        "floor",
    ),
    Item(
        "floor_lamp_tripod",
        "floor lamp",
        lambda: lamps.tripod_lamp(1.52, materials.wood("oak"), glow("shade", 0.4)),
        None,
        "floor",
    ),
    Item(
        "floor_lamp_arc",
        "floor lamp",
        lambda: lamps.arc_lamp(1.95, 1.10, materials.brass(), glow("bulb", 5.0)),
        None,
        "floor",
    ),
    Item(
        "table_lamp_stoneware", "table lamp", lambda: lamps.table_lamp(0.30, 0.48, _glaze(), glow("shade", 0.4), True)
    ),
    Item(
        "table_lamp_brass",
        "table lamp",
        lambda: lamps.table_lamp(0.24, 0.42, materials.brass(), glow("shade", 0.5), False),
    ),
    Item("table_lamp_globe", "table lamp", lambda: lamps.globe_lamp(0.11, materials.wood("walnut"), glow("ball", 0.5))),
    Item("table_lamp_desk", "table lamp", lambda: lamps.desk_lamp(materials.black_steel(), glow("bulb", 6.0))),
    Item(
        "pendant_lamp_dome",
        "pendant lamp",
        lambda: lamps.pendant(0.75, "dome", materials.paint("#2f4a45", 0.35), glow("bulb", 6.0)),
        None,
        "ceiling",
    ),
    Item(
        "pendant_lamp_globe",
        "pendant lamp",
        lambda: lamps.pendant(0.60, "globe", materials.brass(), glow("ball", 0.8)),
        None,
        "ceiling",
    ),
    Item(
        "pendant_lamp_drum",
        "pendant lamp",
        lambda: lamps.pendant(0.45, "drum", materials.black_steel(), glow("shade", 0.5)),
        None,
        "ceiling",
    ),
    Item(
        "ceiling_lamp_disc",
        "ceiling lamp",
        lambda: lamps.ceiling_lamp("disc", materials.brushed_steel(), glow("opal", 0.9, "#ffe9cc")),
        None,
        "ceiling",
    ),
    Item(
        "ceiling_lamp_panel",
        "ceiling lamp",
        lambda: lamps.ceiling_lamp("panel", materials.paint("#f0f0ee"), glow("panel", 0.7, "#fff6ea")),
        None,
        "ceiling",
    ),
)
