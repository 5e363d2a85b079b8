"""The main job as in docs/start.md: one command drives a ray-traced robot, maps the room and scores the map."""

import json
import shutil
from pathlib import Path

import pytest
from PIL import Image

from tests.ray_tracing import benchbot

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("main job")]


@pytest.fixture(scope="module")
def folder(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the demo's command ran twice with one seed."""
    folder = tmp_path_factory.mktemp("demo")
    return shutil.copytree(demo, folder, ignore=shutil.ignore_patterns("cache", "state"), dirs_exist_ok=True)


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
    printed = benchbot(
        folder, "picture", "first/result.json", "--frames", "first/frames", "-o", "picture.png", cache=folder / "cache"
    )

    assert printed == "picture.png\n"
    assert Image.open(folder / "picture.png").size == (1840, 1000)


def test_a_result_is_scored_against_a_named_ground_truth(folder: Path) -> None:
    import benchbot_envs_bear

    truth = Path(benchbot_envs_bear.__file__).parent / "ground_truths" / "miniroom_1.json"
    again = benchbot(
        folder, "eval", "first/result.json", "--ground-truth", str(truth), "-o", "again.json", cache=folder / "cache"
    )
    first = json.loads((folder / "first" / "scores.json").read_text())

    assert again == f"OMQ {first['scores']['OMQ']:.4f}\n"
