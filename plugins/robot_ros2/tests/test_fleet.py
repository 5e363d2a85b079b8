"""Two robots of one declaration in one domain, each driven as if it were alone."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.motion import Outcome
from benchbot.core.plugin_manager import Plugins, installed
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.declaration import Ros2Robot
from plugins.robot_ros2.tests.unicycle import act, declaration, driver, fleet_declaration, scene, unicycle, until

pytestmark = pytest.mark.usefixtures("domain")


def member(namespace: str, **settings: Any) -> dict[str, Any]:
    """Return the declaration that the catalog makes of `unicycle@namespace`."""
    robot = fleet_declaration(**settings)
    return robot | {"name": f"unicycle@{namespace}", "driver": robot["driver"] | {"namespace": namespace}}


def test_two_robots_of_one_declaration_are_driven_at_once_and_neither_obeys_the_other(tmp_path: Path) -> None:
    one, other = member("r1"), member("r2")
    with (
        unicycle(namespace="r1") as first,
        unicycle(namespace="r2") as second,
        driver(one, tmp_path) as first_driver,
        driver(other, tmp_path) as second_driver,
    ):
        first_driver.load(scene(), 0)
        second_driver.load(scene(), 0)
        outcomes = []

        def walk() -> None:
            outcomes.append(act(first_driver, one, "move_distance", distance=1.0))

        walking = threading.Thread(target=walk)
        walking.start()
        until(lambda: first.state["x"] > 0.1)
        assert second.state["moved_s"] is None
        outcomes.append(act(second_driver, other, "move_angle", angle=90))
        walking.join()

        assert outcomes == [Outcome.REACHED, Outcome.REACHED]
        assert (first.state["x"], first.state["yaw"]) == (pytest.approx(1.0, abs=0.02), pytest.approx(0.0, abs=0.02))
        assert (second.state["x"], second.state["yaw"]) == (0.0, pytest.approx(1.571, abs=0.02))

        # One is stopped for safety, the other goes on.
        first_driver.halt("Enough.")
        assert act(second_driver, other, "move_distance", distance=0.2) is Outcome.REACHED
        assert first.state["x"] == pytest.approx(1.0, abs=0.02)


def test_robots_that_share_a_transform_tree_have_frames_of_their_own(tmp_path: Path) -> None:
    shared = {"localisation": {"by": "tf"}, "global_frame": "/map"}
    robots = {name: member(name, frame_prefix=f"{name}/", localisation=shared["localisation"]) for name in ("r1", "r2")}
    options = {name: {"namespace": name, "frame_prefix": f"{name}/", "transforms": True} for name in robots}
    remap = {f"/{name}/tf": "/tf" for name in robots}
    for robot in robots.values():
        robot["global_frame"] = shared["global_frame"]
    with (
        unicycle(**options["r1"], remap=remap) as first,
        unicycle(**options["r2"], remap=remap) as second,
        driver(robots["r1"], tmp_path) as one,
        driver(robots["r2"], tmp_path) as other,
    ):
        one.load(scene(), 0)
        other.load(scene(), 0)
        assert act(one, robots["r1"], "move_distance", distance=0.5) is Outcome.REACHED

        assert one.pose().translation_xyz[0] == pytest.approx(first.state["x"], abs=1e-3)
        assert other.pose().translation_xyz[0] == pytest.approx(second.state["x"], abs=1e-3)
        # A solution knows frames by the names of every robot of the fleet.
        seen = other.observe(["laser", "poses"])
        assert set(seen["poses"]) == {"base_link", "initial_pose", "camera", "lidar"}
        assert {pose["parent_frame"] for pose in seen["poses"].values()} == {"map"}


def test_a_namespace_without_a_robot_is_told_as_topics_without_a_publisher(tmp_path: Path) -> None:
    lost = member("r3", timing={"wait_s": 1.0})
    with unicycle(namespace="r1"), driver(lost, tmp_path) as platform, pytest.raises(BenchbotError) as failure:
        platform.load(scene(), 0)
    assert "/r3/odom: nobody publishes it." in failure.value.why


def test_a_declared_domain_is_where_the_robot_is_whatever_the_environment_says(
    domain: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with unicycle(namespace="r1") as there:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain - 1))
        here = member("r1", domain=domain)
        with driver(here, tmp_path) as platform:
            platform.load(scene(), 0)
            assert act(platform, here, "move_distance", distance=0.2) is Outcome.REACHED
        assert there.state["x"] == pytest.approx(0.2, abs=0.02)


def test_a_middleware_that_is_not_installed_is_refused_in_words(tmp_path: Path) -> None:
    with (
        driver(declaration(rmw="rmw_cyclonedds_cpp"), tmp_path) as platform,
        pytest.raises(BenchbotError, match="rmw_cyclonedds_cpp, which is not installed") as failure,
    ):
        platform.load(scene(), 0)
    assert "sudo apt install ros-jazzy-rmw-cyclonedds-cpp" in failure.value.fix
    assert ros.is_installed("rmw_fastrtps_cpp")


@pytest.fixture
def robots() -> Callable[[str], Ros2Robot]:
    """Returns what the driver reads of a robot, by its name."""
    catalog = Catalog(Plugins([info for info in installed() if info.distribution == "benchbot-robot-ros2"]))
    return lambda name: Ros2Robot.from_declaration(catalog.get("robots", name).data)


def test_published_robots_are_found_in_the_namespace_of_theirs_that_is_named(
    robots: Callable[[str], Ros2Robot],
) -> None:
    turtlebot, jackal = robots("turtlebot4@tb03"), robots("jackal@j100_0123")
    assert turtlebot.name == "turtlebot4@tb03"
    assert turtlebot.command.ros_topic == "/tb03/cmd_vel"
    assert turtlebot.graph.transforms == ("/tb03/tf", "/tb03/tf_static")
    assert turtlebot.graph.clock == "/clock"
    assert jackal.settings.odometry.ros_topic == "/j100_0123/platform/odom/filtered"
    assert robots("jackal").settings.odometry.ros_topic == "/j100_0000/platform/odom/filtered"
    assert robots("turtlebot4").graph.transforms == ("/tf", "/tf_static")
