"""Features and statistics of pictures in which both are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_sim_taichi.renderer import Frame, Intrinsics
from benchmarks.picture_statistics import compare_views, reproject, spectral_slope, statistics_of

CAMERA = Intrinsics.from_horizontal_fov(320, 240, 90.0)
WALL_M = 4.0
PIXEL_M = WALL_M / CAMERA.fx


def wall(shift_px: int) -> Frame:
    """A wall of random squares that is looked at from so many of its pixels farther right."""
    squares = np.random.default_rng(3).integers(0, 256, (30, 60, 3)).astype(np.uint8)
    picture = np.kron(squares, np.ones((8, 8, 1), np.uint8))[:, shift_px : shift_px + 320]
    return Frame(picture, np.full((240, 320), WALL_M, np.float32), np.ones((240, 320), np.int32))


def moved(right_px: float) -> np.ndarray:
    pose = np.eye(4)
    pose[0, 3] = right_px * PIXEL_M
    return pose


def test_features_of_a_shifted_wall_are_found_again() -> None:
    found = compare_views(wall(0), wall(16), (moved(0), moved(16)), CAMERA)
    for figures in found.values():
        assert figures.shared >= figures.repeated > 0.8 * figures.shared
        assert figures.matches >= figures.right > 0.9 * figures.matches > 0


def test_matches_are_wrong_where_the_pose_is() -> None:
    found = compare_views(wall(0), wall(16), (moved(0), moved(48)), CAMERA)
    assert all(figures.right < 0.1 * figures.matches for figures in found.values())


def test_a_blank_picture_has_no_features() -> None:
    blank = Frame(np.full((240, 320, 3), 90, np.uint8), wall(0).depth_m, wall(0).instance)
    for figures in compare_views(blank, wall(0), (moved(0), moved(0)), CAMERA).values():
        assert (figures.shared, figures.matches) == (0, 0)


def test_points_behind_something_beside_a_jump_or_outside_are_not_shown() -> None:
    depth_m, hidden_m = wall(0).depth_m, wall(0).depth_m.copy()
    hidden_m[:, 100:110] = 1.0
    points = np.array([[105.5, 50.5], [200.5, 50.5], [1.5, 50.5]])
    at, is_shown = reproject(points, depth_m, hidden_m, (moved(0), moved(4)), CAMERA)
    assert at == pytest.approx(points - [4.0, 0.0], abs=1e-3)
    assert is_shown.tolist() == [False, True, False]
    assert not reproject(np.array([[110.5, 9.5]]), hidden_m, hidden_m, (moved(0), moved(0)), CAMERA)[1].any()


@settings(max_examples=10)
@given(st.floats(0.3, 1.8), st.integers(0, 99))
def test_the_slope_of_noise_is_that_by_which_it_was_made(slope: float, seed: int) -> None:
    size = 256
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size)))
    frequency[0, 0] = 1.0
    phases = np.fft.fft2(np.random.default_rng(seed).normal(size=(size, size)))
    picture = np.fft.ifft2(phases / frequency**slope).real
    assert spectral_slope(picture) == pytest.approx(slope, abs=0.1)


def test_shares_and_saturation_are_of_all_pixels() -> None:
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[0] = [(255, 10, 0), (200, 100, 100)]
    figures = statistics_of(picture)
    assert (figures.white, figures.black) == (0.25, 0.5)
    assert figures.saturation == pytest.approx((1.0 + 0.5) / 4)
