"""What intervals of 95 % cover where the truth is known, by method, and how long they take.

Places have five results each, or 2 to 6 (`unequal`): `normal` scores, `skewed` low ones, scores `high` in their range,
`failed` ones among them (15 % zeros), and `binary` success; `extreme` places score near zero but for a few.
A cell is the coverage in per cent and the mean width. `percentile` and `t` are the bootstraps that one would take
first: draws of places, without and with a standard error; `expanded` is Hesterberg's percentile interval.
"""

import argparse
import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from benchbot.evaluation import intervals
from benchbot.plugins.report import comparison
from benchbot.plugins.report.result_sets import ResultSet
from benchbot.plugins.report.significance import sign_flip
from benchbot_eval_omq import omq
from benchbot_eval_omq.plugin import benchbot_evaluators

Array = NDArray[np.float64]
Ends = tuple[float, float]
DRAWS = 999


def results(kind: str, sizes: NDArray[np.int64], random: np.random.Generator) -> list[Array]:
    """Return the scores of the results in each place."""
    levels = {
        "normal": lambda: random.normal(0.5, 0.12, len(sizes)),
        "skewed": lambda: random.beta(2, 5, len(sizes)),
        "high": lambda: random.beta(8, 2, len(sizes)),
        "failed": lambda: random.beta(5, 4, len(sizes)),
        "binary": lambda: random.beta(7, 3, len(sizes)),
        "extreme": lambda: random.beta(0.5, 3, len(sizes)),
    }[kind]()
    level = np.repeat(levels, sizes)
    if kind == "normal":
        scores = level + random.normal(0, 0.08, len(level))
    elif kind == "binary":
        scores = (random.random(len(level)) < level).astype(float)
    else:
        scores = random.beta(20 * level + 1e-3, 20 * (1 - level) + 1e-3)
    if kind == "failed":
        scores *= random.random(len(level)) >= 0.15
    return np.split(scores, np.cumsum(sizes)[:-1])


def truth(kind: str) -> float:
    """Return the score that unlimited places would give."""
    numbers = np.concatenate(results(kind, np.ones(400_000, np.int64), np.random.default_rng(99)))
    return float(numbers.mean())


def bootstraps(statistic: intervals.Linear) -> dict[str, Ends]:
    """Return the interval of each method."""
    random = np.random.default_rng(intervals.SEED)
    count = len(statistic.sums)
    draws = random.multinomial(count, np.full(count, 1 / count), DRAWS)
    totals = draws @ statistic.sizes
    values = draws @ statistic.sums / totals
    t = stdtrit(count - 1, 0.975)
    tail = NormalDist().cdf(-t * (count / (count - 1)) ** 0.5)
    squares = (draws * (statistic.sums - values[:, None] * statistic.sizes) ** 2).sum(axis=1)
    errors = np.sqrt(count / (count - 1) * squares) / totals
    with np.errstate(divide="ignore", invalid="ignore"):
        studentised = np.nan_to_num((values - statistic.value) / errors, nan=0.0, posinf=1e9, neginf=-1e9)
    low, high = np.quantile(studentised, [0.025, 0.975]) * statistic.standard_error
    interval = intervals.limits(statistic, draws=DRAWS)
    return {
        "percentile": tuple(np.quantile(values, [0.025, 0.975])),
        "expanded": tuple(np.quantile(values, [tail, 1 - tail])),
        "t": (statistic.value - high, statistic.value - low),
        "benchbot": (interval["low"], interval["high"]),
    }


def coverage(kind: str, count: int, *, unequal: bool, samples: int) -> dict[str, Any]:
    """Return how often each method's interval holds the truth, and its mean width, ends kept within [0, 1]."""
    random = np.random.default_rng([count, unequal])
    true_score = truth(kind)
    held: dict[str, int] = {}
    widths: dict[str, float] = {}
    for _ in range(samples):
        sizes = random.integers(2, 7, count) if unequal else np.full(count, 5)
        clusters = [list(scores) for scores in results(kind, sizes, random)]
        statistic = intervals.linear(clusters, lambda drawn: {"score": sum(drawn) / len(drawn)})["score"]
        for method, ends in bootstraps(statistic).items():
            low, high = np.clip(ends, 0, 1)
            held[method] = held.get(method, 0) + bool(low <= true_score <= high)
            widths[method] = widths.get(method, 0.0) + float(high - low)
    return {
        "places": kind,
        "count": count,
        "sizes": "unequal" if unequal else "equal",
        **{method: {"covered": held[method] / samples, "width": widths[method] / samples} for method in held},
    }


def false_alarms(similarity: float, samples: int) -> dict[str, float]:
    """Return how often sets that are alike are told apart at p < 0.05, in ten places of five variants each.

    `similarity` is the share of the differences' variance that variants of a place have in common.
    """
    random = np.random.default_rng(7)
    places = environments = 0
    for _ in range(samples):
        of_places = random.normal(0, similarity**0.5, (10, 1))
        differences = of_places + random.normal(0, (1 - similarity) ** 0.5, (10, 5))
        places += sign_flip(list(differences.sum(axis=1))).p < 0.05
        environments += sign_flip(list(differences.ravel()), draws=1_999).p < 0.05
    return {"similarity": similarity, "places": places / samples, "environments": environments / samples}


def seconds(call: Callable[[], object]) -> float:
    """Return the CPU time of a call, the least of two."""
    times = []
    for _ in range(2):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def timings() -> list[dict[str, float]]:
    """Return what an interval and a comparison take, at numbers of results."""
    table: list[dict[str, float]] = []
    (evaluator,) = benchbot_evaluators()
    for places, variants in ((5, 5), (25, 1), (25, 40), (100, 40)):
        sets = [_result_set(name, places, variants, seed) for seed, name in enumerate("ab")]
        rows = sets[0].rows
        table.append(
            {
                "places": places,
                "results": len(rows),
                "interval_s": seconds(partial(intervals.of_rows, rows, evaluator.combine)),
                "comparison_s": seconds(partial(comparison.compare, sets, evaluator)),
            }
        )
    return table


def _result_set(name: str, places: int, variants: int, seed: int) -> ResultSet:
    scores = results("high", np.full(places, variants), np.random.default_rng(seed))
    rows: list[dict[str, Any]] = [
        {
            "source": None,
            "environment": f"place{place}:{variant}",
            "scores": dict.fromkeys(
                ("OMQ", "avg_pairwise", "avg_label", "avg_spatial", "avg_fp_quality"), float(score)
            ),
            "ground_truths": [],
            "failure": None,
            "provenance": None,
        }
        for place, of_place in enumerate(scores)
        for variant, score in enumerate(of_place)
    ]
    document = {
        "method": {"name": "omq", "version": "1.0", "headline": "OMQ"},
        "task_details": {"name": "benchmark"},
        "scores": omq.combine([row["scores"] for row in rows]),
        "rows": rows,
        "coverage": {"expected": len(rows), "scored": len(rows), "missing": []},
    }
    return ResultSet(name, document)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, metavar="PATH", help="also write the tables to this file")
    parser.add_argument("--samples", type=int, default=100, help="2000 for the table in docs/statistics.md")
    arguments = parser.parse_args()
    times = timings()
    print(f"{'places':>8} {'results':>8} {'interval':>12} {'comparison':>12}")
    for taken in times:
        numbers = f"{taken['places']:>8} {taken['results']:>8}"
        print(f"{numbers} {taken['interval_s']:>10.3f} s {taken['comparison_s']:>10.3f} s", flush=True)
    alarms = [false_alarms(similarity, arguments.samples) for similarity in (0.0, 0.2, 0.5)]
    print(f"\n{'alike':>8} {'false alarms over places':>26} {'over environments':>18}")
    for alarm in alarms:
        print(f"{alarm['similarity']:>8} {alarm['places']:>26.3f} {alarm['environments']:>18.3f}", flush=True)
    print(f"\n{'places':>14} {'sizes':>8}" + "".join(f"{name:>14}" for name in bootstraps(_example())))
    table = []
    for kind in ("normal", "skewed", "high", "failed", "binary", "extreme"):
        for count in (5, 10, 25):
            for unequal in (False, True):
                row = coverage(kind, count, unequal=unequal, samples=arguments.samples)
                cells = "".join(
                    f"{100 * cell['covered']:>7.1f} ({cell['width']:.2f})"
                    for cell in row.values()
                    if isinstance(cell, dict)
                )
                print(f"{kind:>10} {count:>3} {row['sizes']:>8}{cells}", flush=True)
                table.append(row)
    if arguments.json:
        document = {"coverage": table, "false_alarms": alarms, "times": times}
        arguments.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _example() -> intervals.Linear:
    return intervals.linear([[0.0], [1.0], [0.5]], lambda drawn: {"score": sum(drawn) / len(drawn)})["score"]


if __name__ == "__main__":
    main()
