"""Driving to a point: planning around obstacles from the laser and from contact, again after each move.

Where nothing was seen yet, the floor counts as free. What the laser's plane misses, such as a low table, is learnt by
being stopped before it: that needs a robot that stops before contact.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from benchbot.api import ActionResult, Agent, BenchBot, BenchbotError, Observations
from benchbot.plugin import FailureClass, FramePose, LaserScan
from benchbot_task_navigation.floor_plan import Floats, FloorPlan, Point
from benchbot_task_navigation.ways import Ways

Move = tuple[str, dict[str, float]]
Place = tuple[float, float, float]

RESOLUTION_M = 0.05
AROUND_M = 4.0
# Rooms that the way leads through may lie aside: where there is none, look for one farther away.
WIDEN_M = 5.0
WIDENINGS = 3
REACH_M = 6.0
# Tried in this order: with room to spare as long as there is a way.
MARGINS_M = (0.10, 0.05, 0.02)
ARRIVED_M = 0.08
LONGEST_DRIVE_M = 0.6
# A corner so near is one of the grid, not of the way.
NEAR_M = 0.05
BACK_OFF_M = 0.15
HEADING_TOLERANCE_RAD = math.radians(3)
STEP_BUDGET = 300
STAY: Move = ("move_angle", {"angle": 0.0})


class Driver:
    """Drives one robot to one goal; all places are in the map frame."""

    def __init__(self, start: Place, goal: Iterable[float], robot_radius_m: float) -> None:
        x, y, yaw_rad = start
        forward_m, left_m = (float(value) for value in goal)
        self.goal: Point = (
            x + forward_m * math.cos(yaw_rad) - left_m * math.sin(yaw_rad),
            y + forward_m * math.sin(yaw_rad) + left_m * math.cos(yaw_rad),
        )
        self._radius_m = robot_radius_m
        corners = np.array([(x, y), self.goal])
        low = np.floor((corners.min(0) - AROUND_M) / RESOLUTION_M).astype(int)
        self._origin = (float(low[0] * RESOLUTION_M), float(low[1] * RESOLUTION_M))
        size = np.ceil((corners.max(0) + AROUND_M - self._origin) / RESOLUTION_M).astype(int)
        self._seen = np.zeros(size, bool)
        self._felt = np.zeros(size, bool)
        self._drive: tuple[Point, float] | None = None
        self._bumps = 0
        self._widenings = 0

    def next_move(self, here: Place, points: Floats) -> Move | None:
        """Take in what the laser sees, points (N, 2); return the next move, or None at the goal or without a way."""
        x, y, yaw_rad = here
        self._mark(self._seen, points)
        self._notice_contact((x, y), yaw_rad)
        if math.dist((x, y), self.goal) <= ARRIVED_M:
            return None
        if self._bumps > 1 and self._bumps % 2 == 0:
            self._bumps += 1
            return "move_distance", {"distance": -BACK_OFF_M}
        corner = self._corner((x, y))
        while corner is None and self._widenings < WIDENINGS and self._leads_off((x, y)):
            self._widen()
            self._mark(self._seen, points)
            corner = self._corner((x, y))
        if corner is None:
            # Drift smears old walls: begin again with what is seen from here.
            self._seen[:] = False
            self._mark(self._seen, points)
            corner = self._corner((x, y))
        if corner is None:
            return None
        turn_rad = math.remainder(math.atan2(corner[1] - y, corner[0] - x) - yaw_rad, 2 * math.pi)
        if abs(turn_rad) > HEADING_TOLERANCE_RAD:
            return "move_angle", {"angle": round(math.degrees(turn_rad), 2)}
        distance_m = min(math.dist(corner, (x, y)), LONGEST_DRIVE_M)
        self._drive = (x, y), distance_m
        return "move_distance", {"distance": round(distance_m, 4)}

    def _corner(self, here: Point) -> Point | None:
        """Return the first corner of the way to the goal."""
        plan = self._plan()
        if plan is None:
            return self.goal
        for margin_m in MARGINS_M:
            way = Ways(plan, self._radius_m + margin_m, reach=1).between(here, self.goal)
            if way is not None:
                ahead = next((corner for corner in way[1:] if math.dist(corner, here) > NEAR_M), way[-1])
                return float(ahead[0]), float(ahead[1])
        return None

    def _plan(self) -> FloorPlan | None:
        """Return how much room there is, None when nothing was met yet."""
        occupied = self._seen | self._felt
        if not occupied.any():
            return None
        clearance_m = np.asarray(ndimage.distance_transform_edt(~occupied)) * RESOLUTION_M
        return FloorPlan(self._origin, RESOLUTION_M, clearance_m)

    def _leads_off(self, here: Point) -> bool:
        """Return whether the free floor around a place reaches the edge of the grid."""
        plan = self._plan()
        free = None if plan is None else plan.clearance_m >= self._radius_m + MARGINS_M[-1]
        if plan is None or free is None or not free.any():
            return False
        nodes = np.argwhere(free)
        nearest = nodes[np.linalg.norm(plan.points(nodes) - here, axis=1).argmin()]
        regions, _ = ndimage.label(free)
        edge = np.concatenate([regions[0], regions[-1], regions[:, 0], regions[:, -1]])
        return bool((edge == regions[tuple(nearest)]).any())

    def _widen(self) -> None:
        """Plan on more floor, on all sides."""
        nodes = round(WIDEN_M / RESOLUTION_M)
        self._origin = (self._origin[0] - nodes * RESOLUTION_M, self._origin[1] - nodes * RESOLUTION_M)
        self._seen, self._felt = np.pad(self._seen, nodes), np.pad(self._felt, nodes)
        self._widenings += 1

    def _notice_contact(self, here: Point, yaw_rad: float) -> None:
        """Mark an obstacle that the laser misses where a drive ended early; it grows wider with each repetition."""
        if self._drive is None:
            return
        start, distance_m = self._drive
        self._drive = None
        driven_m = math.dist(start, here)
        self._bumps = 0 if driven_m > NEAR_M else self._bumps
        if driven_m < 0.9 * distance_m - 0.02:
            self._bumps += 1
            ahead_m = self._radius_m + 0.03
            sideways = RESOLUTION_M * np.arange(-self._bumps, self._bumps + 1)
            x = here[0] + ahead_m * math.cos(yaw_rad) - sideways * math.sin(yaw_rad)
            y = here[1] + ahead_m * math.sin(yaw_rad) + sideways * math.cos(yaw_rad)
            self._mark(self._felt, np.stack([x, y], 1))

    def _mark(self, grid: Any, points: Floats) -> None:
        nodes = np.rint((points - self._origin) / RESOLUTION_M).astype(int)
        i, j = nodes[((nodes >= 0) & (nodes < grid.shape)).all(1)].T
        grid[i, j] = True


class GoToGoal(Agent):
    """A solution that drives to the goal and ends the run by its result."""

    def __init__(self, robot_radius_m: float, robot_frame: str, step_budget: int = STEP_BUDGET) -> None:
        self._radius_m = robot_radius_m
        self._frame = robot_frame
        self._budget = step_budget
        self._driver: Driver | None = None
        self._steps = 0
        self._finished = False

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the goal, when no way leads there, and after a collision."""
        return self._finished or action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> Move:
        """Go on towards the goal."""
        here = _place(observations["poses"][self._frame])
        if self._driver is None:
            start = _place(observations["poses"].get("initial_pose", observations["poses"][self._frame]))
            goal = observations["goal"]
            if not isinstance(goal, np.ndarray):
                raise BenchbotError(
                    "go_to_goal drives to points only.",
                    f"The goal of this task is an object: {goal!r}.",
                    "Run it in a task navigation:point_goal:…, see benchbot list tasks.",
                    failure=FailureClass.AGENT,
                )
            self._driver = Driver(start, goal, self._radius_m)
        move = self._driver.next_move(here, _points(observations["laser"], observations["poses"]["lidar"]))
        self._steps += 1
        self._finished = move is None or self._steps >= self._budget
        if self._finished:
            left_m = math.dist(here[:2], self._driver.goal)
            print(f"Stopped after {self._steps} steps, {left_m:.2f} m from the goal.")
        return move or STAY

    def save_result(
        self,
        filename: str,
        empty_results: dict[str, Any],
        results_format_fns: Mapping[str, Callable[..., Any]],
    ) -> None:
        """Write the empty result: the score depends on the robot's path."""
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


def _points(laser: LaserScan, pose: FramePose) -> Floats:
    """Return what the laser has hit within reach, (N, 2) in the map frame."""
    ranges_m, angles = laser["scans"][:, 0], laser["scans"][:, 1]
    hit = np.isfinite(ranges_m) & (ranges_m >= laser["range_min"]) & (ranges_m <= REACH_M)
    x, y, yaw_rad = _place(pose)
    headings = angles[hit] + yaw_rad
    return np.stack([x + ranges_m[hit] * np.cos(headings), y + ranges_m[hit] * np.sin(headings)], 1)


def _place(pose: FramePose) -> Place:
    """Return x and y in metres, and the heading in radians."""
    x, y, _ = pose["translation_xyz"]
    return float(x), float(y), float(pose["rotation_rpy"][2])


if __name__ == "__main__":
    benchbot = BenchBot()
    declared = benchbot.config["robot"]
    benchbot.run(GoToGoal(declared["footprint"]["radius_m"], declared["robot_frame"]))
