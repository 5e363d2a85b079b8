"""The bathroom."""

from tools.household import bathroom, materials
from tools.household.item import Item
from tools.household.model import Model


def _toilet(style: str, seat: str = "#f3f2ee") -> Model:
    cover = materials.wood("oak") if seat == "oak" else materials.paint(seat, 0.2)
    return bathroom.toilet(style, materials.ceramic(), cover)


def _basin(style: str) -> Model:
    return bathroom.washbasin(style, materials.ceramic(), materials.wood("oak"))


def _bathtub(style: str) -> Model:
    return bathroom.bathtub(style, materials.ceramic(), materials.paint("#f0efeb", 0.25))


ITEMS = (
    Item("toilet_closed", "toilet", lambda: _toilet("closed"), "toilet", "floor"),
    Item("toilet_open", "toilet", lambda: _toilet("open", "oak"), "toilet", "floor"),
    Item("toilet_hung", "toilet", lambda: _toilet("hung"), "toilet", "floor"),
    Item("sink_pedestal", "sink", lambda: _basin("pedestal"), "sink", "floor"),
    Item("sink_vanity", "sink", lambda: _basin("vanity"), "sink", "floor"),
    Item("bathtub_panelled", "bathtub", lambda: _bathtub("panelled"), None, "floor"),
    Item("bathtub_free", "bathtub", lambda: _bathtub("free"), None, "floor"),
    Item("shower_corner", "shower", lambda: bathroom.shower(0.90, 0.90, materials.ceramic()), None, "floor"),
    Item("mirror_round", "mirror", lambda: bathroom.mirror(0.60, 0.60, materials.brass(), True), None, "wall"),
    Item("mirror_oak", "mirror", lambda: bathroom.mirror(0.55, 0.80, materials.wood("oak")), None, "wall"),
    Item("mirror_tall", "mirror", lambda: bathroom.mirror(0.45, 1.50, materials.black_steel()), None, "wall"),
)
