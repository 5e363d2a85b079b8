"""Generating the environment again yields what is committed."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from plugins.envs_bear.tests.conftest import Node
from tools.bear.places import generate

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("miniroom generation")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("environments")
    subprocess.run([sys.executable, "-m", "tools.bear", "miniroom:1", "--folder", str(path)], check=True)
    return path


def test_geometry_equals_the_committed_scene(
    folder: Path, nodes: dict[str, Node], read_nodes: Callable[[Path], dict[str, Node]]
) -> None:
    again = read_nodes(folder / "scenes" / "miniroom_1.glb")
    assert list(again) == list(nodes)
    for name, node in again.items():
        np.testing.assert_allclose(node.vertices, nodes[name].vertices, atol=1e-5, err_msg=name)
        np.testing.assert_array_equal(node.triangles, nodes[name].triangles, err_msg=name)
        assert node.tag == nodes[name].tag


def test_declaration_and_ground_truth_equal_the_committed_ones(
    folder: Path, environment: dict[str, Any], truth: dict[str, Any]
) -> None:
    declared = yaml.safe_load((folder / "environments" / "miniroom_1.yaml").read_text(encoding="utf-8"))
    generated = json.loads((folder / "ground_truths" / "miniroom_1.json").read_text(encoding="utf-8"))
    assert declared == environment
    assert generated["environment"] == truth["environment"] == environment
    for new, old in zip(generated["ground_truth"]["objects"], truth["ground_truth"]["objects"], strict=True):
        assert {**new, "centroid": None, "extent": None} == {**old, "centroid": None, "extent": None}
        np.testing.assert_allclose(new["centroid"] + new["extent"], old["centroid"] + old["extent"], atol=1e-5)


def test_another_process_writes_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    generate("miniroom:1", tmp_path)
    for kind, name in (
        ("scenes", "miniroom_1.glb"),
        ("environments", "miniroom_1.yaml"),
        ("ground_truths", "miniroom_1.json"),
        ("maps", "miniroom_1.png"),
    ):
        assert (tmp_path / kind / name).read_bytes() == (folder / kind / name).read_bytes()


def test_an_unknown_environment_is_refused_with_what_there_is() -> None:
    result = subprocess.run(
        [sys.executable, "-m", "tools.bear", "castle:1"], capture_output=True, text=True, check=False
    )
    assert result.returncode == 2
    assert "miniroom:1" in result.stderr
    assert "Traceback" not in result.stderr
