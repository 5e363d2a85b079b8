"""One episode by the command line: sandboxed, in a batch, recorded, scored, verified; and what is refused."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

TASK = "manipulation:tidy_up:ground_truth:segmentation"
EPISODE = ("--task", TASK, "--robot", "carter_arm_lowres", "--env", "tidyroom:1", "--episode", "6")


def benchbot(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "benchbot", *words],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"BENCHBOT_CACHE_DIR": str(folder / "cache"), "BENCHBOT_DATA_DIR": str(folder / "data")},
    )


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A batch of one episode with a secret, held in a sandbox, recorded and scored."""
    folder = tmp_path_factory.mktemp("batch")
    (folder / "secret.txt").write_text("5e" * 16 + "\n")
    done = benchbot(
        folder,
        *("batch", *EPISODE, "--example", "fetch_and_place", "--sandboxed", "--secret", str(folder / "secret.txt")),
        *("--record", "steps", "--record", "trajectory", "--record", "mcap", "--record", "rerun"),
        *("--evaluate-with", "tidy_up", "--output-location", str(folder / "batch")),
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "batch"


@pytest.fixture(scope="module")
def result(batch: Path) -> dict[str, Any]:
    (path,) = (batch / "results").glob("*.json")
    document: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return document


def test_the_object_is_fetched_and_scored(batch: Path) -> None:
    scores = json.loads((batch / "scores.json").read_text("utf-8"))
    assert scores["scores"]["success"] == 1.0
    assert scores["scores"]["drops"] == scores["scores"]["collisions"] == 0.0


def test_the_result_tells_the_truth_about_objects_and_actions(result: dict[str, Any]) -> None:
    (track,) = result["track"]
    moved = {each["name"] for each in track["objects"] if len(each["rows"]) > 1}
    assert "cup" in moved
    assert track["held"] == []
    assert track["energy_j"] > 10.0
    (taken,) = result["actions"]
    arguments = [row[2] for row in taken["rows"] if row[1:2] == ["move_end_effector"]]
    assert all(len(given["pose"]) == 7 for given in arguments)
    assert "objects" not in result["environment_details"][0]


def test_each_recording_is_whole_and_has_the_joints(batch: Path) -> None:
    notes = [json.loads(path.read_text("utf-8")) for path in batch.rglob("recording.json")]
    assert {note["recorder"] for note in notes} == {"steps", "trajectory", "mcap", "rerun"}
    assert {note["state"] for note in notes} == {"finished"}
    lines = [json.loads(line) for line in next(batch.rglob("steps.jsonl")).read_text("utf-8").splitlines()]
    assert any(line["action"] == "move_joints" for line in lines)
    assert "/joint_states" in next(batch.rglob("metadata.yaml")).read_text("utf-8")


def test_its_result_is_verified_by_acting_again(batch: Path) -> None:
    (path,) = (batch / "results").glob("*.json")
    done = benchbot(batch.parent, "verify", str(path), "--scores", str(batch / "scores.json"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "verified" in done.stdout + done.stderr


def test_a_robot_without_an_arm_is_refused_with_what_it_lacks(tmp_path: Path) -> None:
    words = ("--task", TASK, "--robot", "carter_lowres_mujoco", "--env", "tidyroom:1", "--example", "fetch_and_place")
    done = benchbot(tmp_path, "submit", *words, "--results-location", str(tmp_path / "result.json"))
    assert done.returncode != 0
    said = " ".join(done.stderr.split())
    assert "does not offer the actions" in said
    assert "move_end_effector, move_gripper, move_joints" in said
    assert "Choose another robot" in said
