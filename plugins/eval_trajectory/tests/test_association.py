"""Association by time: the closest first, none twice."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_eval_trajectory.association import associate

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
    ours, theirs = associate(np.array(left, float), np.array(right, float), most)

    differences = sorted(abs(left[i] - right[j]) for i, j in expected)
    assert sorted(abs(left[i] - right[j]) for i, j in zip(ours, theirs, strict=True)) == differences
    assert len(set(ours)) == len(set(theirs)) == len(ours)


def test_the_closest_go_together_first() -> None:
    ours, theirs = associate(np.array([0.0, 1.0, 1.008]), np.array([0.004, 1.007, 5.0]))

    assert list(zip(ours, theirs, strict=True)) == [(0, 0), (2, 1)]


def test_what_is_displaced_takes_the_next_best() -> None:
    ours, theirs = associate(np.array([1.000, 1.002]), np.array([1.003, 1.009]))

    assert list(zip(ours, theirs, strict=True)) == [(0, 1), (1, 0)]


@pytest.mark.parametrize(("times", "others"), [([], [1.0]), ([1.0], []), ([1.0], [2.0])])
def test_nothing_may_belong_together(times: list[float], others: list[float]) -> None:
    ours, theirs = associate(np.array(times), np.array(others))

    assert len(ours) == len(theirs) == 0
