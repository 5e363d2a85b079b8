"""Cornell's box as Mitsuba 3 sees it: the golden picture is made by `python -m benchmarks.rays.cornell`."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.renderer import Renderer
from benchmarks.rays.cornell import CAMERA, NIGHT, POSE, REFLECTIONS, cornell

pytestmark = pytest.mark.xdist_group("renderer")

GOLDEN = Path(__file__).parent / "golden" / "cornell_mitsuba.npz"
SAMPLES = 512
BLOCK = 8


@pytest.fixture(scope="module")
def pictures(kernel_cache: Path) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (64, 64, 3), ours and Mitsuba's."""
    renderer = Renderer(cornell(), NIGHT, cache_dir=kernel_cache)
    ours = path_trace(renderer, POSE, CAMERA, samples_per_pixel=SAMPLES, bounces=REFLECTIONS, brightest=1e30)
    with np.load(GOLDEN) as golden:
        theirs = golden["radiance"].astype(np.float64)
    return ours / renderer.exposure, theirs


def test_the_mean_of_path_tracing_is_mitsubas(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    ours, theirs = (picture.mean(axis=(0, 1)) for picture in pictures)
    assert np.allclose(ours, theirs, rtol=0.01)


def test_every_part_of_the_picture_is_mitsubas(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    ours, theirs = (blocks(picture) for picture in pictures)
    apart = np.abs(ours - theirs) / theirs
    assert apart.mean() < 0.02
    assert apart.max() < 0.08


def blocks(picture: np.ndarray) -> np.ndarray:
    """Mean luminance of squares of 8x8 pixels."""
    luminance = picture @ np.array([0.2126, 0.7152, 0.0722])
    mean: np.ndarray = luminance.reshape(64 // BLOCK, BLOCK, 64 // BLOCK, BLOCK).mean(axis=(1, 3))
    return mean
