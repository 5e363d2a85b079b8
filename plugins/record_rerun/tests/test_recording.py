"""What is recorded is read back by Rerun's own reader."""

import signal
import subprocess
import sys
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.core.recording import Recording
from benchbot.evaluation.ground_truths import GroundTruths
from benchbot_record_rerun.entities import MOST_POINTS, Way
from plugins.record_mcap.tests.bags import sample_session, steps_to_the_end

KILLED = """
import os, signal, sys
from pathlib import Path
from plugins.record_rerun.tests.test_recording import create
from plugins.record_mcap.tests.bags import sample_session, steps_to_the_end
session = sample_session(create(Path(sys.argv[1])), task="sample:passive")
list(steps_to_the_end(session))
os.kill(os.getpid(), signal.SIGKILL)
"""


def create(folder: Path) -> Recording:
    recording: Recording = plugin_manager.load().record("recorders", "rerun").create(folder)
    return recording


def rows(folder: Path) -> Counter[str]:
    """Return how often each entity was recorded."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a file without an index is told of
        chunks = [*RrdReader(folder / "run.rrd").stream()]
    return Counter({path: sum(c.num_rows for c in chunks if c.entity_path == path) for path in paths_of(chunks)})


def paths_of(chunks: list[Any]) -> set[str]:
    return {chunk.entity_path for chunk in chunks}


def column(folder: Path, entity: str, name: str) -> list[Any]:
    found: list[Any] = []
    for chunk in RrdReader(folder / "run.rrd").stream():
        if chunk.entity_path == entity:
            found += chunk.to_record_batch().to_pydict()[name]
    return found


def test_a_session_is_read_back(tmp_path: Path) -> None:
    recording = create(tmp_path)
    session = sample_session(recording)
    session.reset()
    session.step("move_next")
    steps = list(steps_to_the_end(session))
    objects = [{"centroid": [1, 2, 3], "extent": [1, 1, 1], "label_probs": [0.1, 0.9]}]
    recording.result({"results": {"class_list": ["cup", "chair"], "objects": objects}})  # type: ignore[attr-defined]
    session.close()

    found = rows(tmp_path)
    camera = "/map/camera/image"
    each = ["/state", "/map/base_link", "/map/way", "/map/lidar/scan", camera, f"{camera}/rgb", f"{camera}/depth"]
    assert {path: found[path] for path in each} == dict.fromkeys(each, len(steps))
    assert found["/actions"] == len(steps) - 1
    assert column(tmp_path, "/state", "observation") == list(range(1, len(steps) + 1))
    moved = column(tmp_path, "/map/base_link", "Transform3D:translation")
    truth = [step.observations["poses"]["base_link"]["translation_xyz"] for step in steps]
    np.testing.assert_allclose(np.reshape(moved, (-1, 3)), truth, atol=1e-6)
    (labels,) = column(tmp_path, "/map/objects", "Boxes3D:labels")
    assert labels == ["chair 0.90"]


def test_the_true_pose_is_nowhere_when_the_task_hides_it(tmp_path: Path) -> None:
    session = sample_session(create(tmp_path), task="sample:noisy")
    session.reset()
    session.step("move_distance", {"distance": 2.0})
    x, y, _ = session.progress.pose_xyyaw
    session.close()
    for entity in ("/map/base_link", "/map/camera"):
        places = np.reshape(column(tmp_path, entity, "Transform3D:translation"), (-1, 3))
        assert not (np.abs(places[1:, :2] - (x, y)) < 1e-9).all(1).any()


def test_the_true_boxes_are_written_at_the_end_and_not_where_there_is_a_secret(tmp_path: Path) -> None:
    declared = Catalog(plugin_manager.load()).get("environments", "miniroom:1")
    truth = GroundTruths.of(Catalog(plugin_manager.load()), None).find("miniroom:1", {"object_map_ground_truth"})
    for name, commitment in (("open", None), ("secret", "ab" * 32)):
        recording = create(tmp_path / name)
        environments = [{"name": declared.data["name"], "variant": declared.data["variant"]}]
        recording.run({"environments": environments, "selection": {"commitment": commitment}})  # type: ignore[attr-defined]
        recording.step(None, {}, Step({}, ActionResult.SUCCESS, (), State.CLEAN, 0), Progress(frames=1))
        assert "/map/truth" not in rows(tmp_path / name)  # the robot still drives
        recording.close()
        assert ("/map/truth" in rows(tmp_path / name)) == (commitment is None)

    (labels,) = column(tmp_path / "open", "/map/truth", "Boxes3D:labels")
    assert labels == [item["class"] for item in truth["ground_truth"]["objects"]]


def test_what_a_killed_recorder_leaves_can_be_opened(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert done.returncode == -signal.SIGKILL
    found = rows(tmp_path)
    assert found["/state"] == found["/map/camera/image/rgb"] > 2


def test_only_what_was_observed_is_recorded(tmp_path: Path) -> None:
    recording = create(tmp_path)
    recording.step(None, {}, Step({}, ActionResult.SUCCESS, (), State.CLEAN, 0), Progress(frames=1))
    recording.close()
    assert set(rows(tmp_path)) == {"/__properties", "/map", "/state"}


@pytest.mark.parametrize("length", [1, 2, MOST_POINTS, 5 * MOST_POINTS])
def test_a_long_way_has_few_points_and_its_ends(length: int) -> None:
    way = Way()
    for number in range(length):
        points = way.to((float(number), 0.0, 0.0))
    assert (points[0][0], points[-1][0]) == (0.0, length - 1)
    assert len(points) <= MOST_POINTS + 1
