"""A ROS 2 node as stock software is one: a process of its own that imports nothing of BenchBot.

    python stock_node.py SECONDS < SUBSCRIPTIONS.json > COMPLAINTS.json

It subscribes to each topic as its software does, publishes no more than a velocity (a Twist on /cmd_vel), and says of
each subscription what its software would stumble over: nothing at best.
"""

import importlib
import json
import math
import os
import sys
import time
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

# ROS 2 from PyPI finds its libraries there.
os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)
os.environ.setdefault("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

Messages = list[Any]
BAD_COVARIANCE = 9999  # rtabmap_slam/src/CoreWrapper.cpp
LEAST_VARIANCE = 1e-9  # robot_localization/src/ekf.cpp
WARM_UP = 3


class Heard:
    """All messages by topic, and the tree of the transforms among them."""

    def __init__(self, topics: dict[str, Messages]) -> None:
        self.topics = topics
        self.parents: dict[str, set[str]] = {}
        self.moving: dict[tuple[str, str], list[float]] = {}
        for topic in ("/tf", "/tf_static"):
            for message in topics.get(topic, ()):
                for transform in message.transforms:
                    link = (transform.header.frame_id, transform.child_frame_id)
                    self.parents.setdefault(link[1], set()).add(link[0])
                    if topic == "/tf":
                        self.moving.setdefault(link, []).append(seconds(transform.header.stamp))

    def complaints_of_frame(self, frame: str, stamp_s: float) -> list[str]:
        """Say what keeps tf2 from knowing where a frame is in the map at a time."""
        way = frame
        for _ in range(20):
            parents = self.parents.get(way, set())
            if len(parents) != 1:
                return [] if way == "map" else [f"{frame} leads to {way}, which has the parents {sorted(parents)}"]
            (parent,) = parents
            stamps = self.moving.get((parent, way))
            if stamps is not None and not min(stamps) <= stamp_s <= max(stamps):
                return [f"{way} in {parent} is not known at {stamp_s:.2f} s"]
            way = parent
        return [f"{frame} goes round in circles"]


def seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec / 1e9)


def rate_hz(stamps_s: list[float]) -> float:
    return 1 / float(np.median(np.diff(stamps_s)))


def positive(covariance: Any, size: int) -> list[str]:
    matrix = np.array(covariance, float).reshape(size, size)
    least = float(np.linalg.eigvalsh(matrix).min()) if np.allclose(matrix, matrix.T) else -math.inf
    complaints = [] if least > 0 else [f"a covariance is not positive definite: {matrix.tolist()}"]
    diagonal = np.diag(matrix)
    # What is computed is not exactly the smallest number.
    if diagonal.min() < 0.99 * LEAST_VARIANCE or diagonal.max() >= BAD_COVARIANCE:
        complaints.append(f"variances {diagonal.tolist()}")
    return complaints


def stamped(heard: Heard, messages: Messages, rate: tuple[float, float] | None = None) -> list[str]:
    """Check the frames and the rate of messages with headers; the newest transforms may still be under way.

    Each topic is discovered by itself: tf2 drops what is older than the first transforms that it hears.
    """
    complaints = []
    known_s = max((min(stamps_s) for stamps_s in heard.moving.values()), default=-math.inf)
    settled = [m for m in messages if seconds(m.header.stamp) < seconds(heard.topics["/odom"][-1].header.stamp) - 0.2]
    settled = [message for message in settled if seconds(message.header.stamp) >= known_s]
    for message in settled[WARM_UP:]:
        complaints += heard.complaints_of_frame(message.header.frame_id, seconds(message.header.stamp))
    if len(settled) <= WARM_UP + 1:
        complaints.append(f"only {len(messages)} messages")
    elif rate and not rate[0] <= (found := rate_hz([seconds(m.header.stamp) for m in messages])) <= rate[1]:
        complaints.append(f"{found:.1f} messages a second")
    return complaints


def scan(heard: Heard, messages: Messages) -> list[str]:
    complaints = stamped(heard, messages, (9, 11))
    for message in messages:
        angles = (message.angle_max - message.angle_min) / message.angle_increment
        ranges = np.array(message.ranges)
        seen = ranges[np.isfinite(ranges)]
        facts = {
            "as many ranges as angles": round(angles) + 1 == len(ranges),
            "some ranges": len(seen) > 0.5 * len(ranges),
            "ranges within its limits": 0 < message.range_min <= seen.min() and seen.max() <= message.range_max,
            "all beams at once": message.time_increment == 0,
            "scan_time": abs(message.scan_time - 0.1) < 1e-6,
        }
        complaints += [f"not so: {name}" for name, is_so in facts.items() if not is_so]
    return complaints


def occupancy(heard: Heard, messages: Messages) -> list[str]:
    grid = messages[-1]
    cells = np.array(grid.data, np.int8).reshape(grid.info.height, grid.info.width)
    starts = [t.transform.translation for t in heard.topics["/tf"][0].transforms if t.child_frame_id == "odom"]
    if not starts:
        return ["the place of odom in the map is not known"]
    column = int((starts[0].x - grid.info.origin.position.x) / grid.info.resolution)
    row = int((starts[0].y - grid.info.origin.position.y) / grid.info.resolution)
    facts = {
        "in the frame map": grid.header.frame_id == "map",
        "a resolution": 0.01 <= grid.info.resolution <= 0.1,
        "a rotation": abs(grid.info.origin.orientation.w) == 1,
        "known values": set(np.unique(cells)) == {-1, 0, 100},
        "the robot stands where it is free": cells[row, column] == 0,
    }
    # A ray of the laser ends where the map is occupied.
    scanned = heard.topics["/scan"][0]
    return [f"not so: {name}" for name, is_so in facts.items() if not is_so] + (
        [] if hits(heard, scanned, grid, cells) > 0.6 else ["the scan does not fit to the map"]
    )


def hits(heard: Heard, scanned: Any, grid: Any, cells: Any) -> float:
    """Return the share of the laser's ranges that end within two cells of what the map has there."""
    x, y, yaw = 0.0, 0.0, 0.0
    stamp = seconds(scanned.header.stamp)
    at = min(heard.topics["/tf"], key=lambda m: abs(seconds(m.transforms[0].header.stamp) - stamp))
    chain = {t.child_frame_id: t for m in heard.topics["/tf_static"] for t in m.transforms}
    chain |= {t.child_frame_id: t for t in at.transforms}
    frame = scanned.header.frame_id
    while frame != "map":
        transform = chain[frame]
        move, turn = transform.transform.translation, transform.transform.rotation
        angle = 2 * math.atan2(turn.z, turn.w)
        x, y = (
            move.x + x * math.cos(angle) - y * math.sin(angle),
            move.y + x * math.sin(angle) + y * math.cos(angle),
        )
        yaw += angle
        frame = transform.header.frame_id
    ranges = np.array(scanned.ranges)
    angles = yaw + scanned.angle_min + scanned.angle_increment * np.arange(len(ranges))
    finite = np.isfinite(ranges)
    xs, ys = x + (ranges * np.cos(angles))[finite], y + (ranges * np.sin(angles))[finite]
    columns = ((xs - grid.info.origin.position.x) / grid.info.resolution).astype(int)
    rows = ((ys - grid.info.origin.position.y) / grid.info.resolution).astype(int)
    near = [
        (cells[max(0, r - 2) : r + 3, max(0, c - 2) : c + 3] == 100).any() for r, c in zip(rows, columns, strict=True)
    ]
    return float(np.mean(near))


def cloud(heard: Heard, messages: Messages) -> list[str]:
    complaints = stamped(heard, messages)
    for message in messages:
        fields = {field.name: (field.datatype, field.count) for field in message.fields}
        if any(fields.get(axis) != (7, 1) for axis in "xyz"):
            complaints.append(f"its fields are {fields}")
        if len(message.data) != message.row_step * message.height:
            complaints.append("its data are cut off")
    return complaints


def odometry(heard: Heard, messages: Messages) -> list[str]:
    complaints = stamped(heard, messages, (19, 21))
    for message in messages:
        if (message.header.frame_id, message.child_frame_id) != ("odom", "base_link"):
            complaints.append(f"from {message.header.frame_id} to {message.child_frame_id}")
        complaints += positive(message.pose.covariance, 6) + positive(message.twist.covariance, 6)
    # It has driven, and odometry says so, ever less certain.
    if not (messages[-1].pose.covariance[0] > messages[0].pose.covariance[0] and messages[-1].pose.pose.position.x > 0):
        complaints.append("it has not driven, or is as certain as before")
    return complaints


def colour(heard: Heard, messages: Messages) -> list[str]:
    complaints = stamped(heard, messages, (0.2, 5.1))
    depths = {seconds(m.header.stamp) for m in heard.topics["/camera/depth/image_raw"]}
    if len([m for m in messages if seconds(m.header.stamp) in depths]) < len(messages) - 2:
        complaints.append("depth has other stamps")
    return complaints + [f"encoding {m.encoding}" for m in messages if m.encoding != "rgb8"]


def depth(heard: Heard, messages: Messages) -> list[str]:
    colours = heard.topics["/camera/color/image_raw"][-1]
    complaints = stamped(heard, messages, (0.2, 5.1))
    for message in messages:
        if (message.encoding, message.width, message.height) != ("32FC1", colours.width, colours.height):
            complaints.append(f"{message.encoding} {message.width} x {message.height}")
        metres = np.frombuffer(bytes(message.data), np.float32)
        if not 0 < np.nanmedian(metres[np.isfinite(metres)]) < 20:
            complaints.append("no metres")
    return complaints


def camera_model(heard: Heard, messages: Messages) -> list[str]:
    complaints = stamped(heard, messages, (0.2, 5.1))
    pictures = {seconds(m.header.stamp): m for m in heard.topics["/camera/color/image_raw"]}
    for message in messages:
        picture = pictures.get(seconds(message.header.stamp))
        k, p = np.reshape(message.k, (3, 3)), np.reshape(message.p, (3, 4))
        facts = {
            "plumb_bob of five": message.distortion_model == "plumb_bob" and len(message.d) == 5,
            "a pinhole": k[0, 0] > 0 and k[2, 2] == 1 and np.array_equal(p[:, :3], k) and not p[:, 3].any(),
            "no rotation": np.array_equal(np.reshape(message.r, (3, 3)), np.eye(3)),
            "the picture's size": picture is None or (picture.width, picture.height) == (message.width, message.height),
            "the picture's frame": picture is None or picture.header.frame_id == message.header.frame_id,
        }
        complaints += [f"not so: {name}" for name, is_so in facts.items() if not is_so]
    return complaints


def inertia(heard: Heard, messages: Messages) -> list[str]:
    complaints = stamped(heard, messages, (19, 21))
    for message in messages:
        if message.orientation_covariance[0] != -1:
            complaints.append("it claims an orientation")
        complaints += positive(message.angular_velocity_covariance, 3)
        complaints += positive(message.linear_acceleration_covariance, 3)
        if abs(message.linear_acceleration.z - 9.80665) > 0.1:
            complaints.append(f"gravity is {message.linear_acceleration.z}")
    return complaints


def transforms(heard: Heard, messages: Messages) -> list[str]:
    frames = {*heard.parents, *(parent for parents in heard.parents.values() for parent in parents)}
    roots = frames - heard.parents.keys()
    complaints = [] if roots == {"map"} else [f"the tree has the roots {sorted(roots)}"]
    complaints += [f"{child} has {len(them)} parents" for child, them in heard.parents.items() if len(them) != 1]
    expected = {"odom": {"map"}, "base_link": {"odom"}, "base_footprint": {"base_link"}}
    complaints += [
        f"the parent of {child} is another" for child in expected if heard.parents.get(child) != expected[child]
    ]
    used = {m.header.frame_id for topic in ("/scan", "/camera/color/image_raw") for m in heard.topics[topic]}
    return complaints + [f"{frame} is not in the tree" for frame in used - frames]


def description(heard: Heard, messages: Messages) -> list[str]:
    root = ET.fromstring(messages[-1].data)
    links = {link.get("name") for link in root.findall("link")}
    children = [joint.find("child").get("link") for joint in root.findall("joint")]  # type: ignore[union-attr]
    complaints = [] if len(messages) == 1 and root.tag == "robot" else ["no single URDF"]
    complaints += [] if len(set(children)) == len(children) == len(links) - 1 else ["no tree of links"]
    return complaints + [f"the link {link} is no frame" for link in links - heard.parents.keys()]


def clock(heard: Heard, messages: Messages) -> list[str]:
    stamps = [seconds(message.clock) for message in messages]
    complaints = [] if stamps == sorted(set(stamps)) else ["time goes back"]
    return complaints + ([] if 19 <= rate_hz(stamps) <= 21 else [f"{rate_hz(stamps):.1f} ticks a second"])


CHECKS: dict[str, Callable[[Heard, Messages], list[str]]] = {
    "scan": scan,
    "map": occupancy,
    "cloud": cloud,
    "odometry": odometry,
    "colour": colour,
    "depth": depth,
    "camera model": camera_model,
    "inertia": inertia,
    "transforms": transforms,
    "description": description,
    "clock": clock,
}


def profile(qos: str) -> QoSProfile:
    return QoSProfile(
        depth=100,
        reliability=ReliabilityPolicy.BEST_EFFORT if "best effort" in qos else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if "transient" in qos else DurabilityPolicy.VOLATILE,
    )


def message_type(name: str) -> Any:
    package, _, message = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), message)


def main() -> None:
    subscriptions = json.load(sys.stdin)
    rclpy.init()
    node = rclpy.create_node("stock_software")
    heard: list[Messages] = []
    for item in subscriptions:
        heard.append([])
        node.create_subscription(message_type(item["ros_type"]), item["topic"], heard[-1].append, profile(item["qos"]))
    twist = message_type("geometry_msgs/msg/Twist")()
    twist.linear.x, twist.angular.z = 0.1, 0.2
    drive = node.create_publisher(type(twist), "/cmd_vel", 1)
    least = float(sys.argv[1])
    deadline_s = time.monotonic() + 20 * least
    # Until the slowest has come often enough, and all for a while.
    began_s = time.monotonic()
    once = {"map", "description", "transforms"}
    while time.monotonic() < deadline_s and (
        time.monotonic() < began_s + least
        or any(
            len(messages) < (1 if item["check"] in once else 12)
            for item, messages in zip(subscriptions, heard, strict=True)
        )
    ):
        rclpy.spin_once(node, timeout_sec=0.05)
        drive.publish(twist)
    silent = [item for item, messages in zip(subscriptions, heard, strict=True) if not messages]
    complaints = {f"{item['software']} {item['topic']}": ["it hears nothing"] for item in silent}
    if not silent:
        topics = {item["topic"]: messages for item, messages in zip(subscriptions, heard, strict=True)}
        everything = Heard(topics)
        for item, messages in zip(subscriptions, heard, strict=True):
            found = CHECKS[item["check"]](everything, messages)
            complaints[f"{item['software']} {item['topic']}"] = sorted(set(found))[:5]
    json.dump({"complaints": complaints, "clocks": node.count_publishers("/clock")}, sys.stdout)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
