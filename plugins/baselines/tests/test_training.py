"""Training for a few seconds, on pictures drawn by hand of a wall with a red chair before it."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from benchbot.mapping import CLASS_LIST
from benchbot_baselines.collecting import BACKGROUND, Settings, Shots, begin, place_file
from benchbot_baselines.features import features
from benchbot_baselines.segmenter import Segmenter
from benchbot_baselines.training import Options, device_features, train

VIEWS, HEIGHT, WIDTH = 4, 32, 48
CHAIR = CLASS_LIST.index("chair")
SEEDS = (1000, 1001)


@pytest.fixture
def collected(tmp_path: Path) -> Path:
    begin(tmp_path, Settings(VIEWS, WIDTH, HEIGHT))
    for seed in SEEDS:
        random = np.random.default_rng(seed)
        instance = np.zeros((VIEWS, HEIGHT, WIDTH), np.uint16)
        for each, (top, left) in zip(instance, random.integers(0, 16, (VIEWS, 2)), strict=True):
            each[top : top + 16, left : left + 24] = 1
        rgb = np.where(instance[..., None] == 1, [200, 30, 30], [120, 120, 120]).astype(np.uint8)
        depth_mm = np.where(instance == 1, 1500, 3000).astype(np.uint16)
        pose = np.eye(4)
        pose[:3, :3], pose[2, 3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], 1.0
        cameras = np.tile([40.0, 40.0, 23.5, 15.5], (VIEWS, 1))
        classes = np.array([BACKGROUND, CHAIR], np.uint8)
        shots = Shots(rgb, depth_mm, instance, classes, np.stack([pose] * VIEWS), cameras, np.array("day"))
        np.savez(place_file(tmp_path, seed), **vars(shots))
    return tmp_path


def test_the_chair_is_learnt_and_the_curve_is_kept(collected: Path, tmp_path: Path) -> None:
    ious = train(collected, tmp_path / "run", Options(steps=80, batch=8, every_s=0), "cpu")

    assert ious["chair"] > 0.5
    with (tmp_path / "run" / "curve.csv").open(encoding="utf-8") as file:
        curve = list(csv.DictReader(file))
    assert float(curve[-1]["loss"]) < float(curve[1]["loss"])
    card = (tmp_path / "run" / "card.md").read_text("utf-8")
    for row in (curve[0], curve[-1]):
        assert f"| {row['step']} |" in card
    assert list(Segmenter(tmp_path / "run" / "weights.onnx").class_list) == list(CLASS_LIST)


def test_features_of_a_batch_are_those_that_the_mapper_works_out() -> None:
    random = np.random.default_rng(0)
    rgb = random.integers(0, 256, (1, HEIGHT, WIDTH, 3), np.uint8)
    points = random.normal(0, 2, (1, HEIGHT, WIDTH, 3)).astype(np.float32)
    depth_m = random.uniform(0.3, 5, (1, HEIGHT, WIDTH)).astype(np.float32)
    depth_m[0, 4:9, 7:12] = 0

    given = (torch.from_numpy(each) for each in (rgb.astype(np.float32), points, depth_m))
    np.testing.assert_allclose(device_features(*given)[0].numpy(), features(rgb[0], points[0], depth_m[0]), atol=0.51)


@pytest.mark.parametrize("lacking", ["torch", "onnx"])
@pytest.mark.parametrize("module", ["training", "policy_training"])
def test_what_training_needs_and_does_not_find_is_told_before_it_begins(module: str, lacking: str) -> None:
    # An import of what is None there fails as that of a package that is not installed.
    program = (
        f"import runpy, sys; sys.modules['{lacking}'] = None; "
        f"runpy.run_module('benchbot_baselines.{module}', run_name='__main__')"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)

    assert (ended.returncode, ended.stdout) == (1, "")
    assert f"needs the package {lacking}, which is not installed" in ended.stderr
    assert "pip install 'benchbot-baselines[train]'" in ended.stderr
    assert "Traceback" not in ended.stderr
