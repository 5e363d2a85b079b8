"""The kinds of places, and their rooms: data, in metres."""

from dataclasses import dataclass

from benchbot.plugin import BenchbotError, did_you_mean


@dataclass(frozen=True)
class Function:
    """The function of a room: its width along its corridor, and its finishes.

    One of `floors` and of `walls` is drawn; `furniture` names the programme in `furniture.py`.
    """

    furniture: str
    width_m: tuple[float, float]
    floors: tuple[str, ...]
    walls: tuple[str, ...]
    window_bottom_m: float = 0.90


@dataclass(frozen=True)
class Kind:
    """A kind of place: the room that one enters, then the others in the order in which they are added.

    When a place has more rooms than are listed, `more` is repeated.
    """

    hub: str
    others: tuple[str, ...]
    more: tuple[str, ...]
    depth_m: tuple[float, float]
    corridor_m: float
    height_m: float

    def rooms(self, count: int) -> list[str]:
        """The functions of a place of so many rooms, the hub first."""
        others = list(self.others[: count - 1])
        while len(others) < count - 1:
            others.append(self.more[(len(others) - len(self.others)) % len(self.more)])
        return [self.hub, *others]


WOOD = ("oak", "oak_dark", "walnut", "pine")
TILES = ("tiles_white", "tiles_grey", "tiles_terracotta")
STONE = ("tiles_grey", "concrete", "linoleum")
OFFICE_FLOOR = ("carpet_grey", "carpet_blue")
LIGHT_WALLS = ("#ece7dd", "#e8e6e0", "#dfe3dc", "#eadfd0", "#e6dcd4", "#dde2e5", "#e9e3cc", "#dcd8e0")
STRONG_WALLS = ("#cfd6d3", "#dcd3cb", "#cdd3cc", "#c5cdd8", "#d8c8b8", "#d3d6c0")
PAPERS = ("wallpaper_stripes", "wallpaper_leaves")
KITCHEN_WALLS = ("#ebe9e2", "#e3e8e3", "#ece4d4", "#dfe5ea")
OFFICE_WALLS = ("#e9e9e6", "#e6e8ea", "#e3e5e0", "#ebe6dc")

FUNCTIONS = {
    "living room": Function("living", (4.6, 5.6), WOOD, (*LIGHT_WALLS, *STRONG_WALLS[:2], "wallpaper_stripes"), 0.70),
    "kitchen": Function("kitchen", (2.9, 3.6), (*TILES, "linoleum"), KITCHEN_WALLS, 1.10),
    "bedroom": Function("bedroom", (3.3, 4.2), (*WOOD, "carpet_beige"), (*LIGHT_WALLS, *STRONG_WALLS, *PAPERS)),
    "bathroom": Function(
        "bathroom", (2.2, 2.8), ("tiles_white", "tiles_grey"), ("wall_tiles_white", "wall_tiles_green"), 1.30
    ),
    "study": Function("study", (2.8, 3.4), WOOD, (*LIGHT_WALLS, *STRONG_WALLS)),
    "open office": Function("open_office", (6.0, 7.4), OFFICE_FLOOR, OFFICE_WALLS),
    "office": Function("office", (3.2, 4.0), OFFICE_FLOOR, OFFICE_WALLS),
    "meeting room": Function("meeting", (4.2, 5.2), OFFICE_FLOOR, (*OFFICE_WALLS, "#d5dcdf", "#d3dacd")),
    "pantry": Function("kitchen", (3.2, 3.8), STONE, OFFICE_WALLS, 1.10),
    "washroom": Function(
        "washroom", (1.9, 2.3), ("tiles_white", "tiles_grey"), ("wall_tiles_white", "wall_tiles_green"), 1.30
    ),
    "lobby": Function("lobby", (5.2, 6.4), STONE, OFFICE_WALLS, 0.70),
    "archive": Function("archive", (2.8, 3.4), OFFICE_FLOOR, OFFICE_WALLS),
    "hall": Function("hall", (1.0, 99.0), WOOD, LIGHT_WALLS),
}

KINDS = {
    "apartment": Kind(
        "living room", ("kitchen", "bedroom", "bathroom", "study"), ("bedroom", "study"), (3.4, 4.0), 1.5, 2.60
    ),
    "house": Kind(
        "living room",
        ("kitchen", "bedroom", "bathroom", "bedroom", "study", "bathroom"),
        ("bedroom", "study"),
        (3.6, 4.3),
        1.6,
        2.60,
    ),
    "office": Kind(
        "open office",
        ("meeting room", "office", "pantry", "washroom", "office"),
        ("office", "meeting room"),
        (3.9, 4.5),
        1.7,
        2.80,
    ),
    "company": Kind(
        "lobby",
        ("open office", "meeting room", "office", "pantry", "office", "washroom", "archive", "meeting room", "office"),
        ("office", "archive"),
        (4.1, 4.8),
        1.8,
        2.90,
    ),
}
MOST_ROOMS = 12


def find_kind(name: str) -> Kind:
    """The kind of a name; raises BenchbotError when there is none."""
    if name not in KINDS:
        raise BenchbotError(
            f"There is no kind of place '{name}'.",
            f"The generator knows {', '.join(KINDS)}.{did_you_mean(name, list(KINDS))}",
            f"Choose one, for example: --kind {next(iter(KINDS))}",
        )
    return KINDS[name]
