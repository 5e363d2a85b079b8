"""A holonomic base is driven sideways over real DDS: by the driver, through its guard, and behind the bridge."""

import json
import math
import os
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig, Outcome
from plugins.robot_ros2.tests.bridge.bridged import bridge, listener
from plugins.robot_ros2.tests.unicycle import BY_TRUTH, act, declaration, driver, scene, unicycle
from tests.plugin_factory import DECLARES, PluginFactory
from tests.plugins.simulation.test_kinematic import HALL, HOLONOMIC, ROBOT

pytestmark = pytest.mark.usefixtures("domain")

LATERAL_MPS = 0.5
PLUGIN = (
    "\n".join(DECLARES.format(kind=kind) for kind in ("robots", "environments"))
    + """
from benchbot.plugin import Simulator

@hookimpl
def benchbot_simulators():
    yield Simulator("hall", _create)

def _create(spec):
    from tests.plugins.simulation.test_kinematic import HallSimulator

    return HallSimulator(spec)
"""
)


def holonomic(**driver: Any) -> dict[str, Any]:
    robot = declaration(**driver)
    robot["connections"]["move_sideways"] = robot["connections"]["move_distance"]
    robot["limits"]["lateral_mps"] = LATERAL_MPS
    return robot


def test_a_way_sideways_ends_where_it_should_and_before_what_the_laser_sees(tmp_path: Path) -> None:
    robot = holonomic()
    with unicycle(wall_x_m=0.8) as there, driver(robot, tmp_path) as platform:
        # Runs drive a robot through their host.
        host = InProcessHost(platform, [scene()], MotionConfig.from_robot(robot, "ground_truth"))
        host.load(0, 0)

        assert host.act("move_sideways", {"distance": 0.4}, None)[0] is Outcome.REACHED
        state = there.state
        assert (state["x"], state["y"]) == pytest.approx((0.0, 0.4), abs=0.01)
        assert math.degrees(state["yaw"]) == pytest.approx(0.0, abs=1.0)
        assert (platform.velocity, platform.lateral_mps) == ((0.0, 0.0), 0.0)
        assert platform.pose().translation_xyz[:2] == pytest.approx((state["x"], state["y"]), abs=1e-6)

        assert act(platform, robot, "move_angle", angle=-90) is Outcome.REACHED
        assert act(platform, robot, "move_sideways", distance=2.0) is Outcome.BLOCKED
        state = there.state
        assert 0.2 < state["x"] < 0.6
        assert not state["collided"]
        assert act(platform, robot, "move_sideways", distance=-0.2) is Outcome.REACHED
        assert there.state["x"] == pytest.approx(state["x"] - 0.2, abs=0.02)


def test_a_base_that_is_not_holonomic_does_not_move_and_says_what_to_declare(tmp_path: Path) -> None:
    robot = declaration()
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        with pytest.raises(BenchbotError, match="cannot drive sideways") as refused:
            act(platform, robot, "move_sideways", distance=0.4)
        assert "lateral_mps: 0.5" in refused.value.fix
        assert there.state["y"] == 0.0


@pytest.fixture
def hall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A holonomic robot in an empty hall, simulated by a plug-in that other processes find."""
    simulated = ROBOT | HOLONOMIC | {"noise": {"linear": 0.0, "angular": 0.0}}
    PluginFactory(tmp_path).make(
        "hall-simulator",
        PLUGIN,
        {"robots/disc.yaml": json.dumps(simulated), "environments/hall_1.yaml": json.dumps(HALL)},
    )
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]]))


@pytest.mark.xdist_group("robots 1")
def test_a_bridged_holonomic_base_obeys_the_driver_and_any_other_twist(hall: None, tmp_path: Path) -> None:
    truth = {**BY_TRUTH, "ros_topic": "/ground_truth/odom"}
    robot = holonomic(
        use_sim_time=True,
        localisation=truth,
        return_to_start={"by": "service", "ros_service": "/benchbot/reset", "scene_node": "/benchbot_bridge"},
    )
    for picture in ("image_rgb", "image_rgb_info"):
        del robot["connections"][picture]
    with bridge("--robot", "disc", "--env", "hall:1") as process, listener() as heard:
        assert process.stderr
        odometry = heard.hear("/odom", "nav_msgs/msg/Odometry")
        with driver(robot, tmp_path) as platform:
            platform.load(scene(), 0)
            odometry.clear()
            assert act(platform, robot, "move_sideways", distance=-0.5) is Outcome.REACHED
            assert heard.truth().translation_xyz == pytest.approx((0.0, -0.5, 0.0), abs=0.01)
            assert heard.truth().yaw_rad == pytest.approx(0.0, abs=math.radians(1.0))
        twists = [message.twist.twist for message in odometry]
        assert min(twist.linear.y for twist in twists) == pytest.approx(-LATERAL_MPS, abs=0.01)
        assert max(abs(twist.linear.x) for twist in twists) < 0.01

        # Nav2 commands both at once.
        before, go = heard.truth(), heard.velocities()
        while math.dist((before.inverse() @ heard.truth()).translation_xyz, (0, 0, 0)) < 0.3:
            go(0.3, 0.0, 0.3)
        way: Pose = before.inverse() @ heard.truth()
        assert way.translation_xyz[0] == pytest.approx(way.translation_xyz[1], rel=0.05)
