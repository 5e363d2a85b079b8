"""The main job as in docs/start.md: one command drives a ray-traced robot, maps the room and scores the map."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

TASK = "semantic_slam:passive:ground_truth:segmentation"
COMMAND = [sys.executable, "-m", "benchbot"]
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("main job")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the demo's commands ran twice with one seed, on the robot with the small camera.

    The first time with nothing in the cache, as for somebody new: kernels are compiled, the light is worked out.
    """
    folder = tmp_path_factory.mktemp("demo")
    for run in ("first", "second"):
        benchbot(
            folder,
            *("submit", "--task", TASK, "--robot", "carter_lowres", "--env", "miniroom:1", "--seed", "7"),
            *("--example", "segmentation_mapper", "--record", f"frames={run}/frames"),
            *("--results-location", f"{run}/result.json", "--evaluate-with", "omq", "--require", "OMQ>=0.85"),
        )
    return folder


def benchbot(folder: Path, *words: str, cache: Path | None = None) -> str:
    """Run a command that must succeed; return what it printed as data."""
    cache = cache or folder / "cache"
    variables = {"BENCHBOT_STATE_DIR": str(folder / "state"), "BENCHBOT_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [*COMMAND, *words], cwd=folder, env={**os.environ, **variables}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_room_is_driven_mapped_and_scored(folder: Path) -> None:
    result = json.loads((folder / "first" / "result.json").read_text())
    scores = json.loads((folder / "first" / "scores.json").read_text())

    assert (result["provenance"]["steps"], result["provenance"]["failure"]) == (48, None)
    assert len(result["results"]["objects"]) == 18
    assert scores["scores"]["OMQ"] > 0.85
    assert len(list((folder / "first" / "frames").glob("*.jpg"))) == 49


def test_the_same_seed_gives_the_same_bytes(folder: Path) -> None:
    first, second = ((folder / run / "result.json").read_bytes() for run in ("first", "second"))

    assert first == second


def test_the_ground_truth_is_nowhere_in_the_result(folder: Path) -> None:
    text = (folder / "first" / "result.json").read_text()

    assert "SM_AI" not in text
    assert "ground_truths" not in text
    assert "map_path" not in text


def test_the_result_can_be_drawn(folder: Path) -> None:
    printed = benchbot(folder, "picture", "first/result.json", "--frames", "first/frames", "-o", "picture.png")

    assert printed == "picture.png\n"
    assert Image.open(folder / "picture.png").size == (1840, 1000)


def test_a_result_is_scored_against_a_named_ground_truth(folder: Path) -> None:
    import benchbot_envs_bear

    truth = Path(benchbot_envs_bear.__file__).parent / "ground_truths" / "miniroom_1.json"
    again = benchbot(folder, "eval", "first/result.json", "--ground-truth", str(truth), "-o", "again.json")
    first = json.loads((folder / "first" / "scores.json").read_text())

    assert again == f"OMQ {first['scores']['OMQ']:.4f}\n"
