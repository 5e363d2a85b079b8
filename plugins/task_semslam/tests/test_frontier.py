"""The exploring example, in two rooms with a door between them, with a robot that does as it is told."""

import itertools
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from benchbot.api import ActionResult, Observations
from benchbot.core.geometry import Pose
from benchbot_task_semslam.examples.frontier import STEP_BUDGET, FrontierMapper
from tests.plugins.mapping.casting import OPTICAL, TWO_ROOMS, Box, observe, scan

RADIUS_M = 0.25
# Objects of the classes 1 and 2: a chair behind the wall, and a table too low for the laser.
CHAIR: Box = (1001, (3.6, -1.3, 0.0), (4.0, -0.9, 0.9))
TABLE: Box = (2001, (-1.2, -1.3, 0.0), (-0.6, -0.7, 0.4))
WORLD = [*TWO_ROOMS, CHAIR, TABLE]


class Robot:
    """Moves without error, and stops where it would touch a box."""

    def __init__(self, world: Sequence[Box] = WORLD, x: float = 0.0, y: float = 0.5) -> None:
        self.world = world
        self.pose = Pose.planar(x, y, 0)

    def observe(self) -> Observations:
        lidar = self.pose @ Pose((0, 0, 0.6))
        camera = self.pose @ Pose((0, 0, 1.0)) @ OPTICAL
        frame = observe(self.world, camera)
        frame["laser"] = scan(self.world, lidar)
        frame["poses"] |= {"base_link": self.pose.record("map"), "lidar": lidar.record("map")}
        return frame

    def move(self, action: str, arguments: dict[str, float]) -> None:
        if action == "move_angle":
            self.pose @= Pose.planar(0, 0, math.radians(arguments["angle"]))
        for _ in range(round(arguments.get("distance", 0) / 0.01)):
            ahead = self.pose @ Pose.planar(0.01, 0, 0)
            if self.clearance_m(ahead) < RADIUS_M:
                return
            self.pose = ahead

    def clearance_m(self, pose: Pose) -> float:
        x, y, _ = pose.translation_xyz
        return min(
            math.hypot(max(low[0] - x, x - high[0], 0), max(low[1] - y, y - high[1], 0)) for _, low, high in self.world
        )


def explore(agent: FrontierMapper, robot: Robot) -> Iterator[Pose]:
    while not agent.is_done(ActionResult.SUCCESS):
        robot.move(*agent.pick_action(robot.observe(), ["move_angle", "move_distance"]))
        yield robot.pose


@pytest.fixture(scope="module")
def explored() -> tuple[FrontierMapper, list[Pose]]:
    agent = FrontierMapper(RADIUS_M, "base_link")
    return agent, list(explore(agent, Robot()))


def test_it_goes_into_the_other_room_and_ends_by_itself(explored: tuple[FrontierMapper, list[Pose]]) -> None:
    _, poses = explored

    assert max(pose.translation_xyz[0] for pose in poses) > 2.0
    assert len(poses) < STEP_BUDGET


def test_it_maps_what_it_sees_there(explored: tuple[FrontierMapper, list[Pose]], tmp_path: Path) -> None:
    agent, _ = explored
    results = {"objects": [], "class_list": ["chair", "table", "background"]}
    agent.save_result(str(tmp_path / "result.json"), {"results": results}, {})

    chair, table = json.loads((tmp_path / "result.json").read_text())["results"]["objects"]
    assert (chair["label_probs"], table["label_probs"]) == ([1, 0, 0], [0, 1, 0])
    np.testing.assert_allclose(chair["centroid"], np.mean(CHAIR[1:], axis=0), atol=0.1)
    np.testing.assert_allclose(table["centroid"], np.mean(TABLE[1:], axis=0), atol=0.1)


def test_it_stays_clear_of_what_it_sees(explored: tuple[FrontierMapper, list[Pose]]) -> None:
    _, poses = explored

    assert min(Robot().clearance_m(pose) for pose in poses) > RADIUS_M + 0.02


def test_it_stops_when_its_steps_are_used_up_and_begins_anew_in_the_next_scene() -> None:
    agent = FrontierMapper(RADIUS_M, "base_link", step_budget=5)

    assert len(list(explore(agent, Robot()))) == 5
    assert not agent.is_done(ActionResult.SUCCESS)
    assert agent.is_done(ActionResult.COLLISION)


def test_it_does_not_shuttle_between_far_rooms() -> None:
    """In two rooms side by side whose doors are at the far ends of a corridor: near by air, far to drive."""
    world: list[Box] = [
        (0, (-2.6, -1.5, 0), (-2.5, 3.0, 2)),
        (0, (2.5, -1.5, 0), (2.6, 3.0, 2)),
        (0, (-2.6, -1.5, 0), (2.6, -1.4, 2)),
        (0, (-2.6, 3.0, 0), (2.6, 3.1, 2)),
        (0, (-0.05, 0.0, 0), (0.05, 3.0, 2)),
        (0, (-1.5, -0.1, 0), (1.5, 0.0, 2)),
    ]
    poses = explore(FrontierMapper(RADIUS_M, "base_link"), Robot(world, -1.2, 1.5))
    places = [pose.translation_xyz for pose in poses]

    rooms = ["corridor" if y < 0 else "left" if x < 0 else "right" for x, y, _ in places]
    visits = [room for room, _ in itertools.groupby(rooms)]
    assert "right" in visits
    assert len(visits) <= len(["left", "corridor", "right", "corridor", "left"])


def test_where_it_is_stopped_it_does_not_try_again() -> None:
    class Glass(Robot):
        """There is a pane in the door that no sensor shows."""

        def clearance_m(self, pose: Pose) -> float:
            return min(
                super().clearance_m(pose), abs(1.3 - pose.translation_xyz[0]) if pose.translation_xyz[0] > 0 else 9
            )

    robot = Glass()
    poses = list(explore(FrontierMapper(RADIUS_M, "base_link", step_budget=80), robot))

    assert len(poses) < 80
    assert all(pose.translation_xyz[0] < 1.1 for pose in poses)
