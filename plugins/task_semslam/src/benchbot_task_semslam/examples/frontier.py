"""Autonomous exploration: look around, then drive to unseen places, and map objects on the way.

Laser and depth say where the floor is free, the camera's field of view where the robot has looked. The next viewpoint
is the one that shows most beyond the frontier for the length of the way to it, which A* finds. It ends when no frontier
is left that is worth the way.
"""

import argparse
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, Agent, BenchBot, Observations
from benchbot.mapping import (
    Cell,
    ObjectMap,
    OccupancyGrid,
    Point,
    Sight,
    best_viewpoint,
    changes,
    describe,
    describe_changes,
    first_corner,
    look,
    planar,
    point_cloud,
    shortest_path,
)

Move = tuple[str, dict[str, float]]

STEP_BUDGET = 300
LEAST_GAIN_M2 = 0.05
"""The area that a viewpoint must show, and as much more for each metre of the way to it."""
OBSTACLE_HEIGHT_M = (0.05, 1.15)
OBSTACLE_REACH_M = 3.5
MARGIN_M = 0.08
LONGEST_DRIVE_M = 2.0
HEADING_TOLERANCE_RAD = math.radians(4)
STAY: Move = ("move_angle", {"angle": 0.0})


class Explorer:
    """The exploration of one scene: it takes observations and returns the next move."""

    def __init__(self, observations: Observations, robot_radius_m: float, robot_frame: str) -> None:
        self.objects = ObjectMap()
        self._radius_m = robot_radius_m
        self._frame = robot_frame
        x, y, _ = planar(observations["poses"][robot_frame])
        self._grid = OccupancyGrid((x, y))
        camera_height_m = float(observations["poses"]["camera"]["translation_xyz"][2])
        self._sight = Sight.of(observations["image_depth_info"], camera_height_m)
        self._looks = math.ceil(2 * math.pi / self._sight.field_of_view_rad)
        self._goal: tuple[Cell, float] | None = None
        self._drive: tuple[Point, float] | None = None

    def next_move(self, observations: Observations) -> Move | None:
        """Map what is seen; return the next move, or None when no frontier is left."""
        x, y, yaw_rad = planar(observations["poses"][self._frame])
        self._take_in(observations)
        self._notice_contact((x, y), yaw_rad)
        if self._looks > 0:
            self._looks -= 1
            return _turn(self._sight.field_of_view_rad)
        drivable = self._grid.drivable(self._radius_m + MARGIN_M, (x, y))
        robot = self._grid.cell((x, y))
        while True:
            if self._goal is None:
                least = round(LEAST_GAIN_M2 / self._grid.resolution_m**2)
                viewpoint = best_viewpoint(self._grid, drivable, robot, self._sight, least)
                if viewpoint is None:
                    return None
                self._goal = viewpoint.cell, viewpoint.heading_rad
            cell, heading_rad = self._goal
            path = shortest_path(drivable, robot, cell)
            if len(path) > 1:
                return self._towards(first_corner(drivable, path), (x, y), yaw_rad)
            self._goal = None
            turn_rad = _wrap(heading_rad - yaw_rad)
            if path and abs(turn_rad) > HEADING_TOLERANCE_RAD:
                return _turn(turn_rad)
            # Here it is of no use to look, or there is no way: never choose this again.
            look(self._grid, self._grid.center(cell), heading_rad, self._sight)

    def _take_in(self, observations: Observations) -> None:
        poses = observations["poses"]
        self.objects.add(observations)
        self._grid.add_laser(observations["laser"], poses["lidar"])
        points = point_cloud(observations, OBSTACLE_REACH_M).points
        low_m, high_m = OBSTACLE_HEIGHT_M
        self._grid.add_points(points[(points[:, 2] > low_m) & (points[:, 2] < high_m)])
        x, y, heading_rad = planar(poses["camera"], axis=2)
        look(self._grid, (x, y), heading_rad, self._sight)

    def _notice_contact(self, position: Point, yaw_rad: float) -> None:
        """Mark an obstacle that the sensors do not show ahead of a drive that ended early."""
        if self._drive is not None:
            start, distance_m = self._drive
            if math.dist(start, position) < 0.9 * distance_m - 0.02:
                ahead_m = self._radius_m + MARGIN_M
                spot = (position[0] + ahead_m * math.cos(yaw_rad), position[1] + ahead_m * math.sin(yaw_rad))
                self._grid.block(spot, MARGIN_M)
                self._goal = None
        self._drive = None

    def _towards(self, cell: Cell, position: Point, yaw_rad: float) -> Move:
        x, y = self._grid.center(cell)
        turn_rad = _wrap(math.atan2(y - position[1], x - position[0]) - yaw_rad)
        if abs(turn_rad) > HEADING_TOLERANCE_RAD:
            return _turn(turn_rad)
        distance_m = min(math.dist((x, y), position), LONGEST_DRIVE_M)
        self._drive = position, distance_m
        return "move_distance", {"distance": round(distance_m, 4)}


class FrontierMapper(Agent):
    """Explores each scene until no frontier is left, or its steps are used up."""

    def __init__(self, robot_radius_m: float, robot_frame: str, step_budget: int = STEP_BUDGET) -> None:
        self._explorers: dict[int, Explorer] = {}
        self._robot = robot_radius_m, robot_frame
        self._budget = step_budget
        self._steps = 0
        self._finished = False

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop when there is nothing left to look at, or when the robot has hit something."""
        done = self._finished or action_result is not ActionResult.SUCCESS
        if done:
            self._finished, self._steps = False, 0
        return done

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> Move:
        """Map what is seen and go on to where there is more."""
        scene: int = observations["scene_number"]
        if scene not in self._explorers:
            self._explorers[scene] = Explorer(observations, *self._robot)
        move = self._explorers[scene].next_move(observations)
        self._steps += 1
        self._finished = move is None or self._steps >= self._budget
        if self._finished:
            why = "No frontier is left" if move is None else "The steps are used up"
            print(f"{why} after {self._steps} steps: {len(self._explorers[scene].objects.objects)} objects.")
        return move or STAY

    def save_result(
        self,
        filename: str,
        empty_results: dict[str, Any],
        results_format_fns: Mapping[str, Callable[..., Any]],
    ) -> None:
        """Write the map of a scene, or what has changed from the first scene to the second."""
        results = empty_results["results"]
        scenes = [self._explorers[number].objects.objects for number in sorted(self._explorers)]
        if "state_list" not in results:
            results["objects"] = [describe(item, results["class_list"]) for scene in scenes for item in scene]
        elif len(scenes) == 2:
            results["objects"] = describe_changes(changes(*scenes), results)
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


def _wrap(angle_rad: float) -> float:
    return math.remainder(angle_rad, 2 * math.pi)


def _turn(angle_rad: float) -> Move:
    return "move_angle", {"angle": round(math.degrees(angle_rad), 2)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=STEP_BUDGET, help="at most so many moves in a scene")
    steps = parser.parse_args().steps
    benchbot = BenchBot()
    declared = benchbot.config["robot"]
    benchbot.run(FrontierMapper(declared["footprint"]["radius_m"], declared["robot_frame"], steps))
