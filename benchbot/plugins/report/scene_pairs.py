"""Two sets of results side by side, scene by scene: simulated and real, driven and replayed.

No test: two robots in one room are two conditions of one place, not a sample of places. It is said how far apart they
are, and whether they order solutions alike.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.plugins.report.result_sets import ResultSet

Document = dict[str, Any]
FEWEST_SOLUTIONS = 3
"""Two solutions are ordered alike or not; a rank correlation of two says no more than that."""


def solutions_of(one: Path, other: Path) -> list[str]:
    """Return the names of the folders that two folders of results have in common, each of a solution; none for one.

    The folder of a batch of several solutions is such a folder, `results/NAME`.
    """
    if not (one.is_dir() and other.is_dir()) or any(one.glob("*.json")) or any(other.glob("*.json")):
        return []
    return sorted(
        folder.name
        for folder in one.iterdir()
        if folder.is_dir() and (other / folder.name).is_dir() and not folder.name.startswith(".")
    )


def scene_pairs(
    names: tuple[str, str], pairs: Mapping[str, tuple[ResultSet, ResultSet]], evaluator: Evaluator, score: str
) -> Document:
    """Return the table of two sets, of one solution or more, and how alike they order these.

    The score of a scene is combined over its results, whatever their seeds. `difference` is the first set's minus the
    second's. Raises BenchbotError when there is no scene in both.
    """
    rows: list[Document] = []
    only: dict[str, list[str]] = {name: [] for name in names}
    for solution, sets in pairs.items():
        a, b = (_by_scene(one, evaluator, score) for one in sets)
        for name, mine, theirs in ((names[0], a, b), (names[1], b, a)):
            only[name] += [_named(solution, scene) for scene in sorted(mine.keys() - theirs.keys())]
        rows += [
            {
                "solution": solution,
                "scene": scene,
                "a": a[scene][0],
                "b": b[scene][0],
                "difference": a[scene][0] - b[scene][0],
                "results": [a[scene][1], b[scene][1]],
            }
            for scene in sorted(a.keys() & b.keys())
        ]
    if not rows:
        raise BenchbotError(
            f"'{names[0]}' and '{names[1]}' have no scene in common.",
            "; ".join(f"Only in {name}: {', '.join(scenes) or 'nothing'}" for name, scenes in only.items()) + ".",
            "Run both in the same environments.",
        )
    return {
        "paired_by": "scene",
        "a": names[0],
        "b": names[1],
        "score": score,
        "rows": rows,
        "mean_absolute_difference": math.fsum(abs(row["difference"]) for row in rows) / len(rows),
        "only": only,
        "ranks": _ranks(rows),
    }


def _by_scene(results: ResultSet, evaluator: Evaluator, score: str) -> dict[str, tuple[float, int]]:
    """Return the score of each scene and the number of its results; scenes without a score are left out."""
    found: dict[str, list[Document]] = {}
    for row in results.rows:
        if row["environment"]:
            found.setdefault(str(row["environment"]), []).append(row["scores"])
    combined = {scene: evaluator.combine(scores).get(score, math.nan) for scene, scores in found.items()}
    return {scene: (value, len(found[scene])) for scene, value in combined.items() if math.isfinite(value)}


def _ranks(rows: Sequence[Document]) -> Document | None:
    """Return how alike both sets order the solutions, by their means over the scenes that all of them have.

    None for fewer than three solutions. A correlation is None where a set has the same score for all of them.
    """
    solutions = list(dict.fromkeys(row["solution"] for row in rows))
    if len(solutions) < FEWEST_SOLUTIONS:
        return None
    from scipy import stats

    scenes = set.intersection(*({row["scene"] for row in rows if row["solution"] == one} for one in solutions))
    if not scenes:
        return None
    means = {
        one: [
            math.fsum(row[side] for row in rows if row["solution"] == one and row["scene"] in scenes) / len(scenes)
            for side in ("a", "b")
        ]
        for one in solutions
    }
    a, b = zip(*means.values(), strict=True)
    found: Document = {"solutions": len(solutions), "scenes": sorted(scenes), "means": means}
    if len(set(a)) == 1 or len(set(b)) == 1:
        return {**found, "kendall_tau": None, "kendall_p": None, "spearman_rho": None}
    tau = stats.kendalltau(a, b)
    # Without its p-value, which SciPy takes from a distribution for many: of three that agree it says 0.
    rho = stats.spearmanr(a, b).statistic
    return {
        **found,
        "kendall_tau": float(tau.statistic),
        "kendall_p": float(tau.pvalue),
        "spearman_rho": float(rho),
    }


def _named(solution: str, scene: str) -> str:
    return f"{solution}, {scene}" if solution else scene
