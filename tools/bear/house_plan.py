"""The house's walls: rooms and openings inferred from where its objects stand and where its trajectories pass."""

from __future__ import annotations

from benchbot_scenes.layout import Building, Opening, Room

HEIGHT_M = 2.70
OUTER_WALL_M = 0.24

# Faces of walls, named after what they bound. The television hangs on the stub at TV_WALL.
LIVING_WEST, LIVING_NORTH, LIVING_SOUTH = -5.30, 5.40, -3.90
KITCHEN_WEST, KITCHEN_NORTH, KITCHEN_EAST = -0.82, 6.60, 4.40
TV_WALL, TV_WALL_END = -0.966, 2.35
HALL_SOUTH, LOUNGE_EAST = -1.58, 1.63
ENTRY_WEST, ENTRY_EAST, ENTRY_SOUTH, ENTRY_NORTH = 4.52, 7.70, -0.95, 1.45
WASHROOM_WEST, WASHROOM_EAST, WASHROOM_SOUTH, WASHROOM_NORTH = 1.75, 3.95, -3.70, -1.70
# The toilet stands before a boxed-in cistern.
CISTERN_WEST, CISTERN_SOUTH = 3.05, -2.32
CORRIDOR_WEST, CORRIDOR_EAST, CORRIDOR_SOUTH, CORRIDOR_NORTH = -3.15, -1.68, -6.23, -4.02
BEDROOM_WEST, BEDROOM_EAST, BEDROOM_SOUTH, BEDROOM_NORTH = -4.05, 0.57, -11.44, -6.35
BATH_WEST, BATH_EAST, BATH_SOUTH, BATH_NORTH = 0.69, 5.63, -11.60, -5.90


def building() -> Building:
    """The shell of the house."""
    return Building(HEIGHT_M, OUTER_WALL_M, _rooms(), _openings())


def _rooms() -> tuple[Room, ...]:
    living = (
        (LIVING_WEST, LIVING_SOUTH),
        (LOUNGE_EAST, LIVING_SOUTH),
        (LOUNGE_EAST, HALL_SOUTH),
        (KITCHEN_EAST, HALL_SOUTH),
        (KITCHEN_EAST, KITCHEN_NORTH),
        (KITCHEN_WEST, KITCHEN_NORTH),
        (KITCHEN_WEST, TV_WALL_END),
        (TV_WALL, TV_WALL_END),
        (TV_WALL, LIVING_NORTH),
        (LIVING_WEST, LIVING_NORTH),
    )
    washroom = (
        (WASHROOM_WEST, WASHROOM_SOUTH),
        (WASHROOM_EAST, WASHROOM_SOUTH),
        (WASHROOM_EAST, CISTERN_SOUTH),
        (CISTERN_WEST, CISTERN_SOUTH),
        (CISTERN_WEST, WASHROOM_NORTH),
        (WASHROOM_WEST, WASHROOM_NORTH),
    )
    entry = _rectangle(ENTRY_WEST, ENTRY_EAST, ENTRY_SOUTH, ENTRY_NORTH)
    corridor = _rectangle(CORRIDOR_WEST, CORRIDOR_EAST, CORRIDOR_SOUTH, CORRIDOR_NORTH)
    bedroom = _rectangle(BEDROOM_WEST, BEDROOM_EAST, BEDROOM_SOUTH, BEDROOM_NORTH)
    bathroom = _rectangle(BATH_WEST, BATH_EAST, BATH_SOUTH, BATH_NORTH)
    cream, white = "#ece6da", "#f2efe8"
    return (
        Room("living", living, "oak", cream, white),
        Room("entry", entry, "tiles_terracotta", "#d9dccf", white),
        Room("washroom", washroom, "tiles_grey", "wall_tiles_green", white),
        Room("corridor", corridor, "oak", cream, white),
        Room("bedroom", bedroom, "carpet_beige", "#b9c6c4", white),
        Room("bathroom", bathroom, "tiles_grey", "wall_tiles_white", white),
    )


def _rectangle(west: float, east: float, south: float, north: float) -> tuple[tuple[float, float], ...]:
    return (west, south), (east, south), (east, north), (west, north)


def _openings() -> tuple[Opening, ...]:
    half = OUTER_WALL_M / 2
    return (
        Opening("entry passage", "passage", (4.46, 0.25), 1.90, 0.0, 2.30),
        Opening("washroom passage", "passage", (1.69, -2.65), 1.40, 0.0, 2.20),
        Opening("corridor passage", "passage", (-2.42, -3.96), 1.40, 0.0, 2.30),
        Opening("bedroom passage", "passage", (-2.42, -6.29), 1.40, 0.0, 2.20),
        Opening("bathroom passage", "passage", (0.63, -10.13), 1.10, 0.0, 2.10),
        Opening("front door", "door", (ENTRY_EAST + half, 0.25), 1.00, 0.0, 2.10, "door_front_green"),
        Opening("study door", "door", (CORRIDOR_EAST + half, -5.10), 0.90, 0.0, 2.05, "interior_door_panels"),
        Opening("living window west", "window", (LIVING_WEST - half, 3.20), 2.00, 0.90, 2.30),
        Opening("living window north", "window", (-2.90, LIVING_NORTH + half), 2.00, 0.90, 2.30),
        Opening("lounge window west", "window", (LIVING_WEST - half, -2.05), 2.00, 0.70, 2.30),
        Opening("lounge window south", "window", (0.35, LIVING_SOUTH - half), 1.40, 1.00, 2.30),
        Opening("dining window", "window", (2.35, KITCHEN_NORTH + half), 1.60, 0.90, 2.30),
        Opening("kitchen window", "window", (KITCHEN_EAST + half, 4.45), 1.60, 1.12, 2.25),
        Opening("entry window", "window", (6.10, ENTRY_NORTH + half), 1.20, 0.90, 2.20),
        Opening("washroom window", "window", (2.25, WASHROOM_SOUTH - half), 0.60, 1.30, 2.20),
        Opening("corridor window", "window", (CORRIDOR_WEST - half, -5.10), 0.90, 0.90, 2.20),
        Opening("bedroom window west", "window", (BEDROOM_WEST - half, -9.20), 1.60, 0.80, 2.30),
        Opening("bedroom window south", "window", (-1.656, BEDROOM_SOUTH - half), 1.20, 1.30, 2.30),
        Opening("bathroom window south", "window", (3.70, BATH_SOUTH - half), 1.20, 1.10, 2.20),
        Opening("bathroom window east", "window", (BATH_EAST + half, -7.40), 1.00, 1.10, 2.20),
    )
