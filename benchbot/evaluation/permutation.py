"""Paired permutation tests: how often a difference as large would come about if the two sets were alike.

If they were, each cluster's difference could as well have had the other sign (Efron and Tibshirani 1993, §15; Ernst
2004). All arrangements of signs are tried when they are few, which is exact, else some drawn at random, among which
the one that was observed counts (Phipson and Smyth 2010), so that no p-value is ever zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass

MOST_ARRANGEMENTS = 2**16
DRAWS = 99_999
_BLOCK = 2**12


@dataclass(frozen=True)
class Outcome:
    """The two-sided p-value, from how many arrangements, and whether these are all that there are."""

    p: float
    arrangements: int
    exact: bool


def sign_flip(differences: Sequence[float], *, draws: int = DRAWS, seed: int = 0) -> Outcome:
    """Test whether the differences of clusters sum to zero. Needs one at least."""
    import numpy as np

    values = np.asarray(differences, float)
    count = len(values)
    observed = abs(values.sum()) - 1e-12 * abs(values).sum()
    exact = 2**count <= MOST_ARRANGEMENTS
    if exact:
        signs = 1 - 2 * (np.arange(2**count)[:, None] >> np.arange(count) & 1)
        return Outcome(float((abs(signs @ values) >= observed).mean()), 2**count, exact=True)
    random = np.random.default_rng(seed)
    as_large = 0
    for start in range(0, draws, _BLOCK):
        signs = 1 - 2 * random.integers(0, 2, (min(_BLOCK, draws - start), count), dtype=np.int8)
        as_large += int((abs(signs @ values) >= observed).sum())
    return Outcome((as_large + 1) / (draws + 1), draws + 1, exact=False)


def smallest_p(differences: Sequence[float]) -> float:
    """Return the smallest p-value that these clusters can reach, were they to differ in one direction."""
    return float(min(1.0, 2.0 ** (1 - sum(value != 0 for value in differences))))


def holm(p_values: Sequence[float]) -> list[float]:
    """Return the p-values adjusted for being several (Holm 1979), in order."""
    count = len(p_values)
    adjusted = [1.0] * count
    largest = 0.0
    for rank, place in enumerate(sorted(range(count), key=lambda index: p_values[index])):
        largest = max(largest, min(1.0, (count - rank) * p_values[place]))
        adjusted[place] = largest
    return adjusted
