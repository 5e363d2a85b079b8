"""Cables: from screens on desks and boards to the wall behind them."""

import numpy as np

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.plot import WALL_GAP_M, Item

# The height of the desk that cables are made for; others stretch them. How far off a screen they are tried, and how
# far off the middle of the model they come up.
CABLES_FOR_M, CABLES_ASIDE_M = 0.735, (0.0, -0.12, 0.12, -0.25, 0.25, -0.4, 0.4)
LEADS_OFF_M = 0.12
# How far the lead of a power strip reaches behind a board.
LEAD_BEHIND_M = 0.10
SCREENS = ("tv", "laptop")


def lead(room: Furnisher) -> None:
    """From screens on desks and boards to the wall behind them."""
    carriers = {item.carrier for item in room.plot.items if _is_screen(item)}
    for item in [item for item in room.plot.items if item.placement.id in carriers and _is_at_wall(room, item)]:
        if item.model.kind == "desk":
            _behind_desk(room, item, room.supply.draw("desk cables"))
        elif item.model.placement == "floor":
            _beside_board(room, item, room.supply.draw("power strip"))


def _is_at_wall(room: Furnisher, item: Item) -> bool:
    """Whether an item's back is as near to a wall as furniture is put."""
    back, low, high = item.place(-item.size_m[0] / 2, 0.0), room.plot.space.low, room.plot.space.high
    return min(abs(back[i] - end[i]) for i in (0, 1) for end in (low, high)) < WALL_GAP_M + 0.005


def _behind_desk(room: Furnisher, desk: Item, model: AssetModel | None) -> None:
    """Cables from a power strip below a desk up its back and onto it, clear of what it stands on."""
    if model is None:
        return
    size_m = (model.size_m[0], model.size_m[1], model.size_m[2] * desk.size_m[2] / CABLES_FOR_M)
    x = -desk.size_m[0] / 2 - WALL_GAP_M + model.size_m[0] / 2 + 0.002
    screens = [item for item in room.plot.items if item.carrier == desk.placement.id and _is_screen(item)]
    for aside in (_aside(desk, screens[0]) + off for off in CABLES_ASIDE_M):
        item = room.at(model, desk.place(x, aside), 0.0, desk.placement.yaw_deg, desk, size_m)
        if abs(aside) + size_m[1] / 2 < desk.size_m[1] / 2 and room.is_free(item):
            room.put(item, takes=False)
            return


def _is_screen(item: Item) -> bool:
    return item.model.class_name in SCREENS


def _aside(desk: Item, screen: Item) -> float:
    """How far to the left of a desk's middle cables are put, so that they come up behind a screen."""
    return float(desk.own(np.array([screen.placement.position]))[0, 1]) + LEADS_OFF_M


def _beside_board(room: Furnisher, board: Item, model: AssetModel | None) -> None:
    """A power strip at the wall beside a board, its lead behind it; made for the side at the board's +y."""
    if model is None:
        return
    x = -board.size_m[0] / 2 - WALL_GAP_M + model.size_m[0] / 2 + 0.002
    item = room.at(
        model,
        board.place(x, (board.size_m[1] + model.size_m[1]) / 2 - LEAD_BEHIND_M),
        0.0,
        board.placement.yaw_deg,
    )
    room.plot.taken.remove(board.box)
    has_room = room.plot.fits(item, 0.0) and room.plot.leaves_ways(item)
    room.plot.taken.append(board.box)
    if has_room and room.is_free(item):
        room.put(item)
