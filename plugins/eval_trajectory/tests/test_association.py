"""Association by time: the closest first, none twice."""

import itertools
from typing import Any

import numpy as np
import pytest
from evo.core.sync import associate_trajectories
from evo.core.trajectory import PoseTrajectory3D
from hypothesis import given
from hypothesis import strategies as st

from benchbot_eval_trajectory.association import Association, associate

TIMES = st.lists(st.integers(0, 400), unique=True, max_size=30).map(sorted)


def greedy(times: list[int], others: list[int], most: int) -> list[tuple[int, int]]:
    """The rule as the benchmark states it: all pairs, by difference, each pose once."""
    numbered = itertools.product(enumerate(times), enumerate(others))
    pairs = sorted((abs(a - b), a + b, i, j) for (i, a), (j, b) in numbered if abs(a - b) <= most)
    found: list[tuple[int, int]] = []
    for _, _, i, j in pairs:
        if all(i != taken and j != other for taken, other in found):
            found.append((i, j))
    return sorted(found)


@given(TIMES, TIMES, st.integers(0, 50))
def test_it_is_the_rule_of_the_benchmark(times: list[int], others: list[int], most: int) -> None:
    # Odd against even and quartered: differences repeat, but which of two goes first is never open.
    left = [4 * time for time in times]
    right = [4 * time + 1 + 2 * (number % 2) for number, time in enumerate(others)]
    expected = greedy(left, right, most)
    ours, theirs = associate(np.array(left, float), np.array(right, float), most, Association.TUM)

    differences = sorted(abs(left[i] - right[j]) for i, j in expected)
    assert sorted(abs(left[i] - right[j]) for i, j in zip(ours, theirs, strict=True)) == differences
    assert len(set(ours)) == len(set(theirs)) == len(ours)


SOME_TIMES = st.lists(st.integers(0, 60), min_size=1, max_size=30).map(sorted)


@given(SOME_TIMES, SOME_TIMES, st.integers(1, 20))
def test_it_is_the_rule_of_evo(times: list[int], others: list[int], most: int) -> None:
    estimate, truth = np.array(times, float), np.array(others, float)

    ours, theirs = associate(estimate, truth, most)

    if not len(ours):
        assert all(abs(a - b) > most for a in times for b in others)
        return
    found_truth, found = associate_trajectories(_evo_trajectory(truth), _evo_trajectory(estimate), max_diff=most)
    assert (found.positions_xyz[:, 0].tolist(), found_truth.positions_xyz[:, 0].tolist()) == (
        ours.tolist(),
        theirs.tolist(),
    )


def _evo_trajectory(times_s: np.ndarray[Any, Any]) -> PoseTrajectory3D:
    """A trajectory whose poses have their numbers for x."""
    numbers = np.arange(len(times_s), dtype=float)
    positions = np.stack([numbers, 0 * numbers, 0 * numbers], axis=1)
    return PoseTrajectory3D(positions, np.tile([1.0, 0, 0, 0], (len(times_s), 1)), times_s)


def test_the_closest_go_together_first() -> None:
    ours, theirs = associate(np.array([0.0, 1.0, 1.008]), np.array([0.004, 1.007, 5.0]), rule=Association.TUM)

    assert list(zip(ours, theirs, strict=True)) == [(0, 0), (2, 1)]


def test_what_is_displaced_takes_the_next_best() -> None:
    ours, theirs = associate(np.array([1.000, 1.002]), np.array([1.003, 1.009]), rule=Association.TUM)

    assert list(zip(ours, theirs, strict=True)) == [(0, 1), (1, 0)]


@pytest.mark.parametrize("rule", list(Association))
@pytest.mark.parametrize(("times", "others"), [([], [1.0]), ([1.0], []), ([1.0], [2.0])])
def test_nothing_may_belong_together(times: list[float], others: list[float], rule: Association) -> None:
    ours, theirs = associate(np.array(times), np.array(others), rule=rule)

    assert len(ours) == len(theirs) == 0
