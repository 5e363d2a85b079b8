"""A robot that roams, in two rooms with a door between them, does as it is told and stops where it would touch."""

import math
from typing import Any

import numpy as np
import pytest

from benchbot.api import Observations
from benchbot.core.geometry import Pose
from benchbot.mapping import Roamer
from tests.plugins.mapping.casting import TWO_ROOMS, Box, scan

RADIUS_M, HEIGHT_M = 0.25, 0.6
LOW: Box = (1001, (0.6, -0.6, 0.0), (0.9, 0.6, 0.3))
"""The laser looks over it."""


class Robot:
    """Moves without error, and says how it ended."""

    def __init__(self, boxes: list[Box]) -> None:
        self.boxes = boxes
        self.pose = Pose.planar(0, 0.1, 0)
        self.driven_m = 0.0

    def observe(self) -> Observations:
        lidar = self.pose @ Pose((0, 0, HEIGHT_M))
        seen: Any = {"base_link": self.pose.record("map"), "lidar": lidar.record("map")}
        return {"laser": scan([box for box in self.boxes if box[2][2] > HEIGHT_M], lidar), "poses": seen}

    def move(self, action: str, arguments: dict[str, float]) -> str:
        if action == "move_angle":
            self.pose @= Pose.planar(0, 0, math.radians(arguments["angle"]))
        for _ in range(round(arguments.get("distance", 0) / 0.01)):
            ahead = self.pose @ Pose.planar(0.01, 0, 0)
            x, y, _ = ahead.translation_xyz
            gaps_m = [
                math.hypot(max(low[0] - x, x - high[0], 0), max(low[1] - y, y - high[1], 0))
                for _, low, high in self.boxes
            ]
            if min(gaps_m) < RADIUS_M:
                return "blocked"
            self.pose = ahead
            self.driven_m += 0.01
        return "reached"


def roam(robot: Robot, steps: int) -> list[tuple[str, float, float]]:
    roamer, outcome, told = Roamer(RADIUS_M, "base_link"), None, []
    for _ in range(steps):
        outcome = robot.move(*roamer.next_move(robot.observe(), outcome))
        told.append((outcome, *robot.pose.translation_xyz[:2]))
    return told


@pytest.mark.parametrize("boxes", [TWO_ROOMS, [*TWO_ROOMS, LOW]])
def test_it_comes_around(boxes: list[Box]) -> None:
    robot = Robot(boxes)
    told = roam(robot, 60)
    assert robot.driven_m > 15
    cells = {(math.floor(x / 0.75), math.floor(y / 0.75)) for _, x, y in told}
    assert max(x for _, x, _ in told) > 2.5, "it has not found the door"
    assert len(cells) > 10


def test_what_blocks_it_is_left_alone() -> None:
    outcomes = [outcome for outcome, *_ in roam(Robot([*TWO_ROOMS, LOW]), 60)]
    assert 0 < outcomes.count("blocked") < 12
    assert not any(np.convolve([outcome == "blocked" for outcome in outcomes], [1, 1, 1]) == 3)


def test_where_there_is_no_room_it_turns() -> None:
    closet: list[Box] = [
        (0, (-0.35, -1, 0), (-0.3, 1, 2)),
        (0, (0.3, -1, 0), (0.35, 1, 2)),
        (0, (-1, -0.25, 0), (1, -0.2, 2)),
        (0, (-1, 0.4, 0), (1, 0.45, 2)),
    ]
    assert Roamer(RADIUS_M, "base_link").next_move(Robot(closet).observe(), None)[0] == "move_angle"


def test_what_is_not_measured_is_no_wall() -> None:
    seen: Any = Robot(TWO_ROOMS).observe()
    seen["laser"]["scans"][:, 0] = np.inf
    roamer = Roamer(RADIUS_M, "base_link")
    roamer.next_move(seen, None)
    assert roamer.next_move(seen, "reached") == ("move_distance", {"distance": 1.5})
