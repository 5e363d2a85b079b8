"""Comparing sets of results, pair by pair: differences, their intervals, tests and verdicts."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.records import Evaluator
from benchbot.evaluation import intervals
from benchbot.evaluation.batch_folder import ADDED_TO
from benchbot.evaluation.intervals import Over
from benchbot.evaluation.result_document import listed
from benchbot.evaluation.score import explain
from benchbot.plugins.report import diagnosis, significance
from benchbot.plugins.report.pairing import Pair, label, pair, settings
from benchbot.plugins.report.result_sets import ResultSet
from benchbot.plugins.report.significance import ALPHA, Finding

VERSION = 1
POWER = 0.8

Document = dict[str, Any]


@dataclass(frozen=True)
class Design:
    """The score that is compared, the method that makes it, the clusters, and how results are paired."""

    evaluator: Evaluator
    score: str
    over: Over
    ignore_seeds: bool
    ignore_settings: bool


def compare(
    sets: Sequence[ResultSet],
    evaluator: Evaluator,
    score: str | None = None,
    *,
    over: Over = Over.PLACES,
    ignore_seeds: bool = False,
    ignore_settings: bool = False,
) -> Document:
    """Return the comparison document of all pairs of sets (see its schema).

    `score` is the method's headline unless it is named. Raises BenchbotError for a score that a set does not have, and
    for two sets that have no result in common.
    """
    score = score or str(sets[0].document["method"]["headline"])
    design = Design(evaluator, score, over, ignore_seeds, ignore_settings)
    for results in sets:
        require_score(results, design.score)
    found = [_comparison(a, b, design) for a, b in combinations(sets, 2)]
    adjusted = significance.holm([comparison["p"] for comparison in found])
    comparisons = [_judged(item, p, len(found), design) for item, p in zip(found, adjusted, strict=True)]
    return {
        "version": VERSION,
        "method": {"name": evaluator.name, "version": evaluator.version},
        "task": sets[0].document["task_details"]["name"],
        "score": design.score,
        "lower_is_better": design.evaluator.score(design.score).lower_is_better,
        "over": design.over.value,
        "alpha": ALPHA,
        "power": POWER,
        "sets": [_summary(results, design) for results in sets],
        "comparisons": comparisons,
        "notes": notes_on(sets),
    }


def errors_of(sets: Sequence[ResultSet]) -> Document:
    """Return for each set its kinds of error, the costliest first: how many, what each costs (`errors` of the schema).

    Raises BenchbotError for a set that was given as a scores document, and for a method that does not explain.
    """
    found: Document = {}
    for one in sets:
        if one.evaluation is None:
            raise BenchbotError(
                f"What went wrong in '{one.name}' is not known.",
                "It was given as a scores document, which does not say.",
                "Give the results instead of their scores, or leave --explain out.",
            )
        told = [entry.get("diagnosis", {}) for entry in explain(one.evaluation)["results"]]
        found[one.name] = [asdict(error) for error in diagnosis.errors(told, len(one.rows))]
    return found


def _comparison(a: ResultSet, b: ResultSet, design: Design) -> Document:
    paired = pair(a.rows, b.rows, ignore_seeds=design.ignore_seeds, ignore_settings=design.ignore_settings)
    valued = [(item, _values(item, design)) for item in paired.pairs]
    scored = [(item, values) for item, values in valued if values is not None]
    if not scored:
        raise BenchbotError(
            f"'{a.name}' and '{b.name}' have no result in common.",
            f"'{a.name}' has: {_labels(a)}. '{b.name}' has: {_labels(b)}.",
            "Run both in the same environments with the same seeds and settings, "
            "or compare with --ignore-seeds or --ignore-settings.",
        )
    combine, score = design.evaluator.combine, design.score

    def difference(drawn: Sequence[Pair]) -> dict[str, float]:
        scores_a = combine([item.a["scores"] for item in drawn])
        scores_b = combine([item.b["scores"] for item in drawn])
        return {score: scores_a[score] - scores_b[score]}

    pairs = [item for item, _ in scored]
    clusters = intervals.grouped(pairs, lambda item: item.environment, design.over)
    means = [difference(cluster)[score] for cluster in clusters]
    weighted = [mean * len(cluster) for mean, cluster in zip(means, clusters, strict=True)]
    test = significance.sign_flip(weighted)
    smallest_p = significance.smallest_p(weighted)
    low, high = intervals.bounds([value for _, values in scored for value in values], design.evaluator.score(score))
    interval, detectable = _precision(clusters, difference, score, high - low)
    return {
        "a": a.name,
        "b": b.name,
        "pairs": len(pairs),
        "clusters": len(clusters),
        "difference": difference(pairs)[score],
        "interval": interval,
        "standardised": _standardised(means),
        "p": test.p,
        "arrangements": test.arrangements,
        "exact": test.exact,
        "smallest_p": smallest_p,
        "minimum_detectable": detectable if smallest_p < ALPHA else None,
        "rows": [
            {"pair": item.label, "a": values[0], "b": values[1], "difference": values[0] - values[1]}
            for item, values in scored
        ],
        "unpaired": {
            "a": [label(row) for row in paired.only_a],
            "b": [label(row) for row in paired.only_b],
            "without_score": [item.label for item, values in valued if values is None],
        },
    }


def _judged(comparison: Document, p_holm: float, comparisons: int, design: Design) -> Document:
    """Return the comparison, one of so many, with its verdict and sentence."""
    interval = comparison["interval"]
    finding = Finding(
        a=comparison["a"],
        b=comparison["b"],
        score=design.score,
        over=design.over,
        pairs=comparison["pairs"],
        clusters=comparison["clusters"],
        equal=all(row["difference"] == 0 for row in comparison["rows"]),
        difference=comparison["difference"],
        interval=None if interval is None else (interval["low"], interval["high"]),
        p=p_holm,
        reachable_p=min(1.0, comparison["smallest_p"] * comparisons),
        detectable=comparison["minimum_detectable"],
        comparisons=comparisons,
        lower_is_better=design.evaluator.score(design.score).lower_is_better,
    )
    said = {"verdict": finding.verdict.value, "better": finding.better, "sentence": finding.sentence}
    return {**comparison, "p_holm": p_holm, **said}


def _values(item: Pair, design: Design) -> tuple[float, float] | None:
    """Return the score of each side as the method counts it, None where it gives a missing result none."""
    a, b = (design.evaluator.combine([row["scores"]]).get(design.score, math.nan) for row in (item.a, item.b))
    return (a, b) if math.isfinite(a) and math.isfinite(b) else None


def _precision(
    clusters: Sequence[Sequence[Pair]], difference: intervals.Statistic[Pair], score: str, bound: float
) -> tuple[Document | None, float | None]:
    """Return the interval of the difference, and the difference that 80 % power would find (Bloom 1995)."""
    count = len(clusters)
    if count < intervals.FEWEST_CLUSTERS:
        return None, None
    statistic = intervals.linear(clusters, difference).get(score)
    if statistic is None or not statistic.varies or not statistic.is_usable:
        return None, None
    from scipy.special import stdtrit

    t = stdtrit(count - 1, 1 - ALPHA / 2) + stdtrit(count - 1, POWER)
    return intervals.limits(statistic, (-bound, bound)), float(t * statistic.standard_error)


def _standardised(means: Sequence[float]) -> float | None:
    """Return the mean difference of clusters in standard deviations (Cohen 1988, d_z), None when none vary."""
    count = len(means)
    if count < 2:
        return None
    mean = math.fsum(means) / count
    deviation = math.sqrt(math.fsum((value - mean) ** 2 for value in means) / (count - 1))
    return mean / deviation if deviation > 1e-12 * max(map(abs, means)) else None


def _summary(results: ResultSet, design: Design) -> Document:
    found = intervals.of_rows(results.rows, design.evaluator.combine, over=design.over, scores=design.evaluator.scores)
    coverage = results.document["coverage"]
    return {
        "name": results.name,
        "score": results.document["scores"][design.score],
        "interval": found["intervals"].get(design.score),
        "expected": coverage["expected"],
        "scored": coverage["scored"],
        "failures": results.failures,
    }


def notes_on(sets: Sequence[ResultSet]) -> list[str]:
    """Return the other differences between the sets, which may be the reason."""
    notes = []
    robots = {results.name: ", ".join(results.robots) for results in sets if results.robots}
    if len(set(robots.values())) > 1:
        notes.append(f"The robots differ: {'; '.join(f'{name} on {robot}' for name, robot in robots.items())}.")
    replays = {results.name: f"{results.replays} of {len(results.document['rows'])}" for results in sets}
    if any(results.replays for results in sets):
        notes.append(f"Replays of recordings, nothing was driven: {'; '.join(map(' '.join, replays.items()))}.")
    changed = {results.name: sorted({settings(row) for row in results.rows}) for results in sets}
    if len(set(map(tuple, changed.values()))) > 1:
        said = [f"{name} with {' and '.join(each or 'none' for each in all_)}" for name, all_ in changed.items()]
        notes.append(f"The settings differ (--set): {'; '.join(said)}.")
    warnings = [warning for one in sets for warning in one.document["coverage"].get("warnings", ())]
    return [*notes, *dict.fromkeys(warning for warning in warnings if ADDED_TO in warning)]


def require_score(results: ResultSet, score: str) -> None:
    """Raise BenchbotError when a set has no score of this name."""
    known = list(results.document["scores"])
    if score not in known:
        raise BenchbotError(
            f"'{results.name}' has no score '{score}'.",
            f"It has: {', '.join(known)}.{did_you_mean(score, known)}",
            "Name one of these with --score.",
        )


def _labels(results: ResultSet) -> str:
    return listed(sorted(label(row) for row in results.rows), "; ")
