"""Beds and bedside furniture."""

from tools.household import materials
from tools.household.bed import double_bed
from tools.household.item import Item, top
from tools.household.model import Model, fit_to_box, rotation, transformed
from tools.household.storage import chest_of_drawers


def _bed(species: str, headboard: str, duvet: str, throw: str, cushion: str, width_m: float) -> Model:
    linen = materials.linen
    model = double_bed(
        materials.wood(species),
        linen(f"headboard {headboard}", headboard),
        linen("white linen", "#ebe7dd"),
        linen(f"duvet {duvet}", duvet),
        materials.knit(f"throw {throw}", throw),
        linen(f"pillow {duvet}", duvet),
        linen(f"cushion {cushion}", cushion),
        detail=0.34,
    )
    return fit_to_box(transformed(model, rotation("z", 180.0)), (2.14, width_m, 0.92), may_turn=False)


ITEMS = (
    Item("bed_double", "bed", lambda: _bed("oak", "#a3937a", "#d8d2c4", "#a8603f", "#b5813c", 1.72), "bed", "floor"),
    Item("bed_queen", "bed", lambda: _bed("walnut", "#5d6470", "#c9d0d6", "#3f5568", "#8c9aa5", 1.52), "bed", "floor"),
    Item("bed_single", "bed", lambda: _bed("pine", "#8f9d86", "#e6e0d2", "#6f8f7a", "#cfa14e", 1.02), "bed", "floor"),
    Item(
        "chest_of_drawers_walnut",
        "chest of drawers",
        lambda: chest_of_drawers(0.42, 1.12, 0.96, materials.wood("walnut"), materials.brass()),
        None,
        "floor",
        top(),
    ),
    Item(
        "chest_of_drawers_white",
        "chest of drawers",
        lambda: chest_of_drawers(0.45, 0.90, 0.82, materials.paint("#e9e6df", 0.4), materials.brushed_steel()),
        None,
        "floor",
        top(),
    ),
    Item(
        "bedside_table_oak",
        "bedside table",
        lambda: fit_to_box(
            chest_of_drawers(0.36, 0.80, 0.60, materials.wood("oak"), materials.brass()),
            (0.38, 0.46, 0.52),
            may_turn=False,
        ),
        None,
        "floor",
        top(),
    ),
)
