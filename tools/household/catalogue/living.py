"""Chairs, sofas and tables."""

from tools.household import materials
from tools.household.item import Item, round_top, top
from tools.household.model import Model, fit_to_box
from tools.household.seating import spindle_chair, upholstered_chair
from tools.household.sofas import sofa
from tools.household.tables import low_table, round_table


def _spindle(species: str) -> Model:
    return spindle_chair(materials.wood(species))


def _padded(species: str, cloth: str) -> Model:
    return upholstered_chair(materials.wood(species), materials.linen(f"seat linen {cloth}", cloth))


def _sofa(seats: int, seat_width_m: float, code: str, style: str, cushion: str | None) -> Model:
    loose = None if cushion is None else materials.linen(f"cushion {cushion}", cushion)
    return sofa(seats, seat_width_m, 0.90, materials.linen(f"sofa {code}", code), materials.wood("oak"), style, loose)


ITEMS = (
    Item("couch_green", "couch", lambda: _sofa(3, 0.58, "#5d6f60", "round", "#b5813c"), "couch", "floor"),
    Item("couch_grey", "couch", lambda: _sofa(2, 0.66, "#8b8f94", "slim", "#3f5568"), "couch", "floor"),
    Item("couch_chaise", "couch", lambda: _sofa(3, 0.64, "#b7a58a", "chaise", "#7d4a3a"), "couch", "floor"),
    Item("armchair_blue", "armchair", lambda: _sofa(1, 0.56, "#46597a", "round", None), "chair", "floor"),
    Item("chair_spindle", "chair", lambda: _spindle("oak"), "chair", "floor"),
    Item(
        "chair_spindle_black",
        "chair",
        lambda: fit_to_box(spindle_chair(materials.paint("#23211f", 0.45)), (0.46, 0.45, 0.88), may_turn=False),
        "chair",
        "floor",
    ),
    Item("chair_padded", "chair", lambda: _padded("walnut", "#75836f"), "chair", "floor"),
    Item("chair_padded_rust", "chair", lambda: _padded("oak", "#a35f3f"), "chair", "floor"),
    Item("table_round", "table", lambda: round_table(materials.wood("oak")), "table", "floor", round_top()),
    Item("table_low", "coffee table", lambda: low_table(materials.wood("walnut")), "table", "floor", top()),
    Item(
        "table_coffee",
        "coffee table",
        lambda: fit_to_box(low_table(materials.wood("oak")), (0.62, 1.10, 0.42)),
        "table",
        "floor",
        top(),
    ),
)
