"""Bags of ROS 2, written by rosbags, with the topics of a declared robot."""

import io
import json
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image as Picture
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from benchbot_record_mcap.bag import TYPES
from plugins.replay.tests.conftest import Kept, Lab

Message = tuple[str, int, Any]
PICTURES = ("image_rgb", "image_depth", "image_segment")
IMAGE = "/camera/color/image_raw"
HERE = ("--robot", "sample_twin", "--task", "sample:passive", "--env", "arena:1")


@pytest.fixture
def ros_lab(lab: Lab) -> Lab:
    """A lab with the sample robot's twin behind ROS 2."""
    lab.cli.variables["BENCHBOT_PLUGINS"] += ",benchbot-robot-ros2"
    carter = yaml.safe_load((files("benchbot_robot_ros2") / "robots" / "carter_ros2.yaml").read_text())
    lab.make_robot(
        {
            **carter,
            "name": "sample_twin",
            "runs_in": ["sim_sample"],
            "poses": ["base_link", "initial_pose", "camera", "lidar"],
            "frames": {"camera": {"xyz": [0, 0, 0.5], "rpy_deg": [-90, 0, -90]}, "lidar": {"xyz": [0, 0, 0]}},
            "camera": {"frame": "camera"},
        }
    )
    return lab


def bag_of(
    recording: Path,
    target: Path,
    storage: StoragePlugin = StoragePlugin.MCAP,
    change: Callable[[Message], Message | None] = lambda message: message,
) -> Path:
    """Write what a robot would publish of a recording as rosbags does, each message changed or left out (None)."""
    with Reader(recording) as reader, Writer(target, version=9, storage_plugin=storage) as writer:
        connections: dict[str, Any] = {}
        for connection, logged_ns, data in reader.messages():
            if connection.topic.startswith("/benchbot"):
                continue
            changed = change((connection.topic, logged_ns, TYPES.deserialize_cdr(data, connection.msgtype)))
            if changed is None:
                continue
            topic, time_ns, message = changed
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=TYPES)
            writer.write(connections[topic], time_ns, bytes(TYPES.serialize_cdr(message, kind)))
    return target


def channels(kept: Kept, *names: str) -> list[list[Any]]:
    return [[value for name, value in step if name in names] for step in kept.result["seen"]]


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP], ids=["sqlite3", "mcap"])
def test_a_bag_shows_what_its_robot_saw(ros_lab: Lab, driven: Kept, storage: StoragePlugin) -> None:
    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag", storage)
    replayed = ros_lab.replay("replayed", bag, *HERE)

    assert channels(replayed, *PICTURES) == channels(driven, *PICTURES)
    assert [name for name, _ in replayed.result["seen"][0]] == [name for name, _ in driven.result["seen"][0]]
    for one, other in zip(replayed.result["track"][0]["rows"], driven_rows(driven), strict=True):
        np.testing.assert_allclose(one[2:], other[2:], atol=1e-5)
    said = replayed.provenance["replay"]["arena:1"]
    assert (said["from"], said["robot"]) == ("bag", "sample_twin")
    assert said["bag_sha256"] != said["sha256"]
    assert replayed.provenance["steps"] == driven.provenance["steps"]


def driven_rows(driven: Kept) -> list[list[Any]]:
    return [row for row in driven.result["track"][0]["rows"] if row[0] is not None]


def test_a_bag_that_nothing_is_said_of_is_told_how(ros_lab: Lab, driven: Kept) -> None:
    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag")
    done = ros_lab("replay", str(bag), "--native", "true")
    assert done.returncode == 2
    assert "It says nothing of its run" in done.stderr
    assert "--robot NAME --task TASK --env ENVIRONMENT" in done.stderr
    done = ros_lab("replay", str(bag), "--robot", "sample_twin", "--native", "true")
    assert "It is not said of what the bag is" in done.stderr


def test_a_missing_topic_and_one_of_another_type_are_named(ros_lab: Lab, driven: Kept) -> None:
    without = bag_of(
        driven.recording, ros_lab.cli.folder / "without", change=lambda one: None if one[0] == "/scan" else one
    )
    done = ros_lab("replay", str(without), *HERE, "--native", "true")
    assert done.returncode == 2
    assert "declares topics that it does not have: /scan" in done.stderr

    other = bag_of(
        driven.recording,
        ros_lab.cli.folder / "other",
        change=lambda one: None if one[0] == "/scan" else ("/scan", *one[1:]) if one[0] == "/tf" else one,
    )
    done = ros_lab("replay", str(other), *HERE, "--native", "true")
    assert done.returncode == 2
    assert "/scan is of the type tf2_msgs/msg/TFMessage" in done.stderr


def test_a_bag_without_a_pose_is_refused(ros_lab: Lab, driven: Kept) -> None:
    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag", change=lambda one: None if one[0] == "/tf" else one)
    done = ros_lab("replay", str(bag), *HERE, "--native", "true")
    assert done.returncode == 2
    assert "Nothing in it says where the robot is: it has neither /ground_truth/odom" in done.stderr


def test_instants_without_a_pose_are_counted(ros_lab: Lab, driven: Kept) -> None:
    times: list[int] = []

    def keep(message: Message) -> Message | None:
        times.append(message[1])
        return None if message[0] == "/tf" and message[1] == times[0] else message

    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag", change=keep)
    replayed = ros_lab.replay("replayed", bag, *HERE)
    assert "Warning: 1 instants are left out" in replayed.said
    assert replayed.provenance["steps"] == driven.provenance["steps"] - 1


def test_a_bag_that_begins_elsewhere_is_warned_of(ros_lab: Lab, driven: Kept) -> None:
    def shifted(message: Message) -> Message:
        if message[0] == "/tf":
            for one in message[2].transforms:
                one.transform.translation.x += 3.0
        return message

    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag", change=shifted)
    replayed = ros_lab.replay("replayed", bag, *HERE)
    assert "It begins 3.00 m and 0° away from the start of arena:1" in replayed.said


def test_steps_may_be_thinned(ros_lab: Lab, driven: Kept) -> None:
    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag")
    stamps = sorted({time_ns for topic, time_ns, _ in messages(bag) if topic == IMAGE})
    every_s = (stamps[-1] - stamps[0]) / 1e9
    replayed = ros_lab.replay("replayed", bag, *HERE, "--every", f"{every_s:.9f}")
    assert replayed.provenance["frames"] == 2
    assert channels(replayed, *PICTURES) == [channels(driven, *PICTURES)[0]]


def messages(bag: Path) -> list[Message]:
    with Reader(bag) as reader:
        return [
            (connection.topic, time_ns, TYPES.deserialize_cdr(data, connection.msgtype))
            for connection, time_ns, data in reader.messages()
        ]


def test_pictures_that_were_compressed_with_loss_are_said(ros_lab: Lab, driven: Kept) -> None:
    compressed = TYPES.types["sensor_msgs/msg/CompressedImage"]

    def as_jpeg(message: Message) -> Message:
        topic, time_ns, image = message
        if topic != IMAGE:
            return message
        pixels = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.width, 3)
        buffer = io.BytesIO()
        Picture.fromarray(pixels).save(buffer, "JPEG")
        data = np.frombuffer(buffer.getvalue(), np.uint8)
        return topic, time_ns, compressed(image.header, "rgb8; jpeg compressed bgr8", data)

    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag", change=as_jpeg)
    robot = ros_lab.robot("sample_twin")
    robot["name"] = "sample_jpeg"
    robot["connections"]["image_rgb"]["ros_type"] = "sensor_msgs/msg/CompressedImage"
    ros_lab.make_robot(robot)

    replayed = ros_lab.replay("replayed", bag, "--robot", "sample_jpeg", *HERE[2:])
    assert "Warning: not what the sensor gave, but compressed with loss: image_rgb" in replayed.said
    assert replayed.provenance["replay"]["arena:1"]["lossy"] == ["image_rgb"]
    assert channels(replayed, "image_depth") == channels(driven, "image_depth")


@pytest.mark.parametrize("name", ["bag.db3", "metadata.yaml"])
def test_a_damaged_bag_is_refused(ros_lab: Lab, driven: Kept, name: str) -> None:
    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag", StoragePlugin.SQLITE3)
    data = (bag / name).read_bytes()
    (bag / name).write_bytes(data[: len(data) // 3])
    done = ros_lab("replay", str(bag), *HERE, "--native", "true")
    assert done.returncode == 2, done.stderr
    assert "cannot be replayed" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_task_that_chooses_where_to_drive_cannot_be_run_on_a_bag(ros_lab: Lab, driven: Kept) -> None:
    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag")
    words = ["--robot", "sample_twin", "--task", "sample:active", "--env", "arena:1", "--native", "true"]
    done = ros_lab("replay", str(bag), *words)
    assert done.returncode == 2
    assert "cannot be run on a bag" in done.stderr


def test_a_recording_of_a_replayed_bag_needs_no_ros(ros_lab: Lab, driven: Kept) -> None:
    bag = bag_of(driven.recording, ros_lab.cli.folder / "bag")
    replayed = ros_lab.replay("replayed", bag, *HERE, "--record", "mcap")
    ros_lab.forget()
    again = ros_lab.replay("again", replayed.recording)

    assert again.result["seen"] == replayed.result["seen"]
    assert json.dumps(again.provenance["replay"]).count('"from": "bag"') == 1
