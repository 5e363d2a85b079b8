"""A new place from a seed: plan, furniture, start pose and a trajectory on which every object is seen."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from benchbot.plugin import BenchbotError, randomness
from benchbot_scenes.catalogue import Catalogue
from benchbot_scenes.compose import compose
from benchbot_scenes.coverage import MARGIN_M, Coverage, Pose7, plan_coverage
from benchbot_scenes.free_space import FreeSpace, free_space
from benchbot_scenes.generator import belongings, people
from benchbot_scenes.generator.floor_plan import OUTER_WALL_M, Plan, Space, floor_plan
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.furniture import PROGRAMMES
from benchbot_scenes.generator.kinds import FUNCTIONS, MOST_ROOMS, find_kind
from benchbot_scenes.generator.plot import Item, Plot
from benchbot_scenes.generator.proxy import proxy
from benchbot_scenes.generator.supply import Supply
from benchbot_scenes.gltf import geometry_of
from benchbot_scenes.gltf_file import GltfFile, split_glb
from benchbot_scenes.layout import Building, Layout, Opening, Room
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.visibility import CARTER, Observer, unseen

CEILING = "#f4f2ee"
FEWEST_OBJECTS = 25
# A plan that is too crowded or too bare is drawn anew, so many times; the last one is furnished sparsely.
ATTEMPTS = 8
# What is there to carry things, and the least of them that it is there for.
FEWEST_ON = {"bookcase": 3, "shelf": 1, "plant stand": 1}
# What a start pose has about it.
START_ROOM_M = 0.45


@dataclass(frozen=True)
class Generated:
    """A place: its plan and layout, and poses [qw, qx, qy, qz, x, y, z] on the floor.

    `scene` is the layout's, where it had to be composed for this; None where it still has to be.
    """

    plan: Plan
    layout: Layout
    start_pose: Pose7
    trajectory_poses: tuple[Pose7, ...]
    items: tuple[Item, ...]
    scene: SceneGeometry | None = field(default=None, repr=False, compare=False)


def generate(
    seed: int, kind: str, rooms: int, catalogue: Catalogue, robot: Observer = CARTER, secret: str = ""
) -> Generated:
    """The place of a seed; the same pack, kind, number of rooms, seed and secret always give the same.

    With a `secret` (see `benchbot.core.randomness`) nobody can make the place again who does not know it, and the order
    of the layout's objects tells nothing of how they were placed.

    Every object of a class is seen on the trajectory, every room can be driven into. From three rooms on there are at
    least 25 objects, as far as the pack has models. Raises BenchbotError for an unknown kind or a number of rooms that
    is not 1 to 12.
    """
    place = find_kind(kind)
    if not 1 <= rooms <= MOST_ROOMS:
        raise BenchbotError(
            f"A place cannot have {rooms} rooms.",
            f"The generator builds 1 to {MOST_ROOMS} rooms on one floor.",
            f"Give a number from 1 to {MOST_ROOMS}.",
        )
    if seed < 0:
        raise BenchbotError(f"{seed} is not a seed.", "A seed is a whole number, 0 or more.", "Give another one.")
    for attempt in range(ATTEMPTS):
        rng = _random(secret, seed, kind, rooms, attempt)
        plan = floor_plan(place, rooms, rng)
        last = attempt == ATTEMPTS - 1
        items, finishes = _furnished(plan, place.height_m, catalogue, rng, sparse=last)
        found = _with_trajectory(plan, items, place.height_m, robot)
        if found is None:
            continue
        kept, coverage = found
        listed = [kept[i] for i in rng.permutation(len(kept))] if secret else kept
        layout = _layout(catalogue.name, plan, finishes, listed, place.height_m)
        scene = _composed(layout, catalogue, kept)
        # The trajectory was planned among boxes; of a pack whose files are not there these are all that is known.
        hidden = set() if scene is None else set(unseen(scene, coverage.poses, robot))
        gone = hidden | _bare(_without(kept, hidden))
        kept, listed = _without(kept, gone), _without(listed, gone)
        wanted = rooms < 3 or sum(item.model.class_name is not None for item in kept) >= FEWEST_OBJECTS
        if wanted or last:
            layout = replace(layout, objects=tuple(item.placement for item in listed))
            poses = coverage.poses
            scene = _composed(layout, catalogue, kept) if gone else scene
            return Generated(plan, layout, poses[0], poses, tuple(kept), scene)
    raise BenchbotError(
        f"No {kind} of {rooms} rooms can be made from seed {seed}.",
        f"{ATTEMPTS} plans were drawn, and in none of them the robot finds its way.",
        "Take another seed, and report this one.",
    )


def _random(secret: str, seed: int, kind: str, rooms: int, attempt: int) -> np.random.Generator:
    if secret:
        return randomness.generator(randomness.key(secret, seed, "place", kind, rooms), "place", attempt)
    return np.random.default_rng([seed, attempt])


def _furnished(
    plan: Plan, height_m: float, catalogue: Catalogue, rng: np.random.Generator, sparse: bool
) -> tuple[list[Item], dict[str, tuple[str, str]]]:
    supply = Supply(catalogue, rng)
    rooms: list[Furnisher] = []
    finishes: dict[str, tuple[str, str]] = {}
    style: dict[str, tuple[str, str]] = {}
    for space in plan.spaces:
        function = FUNCTIONS[space.function]
        # Rooms of one kind are finished alike, and a hall like the room it leads from.
        key = plan.spaces[0].function if space.function == "hall" else space.function
        if key not in style:
            chosen = FUNCTIONS[key]
            style[key] = str(rng.choice(chosen.floors)), str(rng.choice(chosen.walls))
        finishes[space.name] = style[key]
        doors = tuple(opening for opening in plan.openings if opening.bottom_m == 0.0 and touches(space, opening))
        windows = tuple(opening for opening in plan.openings if opening.kind == "window" and touches(space, opening))
        rooms.append(Furnisher(Plot(space, height_m, doors, windows, rng), supply))
        PROGRAMMES["hall" if sparse else function.furniture](rooms[-1])
    people.put_in(rooms)
    belongings.put_about(rooms)
    return [item for room in rooms for item in room.plot.items], finishes


def touches(space: Space, opening: Opening) -> bool:
    """Return whether an opening is in one of a room's walls."""
    x, y = opening.at
    reach = OUTER_WALL_M / 2 + 0.02
    return (
        space.low[0] - reach <= x <= space.high[0] + reach
        and space.low[1] - reach <= y <= space.high[1] + reach
        and (space.low[0] < x < space.high[0] or space.low[1] < y < space.high[1])
    )


def _with_trajectory(
    plan: Plan, items: list[Item], height_m: float, robot: Observer
) -> tuple[list[Item], Coverage] | None:
    """The items that are seen, and the trajectory; None when a room cannot be driven into."""
    scene = proxy(plan.spaces, plan.openings, items, height_m)
    space = free_space(scene, robot.z_min_m, robot.z_max_m)
    start = _start(plan, space, robot)
    if start is None or not _enters_all(plan, space, start, robot):
        return None
    coverage = plan_coverage(scene, start, robot, space=space)
    # What is taken away hides nothing and is in nobody's way.
    return (_without(items, set(coverage.unseen)), coverage) if coverage.poses else None


def _composed(layout: Layout, catalogue: Catalogue, items: Sequence[Item]) -> SceneGeometry | None:
    """The scene of a layout; None when a pack's files are not there."""
    if not all(item.model.file.is_file() for item in items):
        return None
    return geometry_of(GltfFile(*split_glb(compose(layout, {catalogue.name: catalogue}))))[0]


def _without(items: Sequence[Item], names: set[str]) -> list[Item]:
    """The items but for those named and what stands on them."""
    return [item for item in items if item.placement.id not in names and item.carrier not in names]


def _bare(items: Sequence[Item]) -> set[str]:
    """The names of shelves, bookcases and stands that too little stands on."""
    on = Counter(item.carrier for item in items)
    return {item.placement.id for item in items if on[item.placement.id] < FEWEST_ON.get(item.model.kind, 0)}


def _start(plan: Plan, space: FreeSpace, robot: Observer) -> tuple[float, float, float] | None:
    """In the room that is entered, where there is much room, near its middle, towards the middle of the whole place."""
    hub = plan.spaces[0]
    middle = ((hub.low[0] + hub.high[0]) / 2, (hub.low[1] + hub.high[1]) / 2)
    best: tuple[float, float, float] | None = None
    for column, row in np.argwhere(space.largest_region(robot.radius_m + MARGIN_M)):
        x, y = space.centre(int(column), int(row))
        if not (hub.low[0] < x < hub.high[0] and hub.low[1] < y < hub.high[1]):
            continue
        cost = math.dist((x, y), middle) + 4 * max(0.0, START_ROOM_M - float(space.clearance_m[column, row]))
        if best is None or cost < best[0]:
            best = (cost, x, y)
    if best is None:
        return None
    _, x, y = best
    far = max(plan.spaces, key=lambda room: math.dist((x, y), room.low))
    heading = math.atan2((far.low[1] + far.high[1]) / 2 - y, (far.low[0] + far.high[0]) / 2 - x)
    return round(x, 4), round(y, 4), round(heading / (math.pi / 2)) * math.pi / 2


def _enters_all(plan: Plan, space: FreeSpace, start: tuple[float, float, float], robot: Observer) -> bool:
    cells = np.argwhere(space.region(start[:2], robot.radius_m + MARGIN_M))
    places = np.array(space.low_m) + (cells + 0.5) * space.cell_m
    return all(bool(((places > room.low) & (places < room.high)).all(1).any()) for room in plan.spaces)


def _layout(
    assets: str, plan: Plan, finishes: dict[str, tuple[str, str]], items: Sequence[Item], height_m: float
) -> Layout:
    rooms = tuple(
        Room(
            space.name,
            (space.low, (space.high[0], space.low[1]), space.high, (space.low[0], space.high[1])),
            finishes[space.name][0],
            finishes[space.name][1],
            CEILING,
        )
        for space in plan.spaces
    )
    building = Building(height_m, OUTER_WALL_M, rooms, plan.openings)
    return Layout(assets, building, tuple(item.placement for item in items))
