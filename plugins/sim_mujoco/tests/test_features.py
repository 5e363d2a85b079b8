"""What BenchBot does with any simulator, it does with this one: batches, sandboxes, recordings, scores, replays."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

EPISODE = (
    *("--task", "exploration:active:ground_truth:laser", "--robot", "carter_lowres_mujoco", "--env", "miniroom:1"),
    *("--example", "wander", "--args", "--steps 3", "--sandboxed", "--record", "trajectory"),
    *("--evaluate-with", "exploration", "--seeds", "3"),
)


def benchbot(folder: Path, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "benchbot", *words],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"BENCHBOT_CACHE_DIR": str(folder / "cache"), "BENCHBOT_DATA_DIR": str(folder / "data")},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A batch of one episode, held in a sandbox, recorded and scored."""
    folder = tmp_path_factory.mktemp("batch")
    benchbot(folder, "batch", *EPISODE, "--output-location", str(folder / "batch"))
    return folder / "batch"


def test_a_batch_in_a_sandbox_is_scored_and_recorded(batch: Path) -> None:
    scores = json.loads((batch / "scores.json").read_text())
    assert scores["coverage"]["scored"] == 1
    (result,) = (json.loads(path.read_text()) for path in (batch / "results").glob("*.json"))
    assert result["provenance"]["machine"]["mujoco"]
    assert result["provenance"]["machine"]["device"] == "cpu"
    assert "opengl" not in result["provenance"]["machine"], "nothing was drawn"
    assert list(batch.rglob("trajectory/*"))


def test_its_result_is_verified_by_driving_it_again(batch: Path) -> None:
    (result,) = (batch / "results").glob("*.json")
    assert "verified" in benchbot(batch.parent, "verify", str(result), "--scores", str(batch / "scores.json"))
