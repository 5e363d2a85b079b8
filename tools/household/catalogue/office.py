"""Clocks, whiteboards, coat racks, plant stands."""

from tools.household import materials, office
from tools.household.item import Item, round_top

ITEMS = (
    Item(
        "clock_wall_roman",
        "wall clock",
        lambda: office.wall_clock(0.32, materials.wood("walnut"), "roman", 10, 8),
        "clock",
        "wall",
    ),
    Item(
        "clock_wall_dark",
        "wall clock",
        lambda: office.wall_clock(0.28, materials.brass(), "dots", 2, 50),
        "clock",
        "wall",
    ),
    Item(
        "clock_wall_station",
        "wall clock",
        lambda: office.wall_clock(0.30, materials.black_steel(), "station", 7, 25),
        "clock",
        "wall",
    ),
    Item("clock_mantel", "clock", lambda: office.mantel_clock(materials.wood("cherry")), "clock"),
    Item("whiteboard_wall", "whiteboard", lambda: office.whiteboard(1.50, 1.00, False), None, "wall"),
    Item("whiteboard_wheels", "whiteboard", lambda: office.whiteboard(1.40, 0.95, True), None, "floor"),
    Item(
        "coat_rack_stand",
        "coat rack",
        lambda: office.coat_stand(materials.wood("beech"), materials.brass()),
        None,
        "floor",
    ),
    Item(
        "coat_rack_wall",
        "coat rack",
        lambda: office.coat_rail(0.80, materials.wood("oak"), materials.black_steel()),
        None,
        "wall",
    ),
    Item(
        "plant_stand_oak",
        "plant stand",
        lambda: office.plant_stand(0.45, 0.32, materials.wood("oak")),
        None,
        "floor",
        round_top(),
    ),
    Item(
        "plant_stand_tall",
        "plant stand",
        lambda: office.plant_stand(0.72, 0.30, materials.wood("walnut")),
        None,
        "floor",
        round_top(),
    ),
)
