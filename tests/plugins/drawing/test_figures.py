import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.drawing.figures import scale_length_m
from benchbot.plugins.drawing.scene_maps import chosen, fitted


@given(st.floats(0.02, 1e5))
def test_a_scale_bar_has_a_round_length_and_is_a_tenth_to_a_quarter_wide(width_m: float) -> None:
    length_m = scale_length_m(width_m)
    assert width_m / 10.01 <= length_m <= width_m / 3.99
    leading = length_m / 10 ** math.floor(math.log10(length_m * 1.0001))
    assert any(math.isclose(leading, round_one) for round_one in (1, 2, 5))


@given(st.floats(-math.pi, math.pi), st.floats(-50, 50), st.floats(-50, 50), st.integers(2, 30))
def test_an_estimate_that_is_only_moved_and_turned_fits(angle_rad: float, x: float, y: float, count: int) -> None:
    true = np.random.default_rng(count).normal(size=(count, 2))
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    believed = true @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
    np.testing.assert_allclose(fitted(believed, true), true, atol=1e-9)


def test_an_estimate_is_never_mirrored_nor_stretched() -> None:
    true = np.array([[0, 0], [4, 0], [4, 1.0]])
    mirrored = true * (1, -1) * 3
    moved = fitted(mirrored, true)
    sides = [np.linalg.norm(points[1:] - points[:-1], axis=1) for points in (moved, mirrored)]
    np.testing.assert_allclose(*sides)
    turns = [np.linalg.det(points[1:] - points[0]) for points in (moved, mirrored)]
    np.testing.assert_allclose(*turns)


@given(st.sets(st.integers(0, 500), min_size=1), st.integers(1, 40))
def test_frames_are_chosen_evenly_with_the_first_and_the_last(numbers: set[int], count: int) -> None:
    from pathlib import Path

    frames = {number: Path(f"{number:05d}.jpg") for number in numbers}
    found = chosen(frames, count)
    assert found.items() <= frames.items()
    assert len(found) == min(count, len(frames))
    if count > 1:
        assert {min(numbers), max(numbers)} <= found.keys()
