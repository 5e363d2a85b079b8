"""What a comparison comes to, in a word and in a sentence that can be quoted."""

import math
from dataclasses import dataclass
from enum import StrEnum

from benchbot.evaluation.intervals import LEVEL, Over, counted

ALPHA = 0.05
"""How often, at most, sets that are alike may be told apart by mistake."""


class Verdict(StrEnum):
    """What is known about the difference of two sets."""

    HIGHER = "higher"
    LOWER = "lower"
    EQUAL = "equal"
    UNDECIDED = "undecided"
    TOO_FEW = "too_few"


@dataclass(frozen=True)
class Finding:
    """What was found about `a` minus `b`, one of several comparisons; `p` and `reachable_p` are adjusted for these.

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
        """What may be said: that one scores higher only when the test says so."""
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
                return (
                    f"{self._sample} cannot tell {self.a} and {self.b} apart: {minus} {self._evidence()}. "
                    f"So few give no p below {_p(self.reachable_p)}; {self._needed} {self.over} or more can."
                )
            case Verdict.UNDECIDED:
                return f"{self.a} and {self.b} are not told apart: {minus} {self._evidence()}.{self._power}"

    def _told_apart(self, higher: str, lower: str, sign: int) -> str:
        by = self._written(sign * self.difference)
        if self.lower_is_better:
            return f"{lower} is better than {higher}: its {self.score} is lower by {by} ({self._basis(sign)})."
        return f"{higher} scores higher than {lower} by {by} {self._evidence(sign)}."

    @property
    def _sample(self) -> str:
        return f"{self.pairs} pair{'s' * (self.pairs != 1)} of results in {counted(self.clusters, self.over)}"

    @property
    def _needed(self) -> int:
        """How many clusters can reach a p-value below ALPHA, the smallest of n being 2 to the power of 1 - n."""
        return 2 + math.floor(math.log2(self.comparisons / ALPHA))

    @property
    def _power(self) -> str:
        if self.detectable is None:
            return ""
        return f" A difference of {self._written(self.detectable)} would have been found four times out of five."

    def _evidence(self, sign: int = 1) -> str:
        return f"{self.score} ({self._basis(sign)})"

    def _basis(self, sign: int) -> str:
        parts = []
        if self.interval is not None:
            low, high = sorted(sign * end for end in self.interval)
            parts.append(f"{100 * LEVEL:g} % interval {self._written(low)} to {self._written(high)}")
        parts.append(f"paired permutation test over {self._sample}, p {_equals(self.p)}")
        if self.comparisons > 1:
            parts.append(f"adjusted for {self.comparisons} comparisons by Holm's method")
        return ", ".join(parts)

    def _written(self, value: float) -> str:
        """Return a number with two digits of the interval's half width, or of the difference when there is none."""
        scale = abs(self.difference) if self.interval is None else (self.interval[1] - self.interval[0]) / 2
        digits = min(max(1 - math.floor(math.log10(scale)), 0), 6) if scale > 0 else 2
        return f"{value:.{digits}f}".replace("-", "−")


def _p(p: float) -> str:
    return f"{p:.3g}"


def _equals(p: float) -> str:
    return "< 0.0001" if p < 0.0001 else f"= {_p(p)}"
