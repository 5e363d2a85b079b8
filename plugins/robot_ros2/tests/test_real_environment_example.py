"""The example of a real environment in docs/examples: it is valid, a robot can run in it, and maps of it are scored."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import Selection, select
from benchbot.plugin import GroundTruth, Result
from benchbot.plugins.formats import object_map_ground_truth
from benchbot_eval_omq import omq
from benchbot_robot_ros2.declaration import Ros2Robot

EXAMPLE = Path(__file__).parents[3] / "docs/examples/real_lab"
TASK = "semantic_slam:passive:ground_truth"
Document = dict[str, Any]


@pytest.fixture
def catalog(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Catalog:
    """The catalog with the example installed, as `pip install -e docs/examples/real_lab` does it; and for processes."""
    info = tmp_path / "benchbot_envs_lab-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: benchbot-envs-lab\nVersion: 0.1.0\n")
    (info / "entry_points.txt").write_text("[benchbot]\nenvs_lab = benchbot_envs_lab\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.syspath_prepend(str(EXAMPLE))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(EXAMPLE), str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    load.cache_clear()
    return Catalog(load())


@pytest.fixture
def truth() -> Document:
    document: Document = json.loads((EXAMPLE / "benchbot_envs_lab/ground_truths/lab_1.json").read_text())
    return document


def lab(catalog: Catalog, robot: str = "turtlebot4") -> Selection:
    return select(catalog, RunRequest(task=TASK, robot=robot, environment="lab:1", method="omq"))


def test_benchbot_check_finds_nothing_wrong() -> None:
    command = [sys.executable, "-m", "benchbot", "check", str(EXAMPLE)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout
    assert "3 files checked" in result.stderr


@pytest.mark.parametrize("robot", ["jackal", "stretch", "turtlebot4"])
def test_a_real_robot_can_be_asked_to_map_it(catalog: Catalog, robot: str) -> None:
    selection = lab(catalog, robot)
    assert selection.environment == "lab:1"
    assert selection.environments[0].data["type"] == "real"
    assert not selection.time_is_simulated


def test_its_ground_truth_is_found_by_evaluation(catalog: Catalog, truth: Document) -> None:
    lab(catalog)
    assert EXAMPLE / "benchbot_envs_lab/ground_truths/lab_1.json" in catalog.ground_truth_files
    object_map_ground_truth.validate(truth["ground_truth"])
    assert truth["environment"] == {"name": "lab", "variant": 1}


@pytest.mark.parametrize("robot", ["jackal", "stretch", "turtlebot4"])
def test_the_trajectory_keeps_clear_of_the_furniture(catalog: Catalog, truth: Document, robot: str) -> None:
    radius_m = Ros2Robot.from_declaration(catalog.get("robots", robot).data).footprint.radius_m
    for pose in lab(catalog).environments[0].data["trajectory_poses"]:
        assert math.hypot(*pose[:4]) == pytest.approx(1, abs=1e-3)
        for thing in truth["ground_truth"]["objects"]:
            away = [
                max(abs(at - centre) - size / 2, 0.0)
                for at, centre, size in zip(pose[4:6], thing["centroid"][:2], thing["extent"][:2], strict=True)
            ]
            assert math.hypot(*away) > radius_m, f"{pose} is too near to {thing['ID_name']}"


def found(thing: Document, classes: list[str], shift_m: float) -> Document:
    x, y, z = thing["centroid"]
    probabilities = [float(name == thing["class"]) for name in classes]
    return {"label_probs": probabilities, "centroid": [x + shift_m, y, z], "extent": thing["extent"]}


def mapped(objects: list[Document], classes: list[str]) -> Result:
    return {
        "task_details": {"name": TASK, "results_format": "object_map"},
        "environment_details": [yaml.safe_load((EXAMPLE / "benchbot_envs_lab/environments/lab_1.yaml").read_text())],
        "results": {"objects": objects, "class_list": classes},
    }


@pytest.mark.parametrize(("shift_m", "lowest", "highest"), [(0.0, 1.0, 1.0), (0.02, 0.6, 0.99), (5.0, 0.0, 0.0)])
def test_a_map_of_it_is_scored(truth: GroundTruth, shift_m: float, lowest: float, highest: float) -> None:
    classes = truth["ground_truth"]["class_list"]
    things = truth["ground_truth"]["objects"]
    result = mapped([found(thing, classes, shift_m) for thing in things], classes)
    assert lowest <= omq.evaluate(result, [truth])["OMQ"] <= highest


@pytest.mark.usefixtures("catalog")
def test_the_commands_of_the_guide_score_and_draw_an_empty_map(tmp_path: Path, truth: Document) -> None:
    result = tmp_path / "lab.json"
    result.write_text(json.dumps(mapped([], truth["ground_truth"]["class_list"])))
    for words in (["eval", str(result), "-o", "scores.json"], ["picture", str(result), "-o", "lab.png"]):
        command = [sys.executable, "-m", "benchbot", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "lab.png").stat().st_size > 0
    assert json.loads((tmp_path / "scores.json").read_text())
