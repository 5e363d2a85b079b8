import itertools
import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Unpack

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from benchbot.core import plugin_manager
from benchbot.core.channels import Observations
from benchbot.core.errors import BenchbotError
from benchbot.core.light_records import Recorder
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.core.recording import Recording
from benchbot_record_mcap.recording import EPISODE_START_NS
from plugins.record_mcap.tests.bags import Bag, by_mcap, by_rosbags, sample_session, steps_to_the_end

readers = pytest.mark.parametrize("read", [by_rosbags, by_mcap])

CAMERA_TOPICS = {
    "image_rgb_info": "/camera/color/camera_info",
    "image_depth_info": "/camera/depth/camera_info",
    "image_segment_info": "/camera/segmentation/camera_info",
}


def record(folder: Path) -> Recording:
    recorder: Recorder = plugin_manager.load().record("recorders", "mcap")
    return recorder.create(folder)


def recorded(folder: Path, **selection: str) -> list[Step]:
    """Record a whole session; return what it observed."""
    session = sample_session(record(folder), **selection)
    steps = list(steps_to_the_end(session))
    session.close()
    return steps


def pixels(image: Any, dtype: str) -> Any:
    return np.frombuffer(bytes(image.data), dtype).reshape(image.height, image.width, -1).squeeze()


def stamp_ns(header: Any) -> int:
    return int(header.stamp.sec * 10**9 + header.stamp.nanosec)


def texts(bag: Bag, topic: str) -> list[Any]:
    return [json.loads(message.data) for _, message in bag[topic]]


@readers
def test_what_was_observed_is_what_is_read_back(tmp_path: Path, read: Callable[[Path], Bag]) -> None:
    steps = recorded(tmp_path / "run")
    bag = read(tmp_path / "run")
    assert len(steps) == 4
    for number, step in enumerate(steps):
        seen = step.observations
        at = {topic: messages[number][1] for topic, messages in bag.items() if topic != "/benchbot/action"}

        colour = at["/camera/color/image_raw"]
        assert (colour.encoding, colour.step, colour.is_bigendian) == ("rgb8", 3 * colour.width, 0)
        np.testing.assert_array_equal(pixels(colour, "u1"), seen["image_rgb"])
        depth = at["/camera/depth/image_raw"]
        assert depth.encoding == "32FC1"
        np.testing.assert_array_equal(pixels(depth, "<f4"), seen["image_depth"])
        assert np.isinf(seen["image_depth"]).any()
        classes, instances = at["/camera/segmentation/class"], at["/camera/segmentation/instance"]
        assert (classes.encoding, instances.encoding) == ("mono8", "mono16")
        np.testing.assert_array_equal(pixels(classes, "u1"), seen["image_segment"]["class_segment_img"])
        np.testing.assert_array_equal(pixels(instances, "<u2"), seen["image_segment"]["instance_segment_img"])
        assert json.loads(at["/camera/segmentation/class_ids"].data) == seen["image_segment"]["class_ids"]

        models: Mapping[str, Any] = seen
        for channel, topic in CAMERA_TOPICS.items():
            model = models[channel]
            assert (at[topic].height, at[topic].width) == (model["height"], model["width"])
            np.testing.assert_array_equal(np.reshape(at[topic].k, (3, 3)), model["matrix_intrinsics"])
            np.testing.assert_array_equal(np.reshape(at[topic].p, (3, 4)), model["matrix_projection"])
            np.testing.assert_array_equal(np.reshape(at[topic].r, (3, 3)), np.eye(3))

        scan, laser = at["/scan"], seen["laser"]
        np.testing.assert_array_equal(scan.ranges, laser["scans"][:, 0].astype(np.float32))
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        np.testing.assert_allclose(angles, laser["scans"][:, 1], atol=1e-5)
        assert (scan.range_min, scan.range_max) == pytest.approx((laser["range_min"], laser["range_max"]))

        transforms = {transform.child_frame_id: transform for transform in at["/tf"].transforms}
        assert set(transforms) == set(seen["poses"])
        for name, pose in seen["poses"].items():
            moved, turned = transforms[name].transform.translation, transforms[name].transform.rotation
            assert transforms[name].header.frame_id == "map"
            np.testing.assert_array_equal([moved.x, moved.y, moved.z], pose["translation_xyz"])
            np.testing.assert_array_equal([turned.x, turned.y, turned.z, turned.w], pose["rotation_xyzw"])


@readers
def test_actions_and_progress_are_told(tmp_path: Path, read: Callable[[Path], Bag]) -> None:
    session = sample_session(record(tmp_path / "run"), task="sample:active")
    session.reset()
    session.step(None)
    session.step("move_distance", {"distance": 0.5})
    session.step("move_distance", {"distance": 50})
    session.close()
    bag = read(tmp_path / "run")
    assert texts(bag, "/benchbot/action") == [
        {"action": "move_distance", "arguments": {"distance": 0.5}, "outcome": "reached", "result": "SUCCESS"},
        {"action": "move_distance", "arguments": {"distance": 50}, "outcome": "collided", "result": "COLLISION"},
    ]
    progress = texts(bag, "/benchbot/progress")
    assert [entry["state"] for entry in progress] == ["clean", "clean", "dirty", "collided"]
    assert progress[-1]["failure"] == "collision"
    # The action has the stamp of the observation that it led to.
    assert [time for time, _ in bag["/benchbot/action"]] == [time for time, _ in bag["/scan"]][2:]


def test_the_true_pose_is_nowhere_when_the_task_hides_it(tmp_path: Path) -> None:
    session = sample_session(record(tmp_path / "run"), task="sample:noisy")
    session.reset()
    session.step("move_distance", {"distance": 2.0})
    x, y, _ = session.progress.pose_xyyaw
    session.close()
    bag = by_rosbags(tmp_path / "run")
    told = {key for entry in texts(bag, "/benchbot/progress") for key in entry}
    # From times and known speeds the true way could be worked out.
    assert not told & {"pose_xyyaw", "path_length_m", "simulated_time_s"}
    assert [time for time, _ in bag["/scan"]] == [EPISODE_START_NS + number * 10**9 for number in (1, 2)]
    frames = [transform for _, message in bag["/tf"][1:] for transform in message.transforms]
    assert all((frame.transform.translation.x, frame.transform.translation.y) != (x, y) for frame in frames)


def test_time_is_the_episodes_and_always_goes_on(tmp_path: Path) -> None:
    recorded(tmp_path / "run", task="sample:two_scenes", environment="arena:1:2")
    bag = by_rosbags(tmp_path / "run")
    times = [time for time, _ in bag["/benchbot/progress"]]
    simulated = [entry["simulated_time_s"] for entry in texts(bag, "/benchbot/progress")]
    scenes = [entry["scene_number"] for entry in texts(bag, "/benchbot/progress")]
    assert set(scenes) == {0, 1}
    assert simulated[0] == 0
    assert times[0] == EPISODE_START_NS
    assert all(before < after for before, after in itertools.pairwise(times))
    np.testing.assert_allclose(np.array(times) - EPISODE_START_NS, np.array(simulated) * 1e9, rtol=0, atol=3)
    for topic in ("/scan", "/camera/color/image_raw", "/camera/depth/camera_info"):
        assert [stamp_ns(message.header) for _, message in bag[topic]] == times
    assert [stamp_ns(message.transforms[0].header) for _, message in bag["/tf"]] == times


def test_the_folder_is_a_rosbag2_directory(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "run"
    steps = recorded(folder)
    assert sorted(path.name for path in folder.iterdir()) == ["metadata.yaml", "run_0.mcap"]
    document = yaml.safe_load((folder / "metadata.yaml").read_text())
    bag = document["rosbag2_bagfile_information"]
    assert (bag["version"], bag["storage_identifier"], bag["relative_file_paths"]) == (9, "mcap", ["run_0.mcap"])
    assert bag["starting_time"] == {"nanoseconds_since_epoch": EPISODE_START_NS}
    topics = {entry["topic_metadata"]["name"]: entry for entry in bag["topics_with_message_count"]}
    assert topics["/tf"]["topic_metadata"]["type"] == "tf2_msgs/msg/TFMessage"
    assert topics["/tf"]["message_count"] == len(steps)
    assert all(entry["topic_metadata"]["type_description_hash"].startswith("RIHS01_") for entry in topics.values())
    with Reader(folder) as reader:
        assert reader.message_count == bag["message_count"] == sum(entry["message_count"] for entry in topics.values())
        assert reader.duration - 1 == bag["duration"]["nanoseconds"] == bag["files"][0]["duration"]["nanoseconds"]
    with (folder / "run_0.mcap").open("rb") as stream:
        mcap = make_reader(stream)
        assert mcap.get_header().profile == "ros2"
        summary = mcap.get_summary()
        assert summary is not None
        assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
        inside = next(entry for entry in mcap.iter_metadata() if entry.name == "rosbag2")
        assert yaml.safe_load(inside.metadata["serialized_metadata"]) == bag


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    for place in ("here", "there"):
        recorded(tmp_path / place / "run")
    for name in ("run_0.mcap", "metadata.yaml"):
        assert (tmp_path / "here/run" / name).read_bytes() == (tmp_path / "there/run" / name).read_bytes()


def test_a_reset_starts_over(tmp_path: Path) -> None:
    session = sample_session(record(tmp_path / "again" / "run"))
    session.reset()
    session.step("move_next")
    session.step("move_next")
    list(steps_to_the_end(session))
    session.close()
    recorded(tmp_path / "once" / "run")
    again, once = (tmp_path / which / "run/run_0.mcap" for which in ("again", "once"))
    assert again.read_bytes() == once.read_bytes()


@readers
def test_a_run_that_never_began_leaves_an_empty_bag(tmp_path: Path, read: Callable[[Path], Bag]) -> None:
    recording = record(tmp_path / "run")
    recording.close()
    recording.close()
    assert read(tmp_path / "run") == {}


def test_only_what_was_observed_is_recorded(tmp_path: Path) -> None:
    recording = record(tmp_path / "run")
    image = np.zeros((4, 5, 3), np.uint8)
    recording.step(None, {}, observing(image_rgb=image), Progress())
    recording.close()
    bag = by_rosbags(tmp_path / "run")
    assert set(bag) == {"/camera/color/image_raw", "/benchbot/exact", "/benchbot/progress"}
    # Without a camera model to name the frame, it is the one that `poses` has on every robot.
    assert bag["/camera/color/image_raw"][0][1].header.frame_id == "camera"


def observing(**observations: Unpack[Observations]) -> Step:
    return Step(observations, ActionResult.SUCCESS, (), State.CLEAN, 0)


@pytest.mark.parametrize(
    ("observation", "why"),
    [
        ({"image_rgb": np.zeros((4, 5, 3))}, "rgb8 holds uint8 with 3 per pixel, not float64"),
        ({"image_depth": np.zeros(7, np.float32)}, "32FC1 holds float32"),
        ({"laser": {"scans": np.array([[1, 0], [1, 0.1], [1, 0.5]]), "range_min": 0, "range_max": 1}}, "evenly spaced"),
        ({"poses": {"base_link": {"parent_frame": "map"}}}, "translation_xyz"),
        ({"smell": 1.0}, "no ROS 2 message"),
    ],
)
def test_an_observation_that_no_message_can_hold_is_refused(
    tmp_path: Path, observation: dict[str, Any], why: str
) -> None:
    recording = record(tmp_path / "run")
    with pytest.raises(BenchbotError, match="cannot write the observation") as caught:
        recording.step(None, {}, observing(**observation), Progress())
    assert why in caught.value.why
    recording.close()


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    recorded(tmp_path / "run")
    before = (tmp_path / "run" / "run_0.mcap").read_bytes()
    with pytest.raises(BenchbotError, match="holds a recording already"):
        record(tmp_path / "run")
    assert (tmp_path / "run" / "run_0.mcap").read_bytes() == before


def test_a_folder_that_cannot_be_is_told(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("a file")
    with pytest.raises(BenchbotError, match="cannot be written") as caught:
        record(tmp_path / "run")
    assert "exists" in caught.value.why


def test_nothing_is_recorded_after_the_end(tmp_path: Path) -> None:
    recording = record(tmp_path / "run")
    recording.close()
    with pytest.raises(BenchbotError, match="recording has ended"):
        recording.step(None, {}, observing(), Progress())


def test_listing_the_plug_in_imports_no_library() -> None:
    code = (
        "import sys, benchbot_record_mcap.plugin; print([m for m in ('mcap', 'rosbags', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
