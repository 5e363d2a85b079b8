"""Roaming by laser: straight drives to where there is room and where the robot has been least."""

import math
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import Observations
from benchbot.plugins.mapping.occupancy import Point
from benchbot.plugins.mapping.projection import planar

Move = tuple[str, dict[str, float]]

HEADINGS = 36
MARGIN_M = 0.08
LONGEST_DRIVE_M, SHORTEST_DRIVE_M = 1.5, 0.15
CELL_M = 0.5
"""Places count as the same within a cell of this size."""
TURN_COST_M = 0.3
"""The way that half a turn is worth: drives ahead are preferred among equals."""
BLOCKED_HALF_WIDTH_M = 0.15


class Roamer:
    """The moves of one robot: give it each observation, and how the last action ended (`BenchBot.last_outcome`).

    A drive is worth its length, less the more often its places have been visited, and less what turning costs. What
    has blocked a drive is remembered, since a level laser looks over low objects.
    """

    def __init__(self, robot_radius_m: float, robot_frame: str) -> None:
        self._radius_m, self._frame = robot_radius_m, robot_frame
        self._visits: Counter[tuple[int, int]] = Counter()
        self._bumps: list[Point] = []
        self._drive_m = 0.0

    def next_move(self, observations: Observations, outcome: str | None) -> Move:
        """Return the next action and its argument."""
        x, y, yaw_rad = planar(observations["poses"][self._frame])
        self._visits[_cell(x, y)] += 1
        if outcome == "blocked":
            self._remember_bump((x, y), yaw_rad)
        planned_m, self._drive_m = self._drive_m, 0.0
        around_rad = np.arange(HEADINGS, dtype=np.float64) * (2 * math.pi / HEADINGS)
        turns_rad: NDArray[np.float64] = (around_rad + math.pi) % (2 * math.pi) - math.pi
        room_m = self._room_m(observations, (x, y), yaw_rad, turns_rad)
        if planned_m and outcome != "blocked" and room_m[0] >= SHORTEST_DRIVE_M:
            return self._ahead(min(planned_m, float(room_m[0])))
        drives = zip(turns_rad.tolist(), room_m.tolist(), strict=True)
        worth = np.array([self._worth((x, y), yaw_rad + turn_rad, drive_m) for turn_rad, drive_m in drives])
        worth -= TURN_COST_M * abs(turns_rad) / math.pi
        worth[room_m < SHORTEST_DRIVE_M] = -math.inf
        best = int(worth.argmax())
        if worth[best] == -math.inf:
            # From another heading the laser may see a gap.
            return "move_angle", {"angle": 45.0}
        if best == 0:
            return self._ahead(float(room_m[0]))
        self._drive_m = float(room_m[best])
        return "move_angle", {"angle": round(math.degrees(turns_rad[best]), 1)}

    def _ahead(self, distance_m: float) -> Move:
        return "move_distance", {"distance": round(distance_m, 2)}

    def _remember_bump(self, position: Point, yaw_rad: float) -> None:
        """Note what stands ahead: its edge is beyond the robot's, somewhere across."""
        ahead_m = self._radius_m + MARGIN_M
        for aside_m in (-BLOCKED_HALF_WIDTH_M, 0.0, BLOCKED_HALF_WIDTH_M):
            self._bumps.append(
                (
                    position[0] + ahead_m * math.cos(yaw_rad) - aside_m * math.sin(yaw_rad),
                    position[1] + ahead_m * math.sin(yaw_rad) + aside_m * math.cos(yaw_rad),
                )
            )

    def _room_m(
        self, observations: Observations, position: Point, yaw_rad: float, turns_rad: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return how far the robot can drive after each turn, by its laser and by what has blocked it."""
        ranges_m, angles_rad = observations["laser"]["scans"].T
        measured = np.isfinite(ranges_m)
        lidar_x, lidar_y, lidar_yaw_rad = planar(observations["poses"].get("lidar", observations["poses"][self._frame]))
        bearings_rad = angles_rad[measured] + lidar_yaw_rad
        hits = np.stack(
            [
                lidar_x + ranges_m[measured] * np.cos(bearings_rad),
                lidar_y + ranges_m[measured] * np.sin(bearings_rad),
            ],
            1,
        )
        hits = np.concatenate([hits, np.array(self._bumps).reshape(-1, 2)]) - position
        headings_rad = yaw_rad + turns_rad
        cos, sin = np.cos(headings_rad)[:, None], np.sin(headings_rad)[:, None]
        ahead_m, aside_m = hits[:, 0] * cos + hits[:, 1] * sin, hits[:, 1] * cos - hits[:, 0] * sin
        reach_m = self._radius_m + MARGIN_M
        in_way = (ahead_m > 0) & (abs(aside_m) < reach_m)
        # A disc touches a point that is aside before its front does.
        before_m = ahead_m - np.sqrt(np.maximum(reach_m**2 - aside_m**2, 0.0))
        room_m: NDArray[np.float64] = np.where(in_way, before_m, np.inf).min(axis=1, initial=LONGEST_DRIVE_M)
        return np.maximum(room_m, 0.0)

    def _worth(self, position: Point, heading_rad: float, drive_m: float) -> float:
        """Return the metres of a drive, each less the more often its place has been visited."""
        steps = np.arange(CELL_M / 2, drive_m + 1e-9, CELL_M / 2)
        places = [
            _cell(position[0] + step * math.cos(heading_rad), position[1] + step * math.sin(heading_rad))
            for step in [*steps.tolist(), drive_m]
        ]
        return drive_m * sum(1 / (1 + self._visits[place]) ** 2 for place in places) / len(places)


def _cell(x: float, y: float) -> tuple[int, int]:
    return math.floor(x / CELL_M), math.floor(y / CELL_M)
