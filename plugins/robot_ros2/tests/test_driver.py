import math
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.channels import OBSERVATIONS
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, Outcome, execute
from plugins.robot_ros2.tests.unicycle import BY_TRUTH, act, declaration, driver, scene, unicycle

pytestmark = pytest.mark.usefixtures("domain")

UNHURRIED = {"simulated": True, "motion_pace": 0.2}
"""A robot whose time passes slowly while it moves: what it hears late on a busy machine, it hears in time."""


def test_moves_end_where_they_should(tmp_path: Path) -> None:
    robot = declaration()
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        assert act(platform, robot, "move_distance", distance=1.0) is Outcome.REACHED
        assert there.state["x"] == pytest.approx(1.0, abs=0.01)
        assert act(platform, robot, "move_angle", angle=90) is Outcome.REACHED
        state = there.state
        assert math.degrees(state["yaw"]) == pytest.approx(90, abs=1.0)
        assert (state["v"], state["w"]) == (0.0, 0.0)
        assert platform.velocity == (0.0, 0.0)
        assert platform.pose().translation_xyz[:2] == pytest.approx((state["x"], state["y"]), abs=1e-6)


@pytest.mark.parametrize("simulated", [True, False])
def test_odometry_that_comes_late_neither_hunts_nor_overshoots(tmp_path: Path, *, simulated: bool) -> None:
    robot = declaration(use_sim_time=simulated)
    options = {
        "odometry_delay_s": 0.15,
        "twist_noise": 0.002,
        "simulated": simulated,
        "pace": 0.7 if simulated else 1.0,
    }
    with unicycle(**options) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        assert act(platform, robot, "move_angle", angle=-45) is Outcome.REACHED
        assert math.degrees(there.state["yaw"]) == pytest.approx(-45, abs=1.0)
        # A second and a half for turning and a little for being sure; hunting lasts until the time-out.
        assert platform.clock() < 10.0


def test_a_goal_a_centimetre_away_is_settled_at_without_swinging(tmp_path: Path) -> None:
    robot = declaration(use_sim_time=True)
    with (
        unicycle(odometry_delay_s=0.15, twist_noise=0.002, **UNHURRIED) as there,
        driver(robot, tmp_path) as platform,
    ):
        platform.load(scene(), 0)
        goal = Pose.planar(0.012, 0.004, -0.5)

        config = MotionConfig.from_robot(robot, "ground_truth")
        assert execute(platform, "move_next", {}, goal, config) is Outcome.REACHED
        state = there.state
        assert (state["x"], state["y"]) == pytest.approx((0.012, 0.004), abs=0.01)
        assert state["yaw"] == pytest.approx(-0.5, abs=0.03)
        # Half a radian is what is needed, and a little for turning to the goal: it swung by more than two.
        assert state["turned"] < 1.6


def test_an_observation_is_of_one_instant_after_the_call(tmp_path: Path) -> None:
    robot = declaration()
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(1, 0, 0, 0, 2.0, 1.0, 0.0), 0)
        act(platform, robot, "move_distance", distance=0.5)

        seen = platform.observe(["image_rgb", "image_rgb_info", "laser", "poses"])

        x = there.state["x"]
        assert seen["image_rgb"].shape == (6, 8, 3)
        assert seen["image_rgb"][0, 0, 0] == round(100 * x)
        assert seen["image_rgb_info"]["matrix_intrinsics"][0, 0] == 4.0
        ahead = seen["laser"]["scans"][np.abs(seen["laser"]["scans"][:, 1]).argmin()]
        assert ahead[0] == pytest.approx(5.0 - 0.05 - x, abs=1e-5)
        assert set(seen["poses"]) == {"base_link", "initial_pose", "camera", "lidar"}
        assert all(pose["parent_frame"] == "map" for pose in seen["poses"].values())
        assert seen["poses"]["initial_pose"]["translation_xyz"] == pytest.approx([2.0, 1.0, 0.0])
        assert seen["poses"]["base_link"]["translation_xyz"] == pytest.approx([2.0 + x, 1.0, 0.0], abs=1e-6)
        assert seen["poses"]["camera"]["translation_xyz"] == pytest.approx([2.1 + x, 1.0, 0.5], abs=1e-6)
        assert seen["poses"]["camera"]["rotation_rpy"] == pytest.approx(np.radians([-90, 0, -90]))


@pytest.mark.parametrize("delay_s", [0.0, 0.15])
def test_poses_are_those_of_the_picture_also_while_the_robot_moves(tmp_path: Path, delay_s: float) -> None:
    """They were those of the moment at which the observation was put together: 2 cm on at half a metre per second."""
    robot = declaration(use_sim_time=True)
    with unicycle(odometry_delay_s=delay_s, **UNHURRIED) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        platform.observe(["image_rgb", "poses"])
        while there.state["x"] < 0.3:
            platform.drive(0.5, 0.0, 0.1)
        seen = platform.observe(["image_rgb", "poses"])

    # The picture tells in centimetres where it was taken.
    there_m = seen["image_rgb"][0, 0, 0] / 100
    assert there_m > 0.2
    assert seen["poses"]["base_link"]["translation_xyz"][0] == pytest.approx(there_m, abs=0.01)


def test_it_stops_before_what_the_laser_sees(tmp_path: Path) -> None:
    robot = declaration(use_sim_time=True)
    robot["limits"]["linear_mps"] = [-0.5, 0.5]
    with unicycle(wall_x_m=0.9, **UNHURRIED) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        assert act(platform, robot, "move_distance", distance=3.0) is Outcome.BLOCKED
        assert not platform.collided
        # On a busy machine scans come late, and a robot that sees late stops earlier.
        assert 0.4 < there.state["x"] < 0.7

        assert act(platform, robot, "move_distance", distance=-0.3) is Outcome.REACHED


def test_it_stops_before_what_only_the_lidar_sees(tmp_path: Path) -> None:
    robot = declaration(use_sim_time=True, safety={"obstacles": ["laser", "lidar"]})
    with pytest.raises(BenchbotError, match="cannot see what is ahead") as failure, driver(robot, tmp_path):
        pass
    assert "connections.lidar and lidar.frame" in failure.value.why

    robot["limits"]["linear_mps"] = [-0.5, 0.5]
    robot["lidar"] = {"frame": "lidar"}
    points = {"ros_topic": "/points", "ros_type": "sensor_msgs/msg/PointCloud2"}
    robot["connections"]["lidar"] = {"connection": "ros_to_api", **points}
    with unicycle(lidar=True, low_wall_x_m=0.7, **UNHURRIED) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        assert act(platform, robot, "move_distance", distance=3.0) is Outcome.BLOCKED
        assert 0.3 < there.state["x"] < 0.5
        # Higher than what stands there.
        robot["footprint"] = {"radius_m": 0.2, "z_min_m": 0.6}
    with unicycle(lidar=True, low_wall_x_m=0.7, **UNHURRIED), driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        assert act(platform, robot, "move_distance", distance=0.8) is Outcome.REACHED


def test_a_robot_with_an_outline_comes_nearer_than_the_disc_that_holds_it(tmp_path: Path) -> None:
    robot = declaration(use_sim_time=True)
    robot["limits"]["linear_mps"] = [-0.5, 0.5]
    robot["footprint"] = {"radius_m": 0.7, "polygon": [[0.2, 0.2], [0.2, -0.2], [-0.6, -0.2], [-0.6, 0.2]]}
    with unicycle(wall_x_m=0.7, **UNHURRIED) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        assert act(platform, robot, "move_distance", distance=3.0) is Outcome.BLOCKED
        assert 0.3 < there.state["x"] < 0.5
        # Its tail would hit the wall.
        assert act(platform, robot, "move_angle", angle=180) is Outcome.BLOCKED
        assert abs(there.state["yaw"]) < 2.5


def test_a_scan_that_comes_seldom_is_waited_for_before_the_robot_moves(tmp_path: Path) -> None:
    robot = declaration(timing={"wait_s": 3.0, "feedback_timeout_s": 2.0})
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        there.set(silent=["/scan"])
        with pytest.raises(BenchbotError, match="nothing came on /scan"):
            platform.load(scene(), 0)
        there.set(silent=[])
        for _ in range(5):
            platform.load(scene(), 0)
            # Nothing was observed since.
            assert act(platform, robot, "move_distance", distance=0.02) is Outcome.REACHED


def test_contact_ends_the_action_and_a_load_forgets_it(tmp_path: Path) -> None:
    robot = declaration()
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        there.set(collides=True)

        assert act(platform, robot, "move_distance", distance=0.5) is Outcome.COLLIDED
        assert platform.collided

        there.set(collides=False)
        platform.load(scene(), 0)
        assert not platform.collided
        assert platform.clock() < 1.0
        assert act(platform, robot, "move_distance", distance=0.1) is Outcome.REACHED


def test_localisation_corrects_odometry_and_dead_reckoning_drifts(tmp_path: Path) -> None:
    robot = declaration(localisation=BY_TRUTH)
    with unicycle(odometry_scale=1.1) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        assert act(platform, robot, "move_distance", distance=1.0) is Outcome.REACHED
        x = there.state["x"]
        assert x == pytest.approx(1.0, abs=0.01)
        assert platform.pose().translation_xyz[0] == pytest.approx(x, abs=1e-3)
        assert platform.odometry().translation_xyz[0] == pytest.approx(1.1 * x, abs=1e-3)


def test_a_robot_that_is_not_at_its_start_does_not_begin(tmp_path: Path) -> None:
    with unicycle(off_start_m=0.3) as there, driver(declaration(localisation=BY_TRUTH), tmp_path) as platform:
        with pytest.raises(BenchbotError, match="not at the start pose") as failure:
            platform.load(scene(), 0)
        assert "0.30 m and 0.0°" in failure.value.why
        assert failure.value.failure is FailureClass.PLATFORM
        assert not failure.value.ends_run

        there.set(off_start_m=0.0)
        platform.load(scene(), 0)


def test_unknown_observations_are_refused_in_words(tmp_path: Path) -> None:
    with unicycle(), driver(declaration(), tmp_path) as platform:
        platform.load(scene(), 0)
        with pytest.raises(BenchbotError, match="no observation 'laserr'") as failure:
            platform.observe(["laserr"])
        assert "Did you mean 'laser'?" in failure.value.why
        with pytest.raises(BenchbotError, match="'unicycle' has no observation 'image_depth'"):
            platform.observe(["image_depth"])
    assert "image_depth" in OBSERVATIONS
    platform.close()


def test_declarations_that_cannot_work_are_refused_before_anything_is_started(tmp_path: Path) -> None:
    blind = declaration(safety={"obstacles": ["image_depth"]})
    with pytest.raises(BenchbotError, match="cannot see what is ahead") as failure, driver(blind, tmp_path):
        pass
    assert "connections.image_depth and connections.image_depth_info" in failure.value.why

    wrong = declaration()
    wrong["connections"]["laser"]["ros_type"] = "sensor_msgs/msg/Image"
    with pytest.raises(BenchbotError, match=r"wrong at 'connections\.laser'") as failure, driver(wrong, tmp_path):
        pass
    assert "sensor_msgs/msg/LaserScan, not sensor_msgs/msg/Image" in failure.value.why


AMCL = {
    "by": "topic",
    "ros_topic": "/amcl_pose",
    "ros_type": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "initial_pose": "/initialpose",
}


def test_amcl_is_told_where_each_scene_starts_before_the_robot_moves(tmp_path: Path) -> None:
    # AMCL is silent until it is told.
    with unicycle(amcl=True, amcl_off_m=None) as there, driver(declaration(localisation=AMCL), tmp_path) as platform:
        platform.load(scene(), 0)
        assert platform.pose().translation_xyz[0] == pytest.approx(0.0, abs=0.01)
        there.set(amcl_off_m=0.4)
        platform.load(scene(), 0)
        assert platform.pose().translation_xyz[0] == pytest.approx(0.0, abs=0.01)


def test_amcl_that_does_not_take_the_start_is_no_localisation(tmp_path: Path) -> None:
    robot = declaration(localisation=AMCL, timing={"wait_s": 4.0})
    with unicycle(amcl=True, amcl_off_m=0.4, amcl_is_deaf=True), driver(robot, tmp_path) as platform:
        with pytest.raises(BenchbotError, match="does not take its start pose") as failure:
            platform.load(scene(), 0)
        assert "told on /initialpose, and 4 s later it does not say" in failure.value.why
        assert failure.value.failure is FailureClass.PLATFORM

    robot = declaration(localisation={**AMCL, "initial_pose": "/initial"}, timing={"wait_s": 4.0})
    with (
        unicycle(amcl=True),
        driver(robot, tmp_path) as platform,
        pytest.raises(BenchbotError, match="In 4 s nobody subscribed to /initial"),
    ):
        platform.load(scene(), 0)
