"""Plan a trajectory on which a robot sees every object of a scene: where to stop, where to look, how to get there."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.free_space import FreeSpace, free_space
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.routes import Point, Roads, least_clearance
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.visibility import Observer, bearings_rad, seen_from, targets, voxels

# What a trajectory keeps from obstacles beyond the robot's radius.
MARGIN_M = 0.05
LEG_M = 0.70
TURN_RAD = math.radians(60.0)
# Stops are chosen from a lattice; objects count within this much less than half the picture's width.
LATTICE_M = 0.40
EDGE_DEG = 8.0
# Each object is looked at from so many stops, where there are as many.
VIEWS = 2
ROOM_M = 0.60
_ROOM_STEP_M = 0.02
_ROOM_PARTS = 10

Pose7 = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True)
class Coverage:
    """A trajectory as an environment declares it ([qw, qx, qy, qz, x, y, z]), and the objects that it does not see."""

    poses: tuple[Pose7, ...]
    unseen: tuple[str, ...]


def plan_coverage(
    geometry: SceneGeometry,
    start: tuple[float, float, float],
    robot: Observer,
    floor_z_m: float = 0.0,
    names: Collection[str] | None = None,
    space: FreeSpace | None = None,
) -> Coverage:
    """Plan from `start` (x, y, heading in radians) past all objects of a class, or those named; always the same.

    Legs are straight, at most 0.7 m, and keep 5 cm from obstacles; turns are on the spot. No poses when the robot does
    not fit where it starts. `space` is the geometry's free space for the robot, where it is known already. Raises
    BenchbotError for a camera that is too narrow to look for anything with.
    """
    if robot.half_width_deg <= EDGE_DEG:
        raise BenchbotError(
            "No trajectory shows the objects to this robot.",
            f"Its picture is {2 * robot.half_width_deg:.3g} degrees wide, and an object has to be {EDGE_DEG:g} degrees "
            "inside of both edges to count as seen.",
            "Choose a robot with a wider camera, or correct width and fx of its camera (in pixels); the default, "
            "carter, sees 90 degrees.",
        )
    if space is None:
        space = free_space(geometry, robot.z_min_m, robot.z_max_m, floor_z_m)
    things = targets(geometry, names)
    region = space.region(start[:2], robot.radius_m + MARGIN_M)
    if not region.any():
        return Coverage((), tuple(thing.name for thing in things))
    roads = Roads(space, region, robot.radius_m + MARGIN_M)
    stops = _lattice(roads)
    eyes = np.array([(*roads.place(stop), floor_z_m + robot.eye_m) for stop in stops])
    seen = seen_from(eyes, things, voxels(geometry), robot.range_m, robot.half_height_deg)
    bearings = bearings_rad(eyes, things)
    room = np.array([min(ROOM_M, space.clearance_at(*roads.place(stop))) for stop in stops])
    chosen = _cover(seen, room)
    half_rad = math.radians(robot.half_width_deg - EDGE_DEG)
    looks = {stops[number]: _headings(bearings[number, seen[number]], half_rad) for number in chosen}
    ways = roads.tour(roads.nearest(start[:2]), [stops[number] for number in chosen])
    poses = tuple(_poses(start, ways, roads, looks, floor_z_m))
    return Coverage(poses, tuple(thing.name for number, thing in enumerate(things) if not seen[:, number].any()))


def _lattice(roads: Roads) -> list[int]:
    every = max(1, round(LATTICE_M / roads.space.cell_m))
    columns, rows = roads.cells.T
    on_lattice = np.flatnonzero((columns % every == 0) & (rows % every == 0))
    return on_lattice.tolist() if len(on_lattice) else [0]


def _cover(seen: npt.NDArray[np.bool_], room: npt.NDArray[np.float64]) -> list[int]:
    """Choose stops greedily, the one that adds the most views first, until each thing has its views."""
    wanted = np.minimum(VIEWS, seen.sum(0))
    open_stops, chosen = seen.copy(), []
    while wanted.any():
        gains = open_stops[:, wanted > 0].sum(1) + 0.5 * room
        gains[~open_stops[:, wanted > 0].any(1)] = -1.0
        best = int(np.argmax(gains))
        chosen.append(best)
        wanted = np.maximum(0, wanted - open_stops[best])
        open_stops[best] = False
    return chosen


def _headings(bearings: npt.NDArray[np.float64], half_rad: float) -> list[float]:
    """Few headings, each bearing within `half_rad` of one: an interval cover from each bearing, the best of them."""
    best: list[float] | None = None
    for first in bearings:
        ahead = np.sort((bearings - first) % (2 * math.pi))
        headings: list[float] = []
        covered = -1.0
        for angle in ahead:
            if angle > covered:
                reached = ahead[(ahead >= angle) & (ahead <= angle + 2 * half_rad)].max()
                headings.append(float(first + (angle + reached) / 2))
                covered = float(reached)
        if best is None or len(headings) < len(best):
            best = headings
    return best or []


def _poses(
    start: tuple[float, float, float],
    ways: Sequence[Sequence[Point]],
    roads: Roads,
    looks: dict[int, list[float]],
    z_m: float,
) -> Iterator[Pose7]:
    place, heading = start[:2], start[2]
    yield _pose(place, heading, z_m)
    for way in ways:
        for corner in way:
            length_m = math.dist(place, corner)
            if length_m < 1e-6:
                continue
            direction = math.atan2(corner[1] - place[1], corner[0] - place[0])
            for turned in _turns(heading, direction):
                yield _pose(place, turned, z_m)
            count = math.ceil(length_m / LEG_M - 1e-9)
            for step in range(1, count + 1):
                share = step / count
                between = (place[0] + share * (corner[0] - place[0]), place[1] + share * (corner[1] - place[1]))
                yield _pose(between, direction, z_m)
            place, heading = corner, direction
        for look in _sweep(heading, looks.get(roads.nearest(place), [])):
            for turned in _turns(heading, look):
                yield _pose(place, turned, z_m)
            heading = look


def _sweep(heading: float, looks: Sequence[float]) -> list[float]:
    """Headings in the order of one turn, to the side where the first is nearer."""
    ahead = sorted(looks, key=lambda look: (look - heading) % (2 * math.pi))
    if not ahead or (ahead[0] - heading) % (2 * math.pi) <= (heading - ahead[-1]) % (2 * math.pi):
        return ahead
    return ahead[::-1]


def _turns(heading: float, goal: float) -> Iterator[float]:
    """Headings on the short way to a goal, at most 60 degrees apart; none when it is there."""
    turn = math.remainder(goal - heading, 2 * math.pi)
    count = math.ceil(abs(turn) / TURN_RAD - 1e-9) if abs(turn) > math.radians(0.5) else 0
    for step in range(1, count + 1):
        yield heading + turn * step / count


def _pose(place: Point, heading: float, z_m: float) -> Pose7:
    half = math.remainder(heading, 2 * math.pi) / 2
    numbers = (math.cos(half), 0.0, 0.0, math.sin(half), place[0], place[1], z_m)
    w, x, y, z, *position = (round(value, 6) + 0.0 for value in numbers)
    return w, x, y, z, round(position[0], 4), round(position[1], 4), round(position[2], 4)


def least_room(space: FreeSpace, poses: Sequence[Sequence[float]]) -> float:
    """The least clearance on the straight way through all poses, and 0 where a leg does not point to its goal."""
    least = math.inf
    for before, after in pairwise(poses):
        start, end = (float(before[4]), float(before[5])), (float(after[4]), float(after[5]))
        if math.dist(start, end) > 0.01:
            heading = 2 * math.atan2(float(before[3]), float(before[0]))
            direction = math.atan2(end[1] - start[1], end[0] - start[0])
            if abs(math.remainder(heading - direction, 2 * math.pi)) > math.radians(1.0):
                return 0.0
        least = min(least, least_clearance(space, start, end))
    return least


def room_of(geometry: SceneGeometry, space: FreeSpace, poses: Sequence[Sequence[float]], robot: Observer) -> float:
    """The least distance from the straight way through all poses to what the robot can touch, and 0 as `least_room`.

    Unlike in the cells of `space` it is measured to the scene's own edges: it is at most a millimetre less than it is.
    """
    room_m = least_room(space, poses)
    if room_m in (0.0, math.inf):
        return room_m
    steps = []
    for before, after in pairwise(poses):
        start, end = np.array(before[4:6], float), np.array(after[4:6], float)
        count = max(1, math.ceil(math.dist(start, end) / _ROOM_STEP_M))
        way = start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start)
        steps.append(np.stack([way[:-1], way[1:]], 1))
    # A robot turns on the spot, and passes some places more than once.
    ends = np.unique(np.concatenate(steps), axis=0)
    obstacles = ObstacleMap(geometry, robot.z_min_m, robot.z_max_m)
    distance_m = obstacles.distances_m(*ends.reshape(-1, 2).T.copy()).reshape(-1, 2).min(1)
    narrowest = ends[distance_m <= distance_m.min() + _ROOM_STEP_M / 2]
    shares = np.linspace(0.0, 1.0, _ROOM_PARTS + 1)[:, None, None]
    between = narrowest[:, 0] + shares * (narrowest[:, 1] - narrowest[:, 0])
    least_m = float(obstacles.distances_m(*between.reshape(-1, 2).T.copy()).min())
    return max(0.0, least_m - _ROOM_STEP_M / _ROOM_PARTS / 2)
