"""Cupboards, shelves, desks and what an office is furnished with."""

from tools.household import cabinets, materials
from tools.household.item import Item, shelves, top

_WHITE, _GREY, _GREEN = "#eae7e0", "#8d9296", "#6f7f73"


ITEMS = (
    Item(
        "bookcase_oak",
        "bookcase",
        lambda: cabinets.bookcase(0.30, 0.80, 1.90, 5, materials.wood("oak")),
        None,
        "floor",
        shelves(cabinets.bookcase_levels(1.90, 5), 0.33, with_top=False),
    ),
    Item(
        "bookcase_white",
        "bookcase",
        lambda: cabinets.bookcase(0.28, 1.20, 1.20, 3, materials.paint(_WHITE, 0.4)),
        None,
        "floor",
        shelves(cabinets.bookcase_levels(1.20, 3), 0.33, with_top=True),
    ),
    Item(
        "bookcase_ladder",
        "bookcase",
        lambda: cabinets.ladder_shelf(0.34, 0.90, 1.75, 5, materials.wood("walnut"), materials.black_steel()),
        None,
        "floor",
        shelves(cabinets.ladder_levels(1.75, 5), 0.35),
    ),
    Item(
        "shelf_wall_oak",
        "shelf",
        lambda: cabinets.wall_shelf(0.22, 0.90, materials.wood("oak"), materials.black_steel()),
        None,
        "wall",
        top(0.03),
    ),
    Item(
        "shelf_wall_white",
        "shelf",
        lambda: cabinets.wall_shelf(0.24, 1.20, materials.paint(_WHITE), materials.brass()),
        None,
        "wall",
        top(0.03),
    ),
    Item(
        "wardrobe_white",
        "wardrobe",
        lambda: cabinets.wardrobe(
            0.60, 1.20, 2.05, 2, materials.paint(_WHITE), materials.paint(_WHITE), materials.brass()
        ),
        None,
        "floor",
    ),
    Item(
        "wardrobe_oak",
        "wardrobe",
        lambda: cabinets.wardrobe(
            0.60, 1.60, 2.10, 3, materials.wood("oak"), materials.wood("oak"), materials.black_steel()
        ),
        None,
        "floor",
    ),
    Item(
        "wardrobe_green",
        "wardrobe",
        lambda: cabinets.wardrobe(
            0.58, 1.00, 2.00, 2, materials.paint(_GREEN), materials.paint(_GREEN), materials.brass()
        ),
        None,
        "floor",
    ),
    Item(
        "sideboard_walnut",
        "sideboard",
        lambda: cabinets.sideboard(
            0.44, 1.60, 0.74, materials.wood("walnut"), materials.wood("walnut"), materials.brass()
        ),
        None,
        "floor",
        top(),
    ),
    Item(
        "sideboard_oak",
        "sideboard",
        lambda: cabinets.sideboard(
            0.42, 1.40, 0.62, materials.wood("oak"), materials.paint(_WHITE), materials.wood("oak")
        ),
        None,
        "floor",
        top(),
    ),
    Item(
        "bedside_table_walnut",
        "bedside table",
        lambda: cabinets.bedside_table(
            0.36, 0.44, 0.52, materials.wood("walnut"), materials.wood("walnut"), materials.brass()
        ),
        None,
        "floor",
        top(0.03),
    ),
    Item(
        "bedside_table_white",
        "bedside table",
        lambda: cabinets.bedside_table(
            0.38, 0.42, 0.50, materials.paint(_WHITE), materials.paint(_WHITE), materials.wood("oak")
        ),
        None,
        "floor",
        top(0.03),
    ),
    Item(
        "office_cabinet_drawers",
        "office cabinet",
        lambda: cabinets.filing_cabinet(0.62, 0.46, 1.32, 4, materials.paint(_GREY, 0.45), materials.brushed_steel()),
        None,
        "floor",
        top(),
    ),
    Item(
        "office_cabinet_tall",
        "office cabinet",
        lambda: cabinets.tall_cabinet(0.45, 0.92, 1.95, materials.paint("#d5d8d6", 0.45), materials.black_steel()),
        None,
        "floor",
    ),
    Item(
        "office_cabinet_low",
        "office cabinet",
        lambda: cabinets.tall_cabinet(0.45, 0.90, 0.78, materials.paint("#5e6b73", 0.45), materials.brushed_steel()),
        None,
        "floor",
        top(),
    ),
    Item(
        "desk_oak",
        "desk",
        lambda: cabinets.desk(0.75, 1.40, 0.735, materials.wood("oak"), materials.black_steel()),
        "table",
        "floor",
        top(0.05),
    ),
    Item(
        "desk_office",
        "desk",
        lambda: cabinets.desk(
            0.80,
            1.60,
            0.735,
            materials.paint("#e6e4df", 0.35),
            materials.paint("#b9bcbe", 0.4),
            materials.paint("#e1e2e1", 0.4),
        ),
        "table",
        "floor",
        top(0.05),
    ),
    Item(
        "desk_walnut",
        "desk",
        lambda: cabinets.desk(
            0.70, 1.20, 0.735, materials.wood("walnut"), materials.black_steel(), materials.wood("walnut")
        ),
        "table",
        "floor",
        top(0.05),
    ),
    Item(
        "table_dining_oak",
        "table",
        lambda: cabinets.dining_table(0.90, 1.60, 0.745, materials.wood("oak")),
        "table",
        "floor",
        top(0.06),
    ),
    Item(
        "table_dining_walnut",
        "table",
        lambda: cabinets.dining_table(0.95, 2.00, 0.745, materials.wood("walnut"), 0.05),
        "table",
        "floor",
        top(0.06),
    ),
    Item(
        "table_kitchen_white",
        "table",
        lambda: cabinets.dining_table(0.80, 0.80, 0.74, materials.paint(_WHITE), 0.03),
        "table",
        "floor",
        top(0.06),
    ),
    Item(
        "table_side_beech",
        "side table",
        lambda: cabinets.dining_table(0.45, 0.45, 0.50, materials.wood("beech"), 0.02),
        "table",
        "floor",
        top(0.05),
    ),
)
