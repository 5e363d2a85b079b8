"""Fetching an object and putting it down, by rules: look around, drive there, grasp from above, and so on.

It knows nothing but what it observes. Obstacles are the points that its depth camera has seen; what is not seen yet
counts as free. Object and place are found by their classes in the segmentation; the grasp is across the narrowest side
that is seen from above.
"""

import json
import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from benchbot.api import ActionResult, Agent, BenchBot, BenchbotError, Observations
from benchbot.mapping import first_corner, planar, point_cloud, shortest_path
from benchbot.plugin import FailureClass

Floats = NDArray[np.float64]
Move = tuple[str, dict[str, Any]]
Moves = Iterator[Move]
Ended = Generator[Move, None, bool]
Point = tuple[float, float]

STAY: Move = ("move_angle", {"angle": 0.0})

LOOKS, LOOK_DEG = 6, 60.0
"""How often it looks around from where it is, and by how much it turns between."""
LOOKOUTS, FARTHEST_M = 4, 2.5
"""From how many places it looks around, and how far the next may be."""
CELL_M = 0.05
LOWEST_M, HIGHEST_M = 0.06, 1.35
"""Points between these heights are obstacles of the base."""
OWN_M = 0.42
"""Points so near to the base's axis are the robot's own, or what it holds."""
BORDER_M, RANK_M = 1.0, 0.1
MARGIN_M, LEAST_MARGIN_M = 0.06, 0.03
FEWEST_PIXELS = 12
REACH_M = (0.58, 0.62, 0.54, 0.66, 0.50, 0.70)
"""Distances from which it grasps and puts down, the best first."""
HEADINGS = 36
LONGEST_DRIVE_M, NEAR_M, BLOCKED_TRIES = 0.8, 0.04, 6
ABOVE_M, FINGER_M, DEPTH_M, DROP_M = 0.10, 0.028, 0.045, 0.018
"""How far above it waits; the least height of the fingers' middle above a surface; how deep it grasps; how far above
its place the object is let go."""
NEAR_HAND_M = 0.3
"""How far ahead the hand goes up and down between its folded place and its work: edges are farther away."""
HELD_M = 0.015
GRASPS = 3
EDGE_M, LARGE_M = 0.14, 0.2
"""How far from the edges of a place it puts something down, where there is room; and what is large is a place."""
BACK_OFF_M = 0.25


class FetchAndPlace(Agent):
    """A solution of tidy_up. `home` are the joints of the folded arm, in radians; `widest_m` opens the gripper."""

    def __init__(self, robot: Mapping[str, Any], widest_m: float = 0.11) -> None:
        self._base = str(robot["robot_frame"])
        self._radius_m = float(robot["footprint"]["radius_m"])
        self._home = [math.radians(angle) for angle in robot["arm"]["home_deg"]]
        self._widest_m = widest_m
        self._seen: dict[str, Floats] = {}
        self._obstacles: set[tuple[int, int]] = set()
        self._now: Observations = {}
        self._script: Moves | None = None
        self._finished = False

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the end of the script, and after a collision."""
        return self._finished or action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> Move:
        """Take in what is seen, and go on with the script."""
        self._now = observations
        if self._script is None:
            goal = observations["goal"]
            if not isinstance(goal, dict) or "image_segment" not in observations:
                raise BenchbotError(
                    "fetch_and_place does not know what to fetch, or cannot see it.",
                    f"The goal of this task is {goal!r}; it needs an object, a place, and segmented pictures.",
                    "Run it in a task manipulation:tidy_up:…:segmentation, see benchbot list tasks.",
                    failure=FailureClass.AGENT,
                )
            self._script = self._tidy_up(goal["object"], goal["place"])
        self._look(observations)
        move = next(self._script, None)
        self._finished = move is None
        return move or STAY

    def save_result(
        self,
        filename: str,
        empty_results: dict[str, Any],
        results_format_fns: Mapping[str, Callable[..., Any]],
    ) -> None:
        """Write the empty result: the score depends on where the objects are."""
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")

    def _tidy_up(self, thing: str, place: str) -> Moves:
        yield from self._look_around((thing, place))
        if thing not in self._seen:
            print(f"There is no {thing} to be seen.")
            return
        yield ("move_gripper", {"width": self._widest_m})
        for _ in range(GRASPS):
            if not (yield from self._stand_before(thing)):
                return
            above_surface_m = yield from self._grasp(thing)
            if above_surface_m is not None:
                break
        else:
            print(f"The {thing} was not grasped.")
            return
        yield from self._fold()
        if place not in self._seen:
            yield from self._look_around((place,))
        if place not in self._seen or not (yield from self._stand_before(place)):
            print(f"The {thing} was not brought to the {place}.")
            return
        yield from self._put_down(place, above_surface_m)
        print(f"The {thing} is on the {place}.")

    # What is seen.

    def _look(self, observations: Observations) -> None:
        """Note obstacles, and the points of classes where they are seen now."""
        cloud = point_cloud(observations)
        points = cloud.points.astype(np.float64)
        classes = observations["image_segment"]["class_segment_img"][cloud.rows, cloud.columns]
        base = observations["poses"][self._base]["translation_xyz"]
        apart = np.linalg.norm(points[:, :2] - base[:2], axis=1) > OWN_M
        points, classes = points[apart], classes[apart]
        solid = points[(points[:, 2] > LOWEST_M) & (points[:, 2] < HIGHEST_M)]
        self._obstacles |= {(int(i), int(j)) for i, j in np.unique(np.floor(solid[:, :2] / CELL_M).astype(int), axis=0)}
        for name, number in observations["image_segment"]["class_ids"].items():
            found = points[classes == number]
            if len(found) >= FEWEST_PIXELS:
                self._seen[name] = found

    def _look_around(self, wanted: Sequence[str]) -> Moves:
        """Turn once, here and in other places, until all that is wanted was seen."""
        stood: list[Point] = []
        for _ in range(LOOKOUTS):
            for _ in range(LOOKS):
                yield ("move_angle", {"angle": LOOK_DEG})
            stood.append(self._here()[:2])
            lookout = self._lookout(stood)
            if all(name in self._seen for name in wanted) or lookout is None:
                return
            yield from self._drive_along(self._floor(MARGIN_M).way(self._here()[:2], lookout))

    def _lookout(self, stood: Sequence[Point]) -> Point | None:
        """Return where there is room, as far as can be from all places where it has stood; None for nowhere."""
        floor = self._floor(MARGIN_M)
        x, y, _ = self._here()
        labels, _ = ndimage.label(floor.drivable)
        cells = np.argwhere((labels == labels[floor.cell((x, y))]) & floor.drivable)
        spots = floor.points(cells)
        known = np.array(sorted(self._obstacles)) * CELL_M
        inside = ((spots > known.min(0)) & (spots < known.max(0))).all(1)
        spots = spots[inside & (np.linalg.norm(spots - (x, y), axis=1) < FARTHEST_M)]
        if not len(spots):
            return None
        away_m = np.linalg.norm(spots[:, None] - np.array(stood)[None], axis=-1).min(1)
        best = spots[int(away_m.argmax())]
        return float(best[0]), float(best[1])

    def _here(self) -> tuple[float, float, float]:
        return planar(self._now["poses"][self._base])

    def _in_base(self, points: Floats) -> Floats:
        """Return points of the map frame (N, 3) in the robot's frame; it stands upright."""
        x, y, yaw = self._here()
        apart = points[:, :2] - (x, y)
        c, s = math.cos(yaw), math.sin(yaw)
        return np.column_stack([apart @ (c, s), apart @ (-s, c), points[:, 2]])

    # Driving.

    def _floor(self, margin_m: float) -> "Floor":
        """Return where the middle of the base may be, so far from all that was seen."""
        cells = np.array(sorted(self._obstacles))
        border = round(BORDER_M / CELL_M)
        low = cells.min(0) - border
        occupied = np.zeros(tuple(np.ptp(cells, axis=0) + 1 + 2 * border), bool)
        occupied[tuple((cells - low).T)] = True
        clearance_m = np.asarray(ndimage.distance_transform_edt(~occupied)) * CELL_M - CELL_M / 2
        return Floor(low, clearance_m >= self._radius_m + margin_m).around(self._here()[:2])

    def _stand_before(self, name: str) -> Ended:
        """Drive to where the arm reaches what was seen of a class, and face it; return whether it came there."""
        for _ in range(BLOCKED_TRIES):
            target = self._target(name)
            way = self._way_to(target)
            if way is None:
                print(f"No way leads to the {name}.")
                return False
            if not (yield from self._drive_along(way)) and self._away_m(name) > max(REACH_M):
                continue
            yield from self._face(self._target(name))
            if self._away_m(name) <= max(REACH_M):
                return True
        return False

    def _away_m(self, name: str) -> float:
        return math.dist(self._here()[:2], self._target(name))

    def _target(self, name: str) -> Point:
        """Return where to reach to, seen from above: the middle of an object, or a good spot on a place."""
        points = self._seen[name]
        spot = _spot(points, self._here()[:2]) if np.ptp(points[:, :2], axis=0).max() > LARGE_M else None
        x, y = spot[:2] if spot is not None else (points[:, :2].min(0) + points[:, :2].max(0)) / 2
        return float(x), float(y)

    def _way_to(self, target: Point) -> list[Point] | None:
        """Return the best way to a place from where the target can be reached."""
        here = self._here()[:2]
        for margin_m in (MARGIN_M, LEAST_MARGIN_M):
            floor = self._floor(margin_m)
            spots = [
                (math.dist(here, spot) + RANK_M * rank, rank, spot)
                for rank, away_m in enumerate(REACH_M)
                for heading in np.linspace(0.0, 2 * math.pi, HEADINGS, endpoint=False)
                if floor.is_free(
                    spot := (target[0] - away_m * math.cos(heading), target[1] - away_m * math.sin(heading))
                )
            ]
            best: tuple[float, list[Point]] | None = None
            for least_m, rank, spot in sorted(spots):
                if best is not None and least_m >= best[0]:
                    break
                way = floor.way(here, spot)
                length_m = sum(math.dist(*pair) for pair in pairwise(way)) + RANK_M * rank
                if way and (best is None or length_m < best[0]):
                    best = (length_m, way)
            if best is not None:
                return best[1]
        return None

    def _drive_along(self, way: Sequence[Point]) -> Ended:
        """Drive along corners; return whether it came to the last one."""
        for corner in way[1:]:
            if not (yield from self._drive_to(corner)):
                return False
        return True

    def _drive_to(self, corner: Point) -> Ended:
        """Drive straight to a point; return whether it came there."""
        while True:
            x, y, _ = self._here()
            away_m = math.dist((x, y), corner)
            if away_m < NEAR_M:
                return True
            yield from self._face(corner)
            yield ("move_distance", {"distance": round(min(away_m, LONGEST_DRIVE_M), 4)})
            if self.last_outcome == "blocked":
                x, y, yaw = self._here()
                ahead = np.array([x, y]) + (self._radius_m + 0.05) * np.array([math.cos(yaw), math.sin(yaw)])
                self._obstacles.add((int(ahead[0] // CELL_M), int(ahead[1] // CELL_M)))
                yield ("move_distance", {"distance": -0.1})
                return False

    def _face(self, target: Point) -> Moves:
        x, y, yaw = self._here()
        turn = math.remainder(math.atan2(target[1] - y, target[0] - x) - yaw, 2 * math.pi)
        if abs(turn) > math.radians(1.0):
            yield ("move_angle", {"angle": round(math.degrees(turn), 2)})

    # Grasping.

    def _grasp(self, name: str) -> Generator[Move, None, float | None]:
        """Grasp what is seen in front; return how high the fingers were above what it stood on, None for a miss."""
        points = self._in_base(self._seen[name])
        x, y, yaw = _narrowest(points[:, :2])
        bottom_m, top_m = float(points[:, 2].min()), float(points[:, 2].max())
        height_m = max(bottom_m + FINGER_M, top_m - DEPTH_M)
        reached = yield from self._come_down(x, y, yaw, top_m + ABOVE_M, height_m)
        if reached:
            yield ("move_gripper", {"width": 0.0})
            yield self._hand(x, y, top_m + ABOVE_M, yaw)
            yield self._hand(NEAR_HAND_M, 0.0, top_m + ABOVE_M, yaw)
        if reached and self._now["joint_states"]["positions"][-1] > HELD_M:
            return height_m - bottom_m
        yield ("move_gripper", {"width": self._widest_m})
        yield from self._fold()
        return None

    def _put_down(self, name: str, above_surface_m: float) -> Moves:
        spot = _spot(self._seen[name], self._here()[:2])
        if spot is None:
            points = self._seen[name]
            spot = np.array([*((points[:, :2].min(0) + points[:, :2].max(0)) / 2), np.median(points[:, 2])])
        x, y, surface_m = self._in_base(spot[None])[0]
        height_m = float(surface_m) + above_surface_m + DROP_M
        yield from self._come_down(float(x), float(y), 0.0, height_m + ABOVE_M, height_m)
        yield ("move_gripper", {"width": self._widest_m})
        yield self._hand(float(x), float(y), height_m + ABOVE_M, 0.0)
        yield self._hand(NEAR_HAND_M, 0.0, height_m + ABOVE_M, 0.0)
        yield from self._fold()

    def _come_down(self, x: float, y: float, yaw: float, above_m: float, height_m: float) -> Ended:
        """Bring the hand above a point and straight down to it; return whether it is there."""
        for at, z in (((NEAR_HAND_M, 0.0), above_m), ((x, y), above_m), ((x, y), height_m)):
            yield self._hand(*at, z, yaw)
            if self.last_outcome != "reached":
                print(f"The hand does not come to ({x:.2f}, {y:.2f}, {z:.2f}) m: {self.last_outcome}.")
                return False
        return True

    def _hand(self, x: float, y: float, z: float, yaw: float) -> Move:
        """Return the move of a hand that points down, its fingers apart across `yaw`."""
        pose = [x, y, z, math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0]
        return "move_end_effector", {"pose": [round(value, 5) for value in pose]}

    def _fold(self) -> Moves:
        yield ("move_joints", {"positions": [round(angle, 5) for angle in self._home]})
        yield ("move_distance", {"distance": -BACK_OFF_M})


@dataclass(frozen=True)
class Floor:
    """A grid of cells of `CELL_M` in the map frame, the first at `low` cells from the origin, and which are free."""

    low: NDArray[np.int64]
    drivable: NDArray[np.bool_]

    def around(self, here: Point) -> "Floor":
        """Return the floor with the cells free that the robot stands on: it got there."""
        drivable = self.drivable.copy()
        i, j = self.cell(here)
        drivable[max(i - 2, 0) : i + 3, max(j - 2, 0) : j + 3] = True
        return Floor(self.low, drivable)

    def cell(self, point: Point) -> tuple[int, int]:
        """Return the nearest cell to a point."""
        i, j = np.clip(np.floor(np.array(point) / CELL_M).astype(int) - self.low, 0, np.array(self.drivable.shape) - 1)
        return int(i), int(j)

    def points(self, cells: NDArray[np.int64]) -> Floats:
        """Return the middles (N, 2) of cells (N, 2)."""
        middles: Floats = np.asarray((cells + self.low + 0.5) * CELL_M, np.float64)
        return middles

    def is_free(self, point: Point) -> bool:
        """Return whether the robot may stand at a point."""
        return bool(self.drivable[self.cell(point)])

    def way(self, start: Point, goal: Point) -> list[Point]:
        """Return the corners of a way, `start` and `goal` included; an empty list when there is none."""
        cells = shortest_path(self.drivable, self.cell(start), self.cell(goal))
        corners: list[Point] = [start] if cells else []
        while len(cells) > 1:
            corner = first_corner(self.drivable, cells)
            cells = cells[cells.index(corner) :]
            x, y = self.points(np.array([corner]))[0]
            corners.append((float(x), float(y)))
        return [*corners[:-1], goal] if len(corners) > 1 else corners


def _narrowest(points: Floats) -> tuple[float, float, float]:
    """Return the middle of points (N, 2), and the turn of a hand whose fingers close across their narrowest side."""
    best = (math.inf, 0.0, 0.0, 0.0)
    for yaw in np.radians(np.arange(-90.0, 90.0, 10.0)):
        along, across = points @ (math.cos(yaw), math.sin(yaw)), points @ (-math.sin(yaw), math.cos(yaw))
        width = float(np.ptp(across))
        # Of equals the one that turns the wrist least.
        if width + 0.002 * abs(yaw) < best[0]:
            middle = ((along.min() + along.max()) / 2, (across.min() + across.max()) / 2)
            x = middle[0] * math.cos(yaw) - middle[1] * math.sin(yaw)
            y = middle[0] * math.sin(yaw) + middle[1] * math.cos(yaw)
            best = (width + 0.002 * abs(yaw), float(x), float(y), float(yaw))
    return best[1:]


def _spot(points: Floats, here: Point) -> Floats | None:
    """Return the nearest spot (3,) to `here` on the top of what is seen, away from its edges; None for a small one."""
    top_m = float(np.percentile(points[:, 2], 90))
    top = points[points[:, 2] > top_m - 0.04]
    cells = np.floor(top[:, :2] / 0.02).astype(int)
    low = cells.min(0) - 1
    grid = np.zeros(tuple(np.ptp(cells, axis=0) + 3), bool)
    grid[tuple((cells - low).T)] = True
    inside_m = np.asarray(ndimage.distance_transform_edt(ndimage.binary_closing(grid, iterations=2))) * 0.02
    enough_m = min(EDGE_M, 0.9 * float(inside_m.max()))
    if enough_m < 0.04:
        return None
    spots = (np.argwhere(inside_m >= enough_m) + low + 0.5) * 0.02
    nearest = spots[np.linalg.norm(spots - here, axis=1).argmin()]
    around = top[np.linalg.norm(top[:, :2] - nearest, axis=1) < 0.04]
    return np.array([*nearest, float(np.median(around[:, 2])) if len(around) else top_m])


if __name__ == "__main__":
    benchbot = BenchBot()
    benchbot.run(FetchAndPlace(benchbot.config["robot"]))
