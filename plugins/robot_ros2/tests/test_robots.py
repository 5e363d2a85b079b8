"""The robots that people own: each declaration is valid, careful, and says where its facts come from."""

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.motion import MotionConfig
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot_robot_ros2 import messages, signals
from benchbot_robot_ros2.declaration import Ros2Robot

OWNED = ("carter_nova", "jackal", "stretch", "turtlebot4")
CATALOG = Catalog(load())
FOLDER = CATALOG.pool("robots")["turtlebot4"].path.parent


def declared(name: str) -> Ros2Robot:
    return Ros2Robot.from_declaration(CATALOG.get("robots", name).data)


def test_benchbot_check_finds_nothing_wrong() -> None:
    command = [sys.executable, "-m", "benchbot", "check", str(FOLDER)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize("name", OWNED)
def test_it_runs_in_real_environments_and_says_that_it_is_untested(name: str) -> None:
    data = CATALOG.get("robots", name).data
    assert data["runs_in"] == ["real"]
    assert "untested on hardware" in data["description"]
    assert "Sources" in Path(FOLDER / f"{name}.yaml").read_text()


@pytest.mark.parametrize("name", OWNED)
def test_it_is_slow_enough_for_rooms_with_people(name: str) -> None:
    motion = MotionConfig.from_robot(CATALOG.get("robots", name).data, "ground_truth")
    backwards_mps, forwards_mps = motion.linear_limits_mps
    assert forwards_mps <= 0.5
    assert abs(backwards_mps) <= forwards_mps
    assert motion.stops_before_contact


@pytest.mark.parametrize("name", OWNED)
def test_every_topic_has_a_type_that_is_installed(name: str) -> None:
    robot = declared(name)
    for connection in robot.observations.values():
        for topic in connection.parts().values():
            assert messages.message_type(topic.ros_type)
    assert messages.message_type(robot.command.ros_type)
    signals.check(robot)


def test_the_robots_whose_interface_tells_their_charge_do_not_start_with_an_empty_battery() -> None:
    batteries = {name: declared(name).settings.safety.battery for name in OWNED}
    assert {name for name, battery in batteries.items() if battery is not None} == {"jackal", "turtlebot4"}


def test_the_collision_that_the_turtlebot_4_tells_of_is_declared_right_where_its_messages_are_installed() -> None:
    text = (FOLDER / "turtlebot4.yaml").read_text()
    told = text.partition("    # collision:\n")[2].replace("    #   ", "")
    collision = yaml.safe_load(told.partition("\n  timing")[0])
    robot = CATALOG.get("robots", "turtlebot4@robot1").data
    robot["driver"]["safety"]["collision"] = collision
    signals.check(Ros2Robot.from_declaration(robot))


@pytest.mark.parametrize("name", OWNED)
def test_the_laser_that_guards_it_is_mounted_somewhere_on_it(name: str) -> None:
    robot = declared(name)
    mount = robot.mounts[CATALOG.get("robots", name).data["laser"]["frame"]]
    assert "laser" in robot.settings.safety.obstacles
    assert abs(mount.translation_xyz[0]) < robot.footprint.radius_m
    assert 0.05 < mount.translation_xyz[2] < robot.footprint.z_m[1]


@pytest.mark.parametrize("name", OWNED)
def test_a_person_or_nav2_brings_it_back_to_its_start(name: str) -> None:
    settings = declared(name).settings
    assert type(settings.return_to_start).__name__ in ("ReturnByOperator", "ReturnByNavigation")


@pytest.mark.parametrize("name", OWNED)
def test_declared_cameras_look_ahead(name: str) -> None:
    robot = declared(name)
    if robot.camera_frame in robot.mounts:
        optical_axis = robot.mounts[robot.camera_frame].matrix()[:3, 2]
        assert optical_axis == pytest.approx([1, 0, 0], abs=1e-6)


@pytest.mark.parametrize("name", ["carter", "carter_ros2"])
def test_the_time_of_a_simulated_robot_is_simulated_behind_ros_2_too(name: str) -> None:
    task = "semantic_slam:passive:ground_truth"
    assert select(CATALOG, RunRequest(task, name, "miniroom:1")).time_is_simulated
