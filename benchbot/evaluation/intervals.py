"""Confidence intervals of combined scores: how far these may be from the scores that other places would give.

The places are a sample of those that a method might meet; the variants of a place, and the seeds and repeats in each,
are measurements within it and resemble one another. So places are drawn, each with all its results (Davison and Hinkley
1997, §3.8; Field and Welsh 2007): counting variants as places would promise more than was learnt.

With few places the percentile bootstrap is too narrow (Hesterberg 2015), and the bootstrap-t with multinomial draws
needlessly wide, or infinite. Here places get random weights, beta(1/2, 3/2), in a bootstrap-t (Owen 2025,
arXiv:2508.10083), and the standard error is the jackknife's (Efron and Tibshirani 1993, §11). docs/statistics.md shows
its coverage.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from benchbot.core import overrides
from benchbot.core.records import Score
from benchbot.evaluation.result_document import NUMBERS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from benchbot.core.records import Combine

LEVEL = 0.95
DRAWS = 9_999
SEED = 0
FEWEST_CLUSTERS = 5
"""With fewer, how much places differ is hardly known: no interval is better than a wrong one."""

_CHECKS = 20
_TOLERATED_ERROR = 0.25
_BLOCK = 1_000
_UNKNOWN = Score()

Document = dict[str, Any]
Item = TypeVar("Item")
Statistic = Callable[[Sequence[Item]], Mapping[str, float]]


class Over(StrEnum):
    """The clusters: the units that are drawn as a sample of many, and whose signs are flipped."""

    PLACES = "places"
    ENVIRONMENTS = "environments"

    def unit(self, environment: str | None) -> str:
        """Return the unit of an environment string; rows of no known environment are one unit together."""
        text = environment or ""
        return text.partition(":")[0] if self is Over.PLACES else text


@dataclass(frozen=True)
class Linear:
    """A statistic of clusters, as Σ w·sum / Σ w·size when cluster i counts wᵢ times; exact for a mean.

    `error` says how far that is off when clusters are really drawn: root mean square, in standard errors.
    """

    value: float
    sums: "NDArray[Any]"
    sizes: "NDArray[Any]"
    standard_error: float
    error: float

    @property
    def varies(self) -> bool:
        """Say whether the clusters differ at all, beyond rounding."""
        scale = float(abs(self.sums / self.sizes).max())
        return self.standard_error > 1e-12 * scale

    @property
    def is_usable(self) -> bool:
        """Say whether the statistic is close enough to a mean for an interval."""
        return self.error <= _TOLERATED_ERROR


def of_rows(
    rows: Sequence[Document],
    combine: "Combine",
    *,
    over: Over = Over.PLACES,
    scores: Mapping[str, Score] = MappingProxyType({}),
) -> Document:
    """Return `{"intervals": …, "statistics": …}` of a scores document whose combined scores are `combine` of its rows.

    `rows` are all that count, what is missing among them (`scores` is empty). Their order does not matter. A score has
    no interval (None) when there are fewer than five clusters, when all give the same, and when the method's summary
    is far from a mean; the note says so. A score keeps to its bounds in `scores`; one without, whose rows all lie in
    [0, 1], or above 0, keeps to that.
    """
    clusters = grouped(sorted(rows, key=_canonical), lambda row: row["environment"], over)
    names = list(combine([row["scores"] for row in rows]))
    intervals: dict[str, Document | None] = dict.fromkeys(names)
    if len(clusters) < FEWEST_CLUSTERS:
        note = f"The results are of {counted(len(clusters), over)}; an interval needs {FEWEST_CLUSTERS} or more."
        if len(grouped(rows, lambda row: row["environment"], Over.ENVIRONMENTS)) >= FEWEST_CLUSTERS:
            note += f" --over {Over.ENVIRONMENTS} gives one that speaks of other variants of just these places."
        return {"intervals": intervals, "statistics": _statistics(None, len(clusters), note)}
    found = linear(clusters, lambda drawn: combine([row["scores"] for row in drawn]))
    notes = []
    for name in names:
        # First: where nothing but rounding varies, nothing is close to it.
        if name in found and not found[name].varies:
            notes.append(f"{name}: no interval, all {over} give the same.")
        elif name not in found or not found[name].is_usable:
            notes.append(f"{name}: no interval, its summary is not close to a mean.")
        else:
            values = [row["scores"][name] for row in rows if name in row["scores"]]
            intervals[name] = limits(found[name], bounds(values, scores.get(name, _UNKNOWN)))
    return {
        "intervals": intervals,
        "statistics": _statistics(f"bootstrap-t over {over}", len(clusters), " ".join(notes) or None),
    }


def grouped(items: Sequence[Item], environment: Callable[[Item], str | None], over: Over) -> list[list[Item]]:
    """Return the items by cluster, in the order of the clusters' names."""
    groups: dict[str, list[Item]] = {}
    for item in items:
        groups.setdefault(over.unit(environment(item)), []).append(item)
    return [groups[name] for name in sorted(groups)]


def linear(clusters: Sequence[Sequence[Item]], statistic: Statistic[Item]) -> dict[str, Linear]:
    """Return the statistic's scores as functions of the clusters, from what they are without each cluster in turn.

    Needs two clusters. A score that is undefined without some cluster is left out.
    """
    import numpy as np

    count = len(clusters)
    draws = np.random.default_rng(SEED).multinomial(count, np.full(count, 1 / count), _CHECKS)
    whole = statistic([item for cluster in clusters for item in cluster])
    without = [
        statistic([item for other, cluster in enumerate(clusters) if other != left_out for item in cluster])
        for left_out in range(count)
    ]
    drawn = [
        statistic([item for cluster, times in zip(clusters, draw, strict=True) for item in list(cluster) * int(times)])
        for draw in draws
    ]
    sizes = np.array([len(cluster) for cluster in clusters], float)
    found = {}
    for name, value in whole.items():
        if not all(math.isfinite(scores.get(name, math.nan)) for scores in (whole, *without, *drawn)):
            continue
        others = np.array([scores[name] for scores in without])
        sums = value * sizes.sum() - others * (sizes.sum() - sizes)
        standard_error = float(np.sqrt((count - 1) / count * ((others - value) ** 2).sum()))
        misses = np.array([scores[name] for scores in drawn]) - draws @ sums / (draws @ sizes)
        error = float(np.sqrt((misses**2).mean())) / standard_error if standard_error else 0.0
        found[name] = Linear(value, sums, sizes, standard_error, error)
    return found


def limits(statistic: Linear, within: tuple[float, float] = (-math.inf, math.inf), *, draws: int = DRAWS) -> Document:
    """Return `{low, high, level}` of the bootstrap-t interval, kept within bounds."""
    import numpy as np

    random = np.random.default_rng(SEED)
    count = len(statistic.sums)
    studentised = []
    for start in range(0, draws, _BLOCK):
        weights = random.beta(0.5, 1.5, (min(_BLOCK, draws - start), count))
        weights *= count / weights.sum(axis=1, keepdims=True)
        totals = weights @ statistic.sizes
        values = weights @ statistic.sums / totals
        residuals = statistic.sums - values[:, None] * statistic.sizes
        errors = np.sqrt(count / (count - 1) * (weights * residuals**2).sum(axis=1)) / totals
        studentised.append((values - statistic.value) / np.maximum(errors, np.finfo(float).tiny))
    below, above = np.quantile(np.concatenate(studentised), [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    low = float(statistic.value - above * statistic.standard_error)
    high = float(statistic.value - below * statistic.standard_error)
    return {"low": max(low, within[0]), "high": min(high, within[1]), "level": LEVEL}


def bounds(values: Sequence[float], score: Score = _UNKNOWN) -> tuple[float, float]:
    """Return the bounds of a score, infinite ones among them.

    Of a score that says none: [0, 1] when all values are in it, else [0, ∞) when none is negative, else all numbers.
    """
    if score.least is not None or score.greatest is not None:
        return (
            -math.inf if score.least is None else score.least,
            math.inf if score.greatest is None else score.greatest,
        )
    if any(value < 0 for value in values):
        return -math.inf, math.inf
    return 0.0, 1.0 if all(value <= 1 for value in values) else math.inf


def counted(number: int, over: Over) -> str:
    """Return a number of units in words: `1 place`, `5 places`."""
    return f"{number} {over if number != 1 else over.removesuffix('s')}"


def _canonical(row: Document) -> str:
    """Return a text by which rows sort: where one was read from, and when, does not matter."""
    about = [row.get(name) for name in NUMBERS] + [overrides.label(row.get("settings") or {})]
    return repr((row["environment"], about, sorted(row["scores"].items())))


def _statistics(method: str | None, clusters: int, note: str | None) -> Document:
    drawn = method is not None
    return {
        "method": method,
        "clusters": clusters,
        "draws": DRAWS if drawn else 0,
        "seed": SEED if drawn else None,
        "note": note,
    }
