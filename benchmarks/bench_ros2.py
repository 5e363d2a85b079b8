"""A robot over ROS 2 on this machine: rate and latency of 960x540 RGB-D, observation to action, and the 20 Hz loop.

python -m benchmarks.bench_ros2 [--json FILE]

The robot is a process that publishes pictures, a scan and odometry by the wall clock, and notes when velocities arrive.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, execute
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.declaration_keys import Topic
from benchbot_robot_ros2.driver import Ros2Driver
from benchbot_robot_ros2.encoders import encode
from benchbot_robot_ros2.messages import pose_message
from benchbot_robot_ros2.robot_clock import RobotClock
from benchbot_robot_ros2.streams import Stream

WIDTH, HEIGHT = 960, 540
PICTURE_HZ, ODOMETRY_HZ, SCAN_EVERY = 30, 50, 5
TRANSPORT_S = 8.0
STEPS = 12
HISTOGRAM_MS = (45, 48, 49, 50, 51, 52, 55, 60, 70, 100)
IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
MOVE = {"connection": "api_to_ros", "ros_topic": "/cmd_vel", "ros_type": "geometry_msgs/msg/Twist"}
ROBOT: dict[str, Any] = {
    "name": "bench",
    "type": "ros2",
    "global_frame": "map",
    "robot_frame": "base_link",
    "poses": ["base_link"],
    "frames": {"camera": {"xyz": [0, 0, 1], "rpy_deg": [-90, 0, -90]}, "lidar": {"xyz": [0, 0, 0.5]}},
    "camera": {"frame": "camera"},
    "laser": {"frame": "lidar"},
    "footprint": {"radius_m": 0.2},
    "stops_before_contact": True,
    "connections": {
        "image_rgb": {"connection": "ros_to_api", "ros_topic": "/rgb", "ros_type": IMAGE},
        "image_depth": {"connection": "ros_to_api", "ros_topic": "/depth", "ros_type": IMAGE},
        "laser": {"connection": "ros_to_api", "ros_topic": "/scan", "ros_type": "sensor_msgs/msg/LaserScan"},
        "poses": {"connection": "ros_to_api"},
        "move_distance": MOVE,
        "move_angle": MOVE,
    },
    "driver": {
        "odometry": {"ros_topic": "/odom", "ros_type": "nav_msgs/msg/Odometry"},
        "return_to_start": {"by": "service", "ros_service": "/reset"},
    },
}
SCENE = Scene({"name": "bench", "variant": 1, "type": "real", "start_pose": [1, 0, 0, 0, 0, 0, 0]}, Path())


def be_a_robot(reliability: str) -> None:
    """Publish and obey until the standard input ends; then print when velocities arrived, in seconds of the epoch."""
    with ros.running_node("bench_robot") as node:
        robot = BenchRobot(node, reliability)
        timers = [
            node.create_timer(1 / PICTURE_HZ, robot.publish_pictures),
            node.create_timer(1 / ODOMETRY_HZ, robot.publish_feedback),
        ]
        print("ready", flush=True)
        sys.stdin.read()
        for timer in timers:
            timer.cancel()
    print(json.dumps({"arrivals": robot.arrivals, "pictures": robot.pictures}), flush=True)


class BenchRobot:
    """A unicycle that obeys at once, with a camera that sees noise."""

    def __init__(self, node: Any, reliability: str) -> None:
        from geometry_msgs.msg import Twist
        from nav_msgs.msg import Odometry
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from sensor_msgs.msg import Image, LaserScan
        from std_srvs.srv import Trigger

        profile = QoSProfile(depth=5, reliability=ReliabilityPolicy[reliability.upper()])
        self.arrivals: list[tuple[float, float, float]] = []
        self.pictures = 0
        self._node, self._odometry_type = node, Odometry
        self._publishers = {
            topic: node.create_publisher(kind, topic, profile)
            for topic, kind in {"/rgb": Image, "/depth": Image, "/scan": LaserScan, "/odom": Odometry}.items()
        }
        node.create_subscription(Twist, "/cmd_vel", self._on_command, 10)
        node.create_service(Trigger, "/reset", self._on_reset)
        random = np.random.default_rng(0)
        self._rgb = random.integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)
        self._depth = random.random((HEIGHT, WIDTH), dtype=np.float32)
        angles = np.linspace(-math.pi, math.pi, 900, endpoint=False)
        self._scan = {"scans": np.stack([np.full(900, 5.0), angles], 1), "range_min": 0.1, "range_max": 20.0}
        self._x = self._yaw = 0.0
        self._command = (0.0, 0.0)
        self._ticks = 0

    def publish_pictures(self) -> None:
        stamp_ns = time.time_ns()
        self.pictures += 1
        self._send("/rgb", encode("image_rgb", self._rgb, stamp_ns=stamp_ns, frame_id="camera")[""])
        self._send("/depth", encode("image_depth", self._depth, stamp_ns=stamp_ns, frame_id="camera")[""])

    def publish_feedback(self) -> None:
        linear, angular = self._command
        self._x += linear / ODOMETRY_HZ
        self._yaw += angular / ODOMETRY_HZ
        self._ticks += 1
        stamp_ns = time.time_ns()
        odometry = self._odometry_type(child_frame_id="base_link")
        odometry.header.frame_id = "odom"
        odometry.header.stamp.sec, odometry.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
        odometry.pose.pose = pose_message(Pose.planar(self._x, 0.0, self._yaw))
        odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = linear, angular
        self._send("/odom", odometry)
        if self._ticks % SCAN_EVERY == 0:
            self._send("/scan", encode("laser", self._scan, stamp_ns=stamp_ns, frame_id="lidar")[""])

    def _send(self, topic: str, message: Any) -> None:
        self._publishers[topic].publish(message)

    def _on_command(self, message: Any) -> None:
        self._command = (message.linear.x, message.angular.z)
        self.arrivals.append((time.time(), *self._command))

    def _on_reset(self, _request: Any, response: Any) -> Any:
        self._x = self._yaw = 0.0
        response.success = True
        return response


@contextmanager
def robot(reliability: str, report: dict[str, Any]) -> Iterator[None]:
    """Run the robot in another process; its report is there on leaving."""
    words = [sys.executable, "-m", "benchmarks.bench_ros2", "--be-a-robot", reliability]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout
            process.stdout.readline()
            yield
            report.update(json.loads(process.communicate("")[0]))
        finally:
            process.kill()


def transport(reliability: str) -> dict[str, float]:
    """Subscribe to colour and depth as the driver does; return rate (Hz) and latency (ms) of pairs."""
    report: dict[str, Any] = {}
    latency_ms: dict[str, list[float]] = {"/rgb": [], "/depth": []}
    changed = threading.Condition()
    with robot(reliability, report), ros.running_node("bench_driver") as node:
        clock = RobotClock(node, simulated=False, changed=changed)
        streams = [Stream(node, Topic(ros_topic=topic, ros_type=IMAGE), clock, changed) for topic in latency_ms]
        seen = dict.fromkeys(latency_ms, 0)
        end_s = time.monotonic() + TRANSPORT_S
        while time.monotonic() < end_s:
            with changed:
                changed.wait(0.1)
            for stream in streams:
                for sample in stream.samples:
                    if sample.stamp_ns > seen[stream.topic.ros_topic]:
                        seen[stream.topic.ros_topic] = sample.stamp_ns
                        latency_ms[stream.topic.ros_topic].append(sample.skew_s * 1e3)
        clock.close()
    both = np.concatenate(list(latency_ms.values()))
    received = min(len(values) for values in latency_ms.values())
    return {
        "received_hz": received / TRANSPORT_S,
        "latency_p50_ms": float(np.percentile(both, 50)),
        "latency_p99_ms": float(np.percentile(both, 99)),
    }


def control() -> dict[str, Any]:
    """Drive the robot back and forth; return observation to action, and the periods of the 20 Hz loop."""
    report: dict[str, Any] = {}
    stamps_s: list[float] = []
    ticks_s: list[float] = []
    observe_ms: list[float] = []
    channels = ["image_rgb", "image_depth", "laser", "poses"]
    with robot("best_effort", report):
        driver = TimedDriver(PlatformSpec(ROBOT, "ground_truth", Path()), ticks_s)
        motion = MotionConfig.from_robot(ROBOT, "ground_truth")
        driver.load(SCENE, 0)
        driver.observe(channels)
        for step in range(STEPS):
            asked_s = time.time()
            driver.observe(channels)
            stamps_s.append(time.time())
            observe_ms.append((stamps_s[-1] - asked_s) * 1e3)
            execute(driver, "move_angle", {"angle": 30.0 if step % 2 else -30.0}, None, motion)
        driver.close()
    arrivals = np.array(report["arrivals"])
    first_ms = []
    for stamp_s in stamps_s:
        later = arrivals[(arrivals[:, 0] > stamp_s) & (np.abs(arrivals[:, 2]) > 0)]
        first_ms.append((later[0, 0] - stamp_s) * 1e3)
    periods_ms = np.diff(ticks_s) * 1e3
    periods_ms = periods_ms[periods_ms < 500]  # between actions nothing is driven
    return {
        "observe_ms": observe_ms,
        "action_ms": first_ms,
        "period_ms": periods_ms.tolist(),
    }


class TimedDriver(Ros2Driver):
    """A driver that notes when each tick of its control loop ends."""

    def __init__(self, spec: PlatformSpec, ticks_s: list[float]) -> None:
        super().__init__(spec)
        self._ticks_s = ticks_s

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        super().drive(linear_mps, angular_radps, duration_s)
        self._ticks_s.append(time.monotonic())


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file")
    parser.add_argument("--be-a-robot", metavar="RELIABILITY", help=argparse.SUPPRESS)
    options = parser.parse_args()
    # Loopback only, and a domain of its own.
    os.environ |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": "99"}
    if options.be_a_robot:
        be_a_robot(options.be_a_robot)
        return
    figures: dict[str, Any] = {"transport": {}, "control": {}}
    print(f"{WIDTH}x{HEIGHT} colour and depth at {PICTURE_HZ} Hz    {'received':>10} {'p50':>10} {'p99':>10}")
    for reliability in ("best_effort", "reliable"):
        row = figures["transport"][reliability] = transport(reliability)
        print(
            f"  {reliability:34} {row['received_hz']:7.1f} Hz {row['latency_p50_ms']:7.1f} ms "
            f"{row['latency_p99_ms']:7.1f} ms"
        )
    figures["control"] = control()
    show(figures["control"])
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def show(figures: dict[str, Any]) -> None:
    for name, label in (
        ("observe_ms", "from asking to an observation"),
        ("action_ms", "from an observation to the robot's first velocity"),
    ):
        print(f"{label:50} {np.percentile(figures[name], 50):7.1f} ms, 99 % {np.percentile(figures[name], 99):7.1f} ms")
    periods_ms = np.array(figures["period_ms"])
    print(f"control loop at 20 Hz, {len(periods_ms)} ticks: worst {np.abs(periods_ms - 50).max():.1f} ms off")
    counts, edges = np.histogram(periods_ms, bins=[0, *HISTOGRAM_MS, math.inf])
    for count, low, high in zip(counts, edges[:-1], edges[1:], strict=True):
        if count:
            print(f"  {low:5.0f} to {high:5.0f} ms {count:5d} {'#' * math.ceil(50 * count / counts.max())}")


if __name__ == "__main__":
    main()
