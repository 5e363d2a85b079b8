"""Significance of differences between sets of results: paired permutation tests, and the verdict in a sentence.

If two sets were alike, each cluster's difference could as well have had the other sign (Efron and Tibshirani 1993, §15;
Ernst 2004). All arrangements of signs are tried when they are few, which is exact, else some drawn at random, among
which the one that was observed counts (Phipson and Smyth 2010), so that no p-value is ever zero.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from benchbot.evaluation.intervals import LEVEL, Over, counted

ALPHA = 0.05
"""How often, at most, sets that are alike may be told apart by mistake."""
MOST_ARRANGEMENTS = 2**16
DRAWS = 99_999
_BLOCK = 2**12


@dataclass(frozen=True)
class PermutationTest:
    """The two-sided p-value, the number of arrangements behind it, and whether these are all that there are."""

    p: float
    arrangements: int
    exact: bool


def sign_flip(differences: Sequence[float], *, draws: int = DRAWS, seed: int = 0) -> PermutationTest:
    """Test whether the differences of clusters sum to zero. Needs one at least."""
    import numpy as np

    values = np.asarray(differences, float)
    count = len(values)
    observed = abs(values.sum()) - 1e-12 * abs(values).sum()
    exact = 2**count <= MOST_ARRANGEMENTS
    if exact:
        signs = 1 - 2 * (np.arange(2**count)[:, None] >> np.arange(count) & 1)
        return PermutationTest(float((abs(signs @ values) >= observed).mean()), 2**count, exact=True)
    random = np.random.default_rng(seed)
    as_large = 0
    for start in range(0, draws, _BLOCK):
        signs = 1 - 2 * random.integers(0, 2, (min(_BLOCK, draws - start), count), dtype=np.int8)
        as_large += int((abs(signs @ values) >= observed).sum())
    return PermutationTest((as_large + 1) / (draws + 1), draws + 1, exact=False)


def smallest_p(differences: Sequence[float]) -> float:
    """Return the smallest p-value that these clusters can reach, were they to differ in one direction."""
    return float(min(1.0, 2.0 ** (1 - sum(value != 0 for value in differences))))


def holm(p_values: Sequence[float]) -> list[float]:
    """Return the p-values adjusted for being several (Holm 1979), in order."""
    import numpy as np

    p = np.asarray(p_values, float)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)), 1.0)
    return [float(value) for value in adjusted]


class Verdict(StrEnum):
    """The direction of the difference of two sets, as far as it is known."""

    HIGHER = "higher"
    LOWER = "lower"
    EQUAL = "equal"
    UNDECIDED = "undecided"
    TOO_FEW = "too_few"


@dataclass(frozen=True)
class Finding:
    """The test of `a` minus `b`, one of several comparisons; `p` and `reachable_p` are adjusted for these.

    `interval` is that of the difference, `reachable_p` the smallest p-value that so many clusters can give,
    `detectable` the difference that would be found with a probability of 80 %.
    """

    a: str
    b: str
    score: str
    over: Over
    pairs: int
    clusters: int
    equal: bool
    difference: float
    interval: tuple[float, float] | None
    p: float
    reachable_p: float
    detectable: float | None
    comparisons: int = 1
    lower_is_better: bool | None = None

    @property
    def verdict(self) -> Verdict:
        """The direction of the difference, claimed only when the test supports it."""
        if self.equal:
            return Verdict.EQUAL
        if self.reachable_p >= ALPHA:
            return Verdict.TOO_FEW
        if self.p < ALPHA:
            return Verdict.HIGHER if self.difference > 0 else Verdict.LOWER
        return Verdict.UNDECIDED

    @property
    def better(self) -> str | None:
        """The set that is better, None where none is known to be."""
        if self.lower_is_better is None or self.verdict not in (Verdict.HIGHER, Verdict.LOWER):
            return None
        return self.a if (self.verdict is Verdict.LOWER) == self.lower_is_better else self.b

    @property
    def sentence(self) -> str:
        """The verdict with its evidence, to be quoted."""
        minus = f"{self.a} minus {self.b} is {self._written(self.difference)}"
        match self.verdict:
            case Verdict.EQUAL:
                return f"{self.a} and {self.b} have the same {self.score} in each of {self._sample}."
            case Verdict.HIGHER:
                return self._told_apart(self.a, self.b, 1)
            case Verdict.LOWER:
                return self._told_apart(self.b, self.a, -1)
            case Verdict.TOO_FEW:
                # The smallest p-value of n clusters is 2 to the power of 1 - n.
                needed = 2 + math.floor(math.log2(self.comparisons / ALPHA))
                return (
                    f"{self._sample} cannot tell {self.a} and {self.b} apart: {minus} {self._evidence()}. "
                    f"So few give no p below {self.reachable_p:.3g}; {needed} {self.over} or more can."
                )
            case Verdict.UNDECIDED:
                said = f"{self.a} and {self.b} are not told apart: {minus} {self._evidence()}."
                if self.detectable is None:
                    return said
                found = (
                    f"A difference of {self._written(self.detectable)} would have been found four times out of five."
                )
                return f"{said} {found}"

    def _told_apart(self, higher: str, lower: str, sign: int) -> str:
        by = self._written(sign * self.difference)
        if self.lower_is_better:
            return f"{lower} is better than {higher}: its {self.score} is lower by {by} ({self._basis(sign)})."
        return f"{higher} scores higher than {lower} by {by} {self._evidence(sign)}."

    @property
    def _sample(self) -> str:
        return f"{self.pairs} pair{'s' * (self.pairs != 1)} of results in {counted(self.clusters, self.over)}"

    def _evidence(self, sign: int = 1) -> str:
        return f"{self.score} ({self._basis(sign)})"

    def _basis(self, sign: int) -> str:
        parts = []
        if self.interval is not None:
            low, high = sorted(sign * end for end in self.interval)
            parts.append(f"{100 * LEVEL:g} % interval {self._written(low)} to {self._written(high)}")
        p = "< 0.0001" if self.p < 0.0001 else f"= {self.p:.3g}"
        parts.append(f"paired permutation test over {self._sample}, p {p}")
        if self.comparisons > 1:
            parts.append(f"adjusted for {self.comparisons} comparisons by Holm's method")
        return ", ".join(parts)

    def _written(self, value: float) -> str:
        """Return a number with two digits of the interval's half width, or of the difference when there is none."""
        scale = abs(self.difference) if self.interval is None else (self.interval[1] - self.interval[0]) / 2
        digits = min(max(1 - math.floor(math.log10(scale)), 0), 6) if scale > 0 else 2
        return f"{value:.{digits}f}".replace("-", "−")
