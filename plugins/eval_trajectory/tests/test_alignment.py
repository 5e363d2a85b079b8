"""Alignment: what it undoes, what it must not, and where there is more than one best."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_eval_trajectory import metrics
from benchbot_eval_trajectory.alignment import Align, alignment, umeyama
from benchbot_eval_trajectory.trajectory import Floats, Trajectory
from plugins.eval_trajectory.tests.ways import SCALES, SHIFTS, TURNS, estimate_of, moved, wander

Vector = tuple[float, float, float]

TRUTH = wander(60)
ESTIMATE = estimate_of(TRUTH)


def ate_m(estimate: Trajectory, align: Align, truth: Trajectory = TRUTH) -> Floats:
    return metrics.absolute_m(alignment(estimate, truth, align).of(estimate), truth)


@given(TURNS, SHIFTS)
def test_where_an_estimate_is_seen_from_does_not_matter(turn: Vector, shift: Vector) -> None:
    for align in (Align.SE3, Align.SIM3):
        assert ate_m(moved(ESTIMATE, turn, shift), align) == pytest.approx(ate_m(ESTIMATE, align), abs=1e-9)


@given(TURNS, SHIFTS, SCALES)
def test_its_scale_does_not_matter_with_sim3(turn: Vector, shift: Vector, scale: float) -> None:
    found = alignment(moved(ESTIMATE, turn, shift, scale), TRUTH, Align.SIM3)

    assert found.scale * scale == pytest.approx(alignment(ESTIMATE, TRUTH, Align.SIM3).scale, rel=1e-9)
    assert ate_m(moved(ESTIMATE, turn, shift, scale), Align.SIM3) == pytest.approx(
        ate_m(ESTIMATE, Align.SIM3), abs=1e-9
    )


@given(TURNS, SHIFTS, SCALES)
def test_a_moved_truth_is_brought_back(turn: Vector, shift: Vector, scale: float) -> None:
    found = alignment(moved(TRUTH, turn, shift, scale), TRUTH, Align.SIM3).of(moved(TRUTH, turn, shift, scale))

    assert found.positions_m == pytest.approx(TRUTH.positions_m, abs=1e-8)
    assert found.rotations == pytest.approx(TRUTH.rotations, abs=1e-8)


@given(st.integers(0, 1000), TURNS, SHIFTS)
def test_nothing_is_closer_than_what_is_found(seed: int, turn: Vector, shift: Vector) -> None:
    estimate = estimate_of(TRUTH, seed, noise_m=0.3)
    other = moved(estimate, turn, shift)
    best, unscaled, none = (np.sum(ate_m(estimate, align) ** 2) for align in (Align.SIM3, Align.SE3, Align.NONE))

    assert best <= unscaled + 1e-9
    assert unscaled <= none + 1e-9
    assert unscaled <= np.sum(ate_m(other, Align.NONE) ** 2) + 1e-9


def test_without_alignment_a_shift_is_an_error() -> None:
    shifted = moved(TRUTH, (0, 0, 0), (3, 0, 4))

    assert ate_m(shifted, Align.NONE) == pytest.approx(np.full(len(TRUTH), 5.0))
    assert ate_m(shifted, Align.SE3) == pytest.approx(np.zeros(len(TRUTH)), abs=1e-12)


def test_a_mirror_image_is_not_aligned_by_mirroring() -> None:
    mirrored = Trajectory(TRUTH.positions_m * (1, 1, -1), TRUTH.rotations)
    found = alignment(mirrored, TRUTH, Align.SE3)

    assert np.linalg.det(found.rotation) == pytest.approx(1)
    assert ate_m(mirrored, Align.SE3).max() > 0.01


@pytest.mark.parametrize("points", [np.zeros((4, 3)), np.outer(np.arange(4.0), (1, 2, 2)), np.eye(3)[:1]])
def test_points_in_a_line_or_in_one_place_are_aligned_too(points: Floats) -> None:
    found = umeyama(points, points + np.array([1, 2, 3]), with_scale=True)

    assert found.rotation @ found.rotation.T == pytest.approx(np.eye(3))
    assert found.scale * points @ found.rotation.T + found.translation_m == pytest.approx(points + np.array([1, 2, 3]))


def test_a_scale_needs_no_motion() -> None:
    assert umeyama(np.zeros((3, 3)), np.eye(3), with_scale=True).scale == 1.0
