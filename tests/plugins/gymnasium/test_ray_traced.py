"""The registered environments, on the ray-traced robot, and the page that explains them."""

import os
import re
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from benchbot.gymnasium import DiscreteMoves
from tests.docs.blocks import blocks

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("renderer")]
PAGE = Path(__file__).parents[3] / "docs" / "gymnasium.md"


@pytest.fixture(autouse=True)
def cache(kernel_cache: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    return kernel_cache


@pytest.mark.filterwarnings("error::UserWarning")
def test_gymnasium_finds_nothing_to_complain_about() -> None:
    env = gymnasium.make("benchbot/SemanticSlam-v0", reward="coverage", image_size=(64, 48))
    check_env(env.unwrapped)
    env.close()


def test_pictures_of_the_asked_size_are_seen_and_a_seed_repeats_them() -> None:
    env = DiscreteMoves(gymnasium.make("benchbot/SemanticSlam-v0", reward="coverage", image_size=(64, 64)))
    seen = []
    for _ in range(2):
        _, info = env.reset(seed=1)
        observation, reward, *_ = env.step(1)
        seen.append((observation["image_rgb"].tobytes(), observation["laser"].tobytes(), reward))
    env.close()
    assert observation["image_rgb"].shape == (64, 64, 3)
    assert info["image_rgb_info"]["matrix_intrinsics"][0, 0] == 32
    assert len(np.unique(observation["class_segment_img"])) > 2
    assert seen[0] == seen[1]


def test_the_examples_of_the_page_run_as_they_stand(cache: Path) -> None:
    script = "\n".join(
        block.text for block in blocks(PAGE.read_text("utf-8")) if block.language == "python" and block.run_by
    )
    environment = {**os.environ, "BENCHBOT_CACHE_DIR": str(cache)}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    *steps, shape = [line for line in done.stdout.splitlines() if not line.startswith("[Taichi]")]
    assert re.fullmatch(r"1 \w+ \d+\.\d\d m²", steps[0])
    assert shape == "(2, 64, 64, 3)"
