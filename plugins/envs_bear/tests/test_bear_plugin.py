"""What the distribution offers to BenchBot, and how light it is to ask."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from benchbot_envs_bear import plugin
from plugins.envs_bear.tests.conftest import package_file


def test_environments_and_ground_truths_are_yielded_as_folders() -> None:
    (environments,) = plugin.benchbot_environments()
    (ground_truths,) = plugin.benchbot_ground_truths()
    declared = {path.name.removesuffix(".yaml") for path in environments.iterdir()}
    assert declared == {path.name.removesuffix(".json") for path in ground_truths.iterdir()}
    assert {f"{place}_{variant}" for place in ("miniroom", "house") for variant in range(1, 6)} <= declared


def test_batches_name_environments_that_there_are() -> None:
    (environments,), (batches,) = plugin.benchbot_environments(), plugin.benchbot_batches()
    declared = {path.name.removesuffix(".yaml") for path in environments.iterdir()}
    named = {}
    for path in batches.iterdir():
        batch = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert batch["name"] == path.name.removesuffix(".yaml")
        named[batch["name"]] = batch["environments"]
    assert set(named) == {f"{kind}_{number}" for kind in ("develop", "challenge") for number in range(1, 7)}
    for name, *variants in (entry.split(":") for entries in named.values() for entry in entries):
        assert {f"{name}_{variant}" for variant in variants} <= declared


def test_batches_for_detecting_change_name_two_variants_of_a_place() -> None:
    (batches,) = plugin.benchbot_batches()
    batch = yaml.safe_load((batches / "develop_4.yaml").read_text(encoding="utf-8"))
    assert batch["environments"][:3] == ["miniroom:1:2", "miniroom:1:3", "miniroom:2:3"]


def test_each_declaration_points_to_its_scene() -> None:
    (environments,) = plugin.benchbot_environments()
    for path in environments.iterdir():
        declaration = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert (Path(str(environments)) / declaration["map_path"]).is_file()


def test_the_declaration_names_the_thirty_classes(environment: dict[str, Any], published: dict[str, Any]) -> None:
    assert environment["object_labels"] == published["class_list"][:-1]
    assert len(environment["object_labels"]) == 30


def test_heading_and_place_of_every_pose_are_the_published_ones(
    environment: dict[str, Any], published: dict[str, Any]
) -> None:
    for pose, given in zip(environment["trajectory_poses"], published["trajectory_poses_wxyz_xyz"], strict=True):
        assert pose[4:6] == given[4:6]
        assert abs(pose[0] * given[0] + pose[3] * given[3]) > 0.9999


def test_importing_the_plugin_stays_light() -> None:
    code = "import sys, benchbot_envs_bear.plugin; print({'numpy', 'PIL', 'pygltflib', 'scipy'} & set(sys.modules))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "set()"


@pytest.mark.parametrize("name", [f"{place}_{variant}" for place in ("miniroom", "house") for variant in range(1, 6)])
def test_the_ground_truth_of_a_published_place_is_the_published_one_to_the_last_digit(name: str) -> None:
    """A map that copies what was published scores what it scored there, also of things of a few millimetres."""
    truth = json.loads(package_file("ground_truths", f"{name}.json").read_text(encoding="utf-8"))["ground_truth"]
    published = json.loads(package_file("published", f"{name}.json").read_text(encoding="utf-8"))
    figures = {entry["ID_name"]: (entry["centroid"], entry["extent"]) for entry in truth["objects"]}
    assert figures == {entry["id"]: (entry["centroid"], entry["extent"]) for entry in published["objects"]}
    numbers = [number for centroid, extent in figures.values() for number in centroid + extent]
    assert sum(round(number, 4) != number for number in numbers) > 0.9 * len(numbers)
