"""The certificate: scores of a simulator beside those of the reference, and what they say."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any

from benchbot.core.findings import Finding, Level

WITHIN = 0.05
"""The largest difference of a score in a room that still counts as the same, of scores between 0 and 1."""
LEAST_TAU = 0.99


@dataclass(frozen=True)
class Row:
    """One solution in one room: its score in the simulator and in the reference; None where an episode has none."""

    solution: str
    room: str
    score: float | None
    reference: float | None

    @property
    def difference(self) -> float | None:
        """How much higher the score is than the reference's."""
        return None if self.score is None or self.reference is None else self.score - self.reference


@dataclass(frozen=True)
class Certificate:
    """Everything that a certificate tells, in plain data; `score` is the name of what is compared."""

    simulator: str
    robot: str
    reference: str
    task: str
    score: str
    software: Mapping[str, str]
    findings: tuple[Finding, ...]
    rows: tuple[Row, ...]

    @property
    def broken(self) -> tuple[Finding, ...]:
        """The properties of the conformance kit that do not hold."""
        return tuple(one for one in self.findings if one.level is Level.BROKEN)

    @property
    def missing(self) -> tuple[Row, ...]:
        """The rows of which one score or the other is missing."""
        return tuple(row for row in self.rows if row.difference is None)

    @property
    def within(self) -> float | None:
        """The largest difference of a score, None where there is none."""
        found = [abs(row.difference) for row in self.rows if row.difference is not None]
        return max(found, default=None)

    @property
    def tau(self) -> float | None:
        """Kendall's τ-b of the solutions' mean scores in both simulators; None where fewer than two can be ranked."""
        return kendall_tau(self.rows)

    @property
    def problems(self) -> list[str]:
        """The reasons why scores cannot be compared; none where they can."""
        found = []
        if self.broken:
            found.append(f"{len(self.broken)} of {len(self.findings)} properties of the conformance kit do not hold")
        if not self.findings:
            found.append("the conformance kit has checked nothing")
        if self.missing:
            found.append(f"{len(self.missing)} of {len(self.rows)} scores are missing")
        if self.within is None:
            found.append("nothing was scored in both simulators")
        elif self.within > WITHIN:
            found.append(f"a score differs by {self.within:.3f}, more than {WITHIN:g}")
        if self.tau is not None and self.tau < LEAST_TAU:
            found.append(f"solutions are ranked differently (Kendall's tau {self.tau:.2f})")
        return found

    @property
    def statement(self) -> str:
        """The certificate in a sentence."""
        if self.within is None:
            return f"{self.simulator} cannot be compared with {self.reference}: {'; '.join(self.problems)}."
        count = len(_by_solution(self.rows))
        ranks = "" if self.tau is None else f", and ranks {count} solutions with Kendall's tau {self.tau:.2f}"
        rooms = len({row.room for row in self.rows})
        measured = (
            f"{self.simulator} gives the {self.score} of {self.reference} within ±{self.within:.3f} "
            f"in {rooms} {'room' if rooms == 1 else 'rooms'}{ranks}"
        )
        return f"{measured}." if not self.problems else f"{measured}; not comparable: {'; '.join(self.problems)}."

    @property
    def badge(self) -> str:
        """A line of Markdown for a README."""
        from urllib.parse import quote

        told = "not comparable" if self.problems else f"{self.score} ±{self.within:.3f}"
        color = "red" if self.problems else "brightgreen"
        # In a path of shields.io a hyphen separates, two are one.
        return f"![BenchBot: {told}](https://img.shields.io/badge/BenchBot-{quote(told.replace('-', '--'))}-{color})"

    def as_dict(self) -> dict[str, Any]:
        """Return the certificate as `certificate.json` holds it."""
        return {
            "simulator": self.simulator,
            "robot": self.robot,
            "reference": self.reference,
            "task": self.task,
            "score": self.score,
            "software": dict(self.software),
            "comparable": not self.problems,
            "problems": self.problems,
            "statement": self.statement,
            "within": self.within,
            "kendall_tau": self.tau,
            "badge": self.badge,
            "findings": [one.as_dict() | {"fix": one.fix} for one in self.findings],
            "scores": [asdict(row) | {"difference": row.difference} for row in self.rows],
        }


def kendall_tau(rows: Sequence[Row]) -> float | None:
    """Return Kendall's τ-b between the mean scores of solutions in both simulators (Kendall 1945).

    None where there are fewer than two solutions, or all have the same score.
    """
    by_solution = _by_solution(rows).values()
    means = [(fmean(here for here, _ in pairs), fmean(there for _, there in pairs)) for pairs in by_solution]
    if len(means) < 2:
        return None
    from scipy.stats import kendalltau

    tau = float(kendalltau(*zip(*means, strict=True)).statistic)
    return None if math.isnan(tau) else tau


def _by_solution(rows: Sequence[Row]) -> dict[str, list[tuple[float, float]]]:
    """Return both scores of each row that has them, by solution."""
    found: dict[str, list[tuple[float, float]]] = {}
    for row in rows:
        if row.score is not None and row.reference is not None:
            found.setdefault(row.solution, []).append((row.score, row.reference))
    return found
