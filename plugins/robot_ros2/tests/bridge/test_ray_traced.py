"""The ray-traced robot, bridged: what is published is what the ray tracer shows, to the byte."""

import operator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchbot.core import plugin_manager, resources
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import PlatformSpec
from benchbot_robot_ros2 import images
from benchbot_robot_ros2.bridge.robot import find_scene, topics
from benchbot_robot_ros2.encoders import encode
from benchbot_robot_ros2.messages import pose_of
from plugins.robot_ros2.tests.bridge.bridged import bridge, listener, time_of, until

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("renderer")]
CHANNELS = ("image_rgb", "image_depth", "image_segment", "image_depth_info")


@pytest.fixture
def cache(kernel_cache: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    return resources.cache_dir()


def test_carter_in_the_miniroom_publishes_what_the_ray_tracer_shows(domain: int, cache: Path) -> None:
    loaded = plugin_manager.load()
    catalog = Catalog(loaded)
    carter = catalog.get("robots", "carter_lowres").data
    with bridge("--robot", "carter_lowres", "--env", "miniroom:1") as process, listener() as robot:
        assert process.stderr
        assert "The robot carter_ros2 fits it: benchbot submit --robot carter_ros2" in process.stderr.readline()
        go = robot.velocities()
        until(lambda: go(0.3, 0.5) or robot.truth().yaw_rad > -1.3, "it has turned")
        until(lambda: not any(velocity(robot.newer("/odom", "nav_msgs/msg/Odometry"))), "it rests")
        truth = robot.newer("/ground_truth/odom", "nav_msgs/msg/Odometry")

        platform = loaded.record("simulators", "sim_taichi").create(PlatformSpec(carter, "ground_truth", cache))
        platform.load(find_scene(catalog, carter, "miniroom:1"), seed=0)
        platform.place(pose_of(truth.pose.pose))
        observed = platform.observe((*CHANNELS, "laser"))

        for channel in CHANNELS:
            parts = topics(channel)
            heard = {part: robot.hear(topic.ros_topic, topic.ros_type) for part, topic in parts.items()}
            stamped = parts.get("class_segment_img") or parts[""]
            stamp = time_of(robot.newer(stamped.ros_topic, stamped.ros_type, time_of(truth)))
            messages = encode(channel, observed[channel], stamp_ns=stamp, frame_id="camera_left")
            for part, message in messages.items():
                until(partial(operator.contains, heard[part], message), f"{channel} {part}")
        scan = robot.newer("/scan", "sensor_msgs/msg/LaserScan", time_of(truth))
        assert scan.header.frame_id == "lidar"
        assert np.allclose(scan.ranges, observed["laser"]["scans"][:, 0], atol=1e-4)
        platform.close()


def test_compressed_pictures_are_taken_for_who_subscribes_to_nothing_else(domain: int, cache: Path) -> None:
    with bridge("--robot", "carter_lowres", "--env", "miniroom:1"), listener() as robot:
        kind = "sensor_msgs/msg/CompressedImage"
        colour = robot.newer("/camera/color/image_raw/compressed", kind)
        depth = robot.newer("/camera/depth/image_raw/compressedDepth", kind)
        assert colour.header.frame_id == depth.header.frame_id == "camera_left"
        stamp = time_of(colour)
        raw = robot.newer("/camera/color/image_raw", "sensor_msgs/msg/Image", stamp)
        metres = robot.newer("/camera/depth/image_raw", "sensor_msgs/msg/Image", stamp)

    # The robot stands still: JPEG's errors are small, and depth's those of 16 bits.
    difference = images.rgb(colour).astype(int) - images.rgb(raw)
    assert np.abs(difference).mean() < 3
    seen, real = images.depth_m(depth), images.depth_m(metres)
    known = np.isfinite(real)
    assert np.array_equal(np.isfinite(seen), known)
    assert np.allclose(seen[known], real[known], rtol=2e-3)


def velocity(message: object) -> tuple[float, float]:
    twist = message.twist.twist  # type: ignore[attr-defined]
    return (twist.linear.x, twist.angular.z)
