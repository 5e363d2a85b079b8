"""Doors and windows."""

from tools.household import materials
from tools.household.item import Item, Nodes
from tools.household.openings import door, window

_WHITE = ("#f1efe9", 0.32)


def _white_door(style: str, width_m: float) -> Nodes:
    white = materials.paint(*_WHITE)
    return door(width_m, 2.05, white, white, materials.brushed_steel(), style)


def _oak_door(width_m: float) -> Nodes:
    oak = materials.wood("oak")
    return door(width_m, 2.05, oak, oak, materials.black_steel(), "plain")


def _front_door(code: str) -> Nodes:
    return door(1.0, 2.10, materials.paint(code, 0.35), materials.paint(*_WHITE), materials.brass(), "panels")


ITEMS = (
    Item("interior_door_panels", "interior door", lambda: _white_door("panels", 0.90), None, "opening"),
    Item("interior_door_oak", "interior door", lambda: _oak_door(0.90), None, "opening"),
    Item("interior_door_glazed", "interior door", lambda: _white_door("glazed", 0.90), None, "opening"),
    Item("door_front_green", "door", lambda: _front_door("#35463d"), None, "opening"),
    Item("door_front_grey", "door", lambda: _front_door("#4d545c"), None, "opening"),
    Item("window_single", "window", lambda: window(0.80, 1.30, 1, materials.paint(*_WHITE), (0.70,)), None, "opening"),
    Item("window_double", "window", lambda: window(1.40, 1.30, 2, materials.paint(*_WHITE), (0.70,)), None, "opening"),
    Item("window_wide", "window", lambda: window(2.00, 1.40, 3, materials.paint("#3a3d40", 0.4)), None, "opening"),
    Item("window_oak", "window", lambda: window(1.20, 1.20, 2, materials.wood("oak")), None, "opening"),
)
