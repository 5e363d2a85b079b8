"""What lies about in rooms: cables, shoes, bins, paper, magnets. No map of objects names any of it."""

from tools.household import cables, paper
from tools.household.item import Item
from tools.household.shoes import BOOT, SNEAKER, shoes

# The height of the desks of the pack.
_DESK_M = 0.735

ITEMS = (
    Item("power_strip", "power strip", cables.power_strip, None, "floor"),
    Item("cables_desk", "desk cables", lambda: cables.desk_cables(_DESK_M), None, "floor"),
    Item("charger_white", "charger", cables.charger),
    Item(
        "shoes_sneakers",
        "shoes",
        lambda: shoes(SNEAKER, "#5d7488", "#e8e5dd", "#c9ccd0", "#f0eee8", 0.75),
        None,
        "floor",
    ),
    Item("shoes_boots", "shoes", lambda: shoes(BOOT, "#5f3f28", "#2b2421", "#8a6a4c", "#33241a", 0.4), None, "floor"),
    Item("magnets_sheets", "magnets", paper.magnets_and_sheets, None, "wall", texture_px=128),
    Item("magnets_letters", "magnets", paper.magnets_and_letters, None, "wall"),
    Item("bin_paper", "bin", paper.paper_bin, None, "floor"),
    Item("bin_pedal", "bin", paper.pedal_bin, None, "floor"),
    Item("paper_loose", "paper", paper.loose_paper, texture_px=128),
)
