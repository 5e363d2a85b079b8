"""How often an interval of 95 % holds what it should, where the truth is known: places that differ, some with failures.

`python -m benchmarks intervals` shows more kinds of places, and other methods beside.
"""

import numpy as np
import pytest

from benchbot.evaluation import intervals

SHARE_FAILED = 0.15
TRUTH = 5 / 9 * (1 - SHARE_FAILED)


def places(random: np.random.Generator, count: int) -> list[list[float]]:
    """Return the scores of 2 to 6 results in each place, that vary between places and within, some zero."""
    levels = random.beta(5, 4, count)
    sizes = random.integers(2, 7, count)
    return [
        list(random.beta(20 * level, 20 * (1 - level), size) * (random.random(size) >= SHARE_FAILED))
        for level, size in zip(levels, sizes, strict=True)
    ]


def coverage(count: int, samples: int) -> float:
    random = np.random.default_rng(count)
    held = 0
    for _ in range(samples):
        found = intervals.linear(places(random, count), lambda drawn: {"score": sum(drawn) / len(drawn)})["score"]
        interval = intervals.limits(found, draws=499)
        held += interval["low"] <= TRUTH <= interval["high"]
    return held / samples


def test_an_interval_of_95_percent_holds_the_truth_about_as_often() -> None:
    assert 0.91 <= coverage(8, 200) <= 0.99


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, 10, 25])
def test_an_interval_of_95_percent_holds_the_truth_in_93_to_97_of_100_samples(count: int) -> None:
    assert 0.93 <= coverage(count, 2000) <= 0.97
