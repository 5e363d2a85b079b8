"""Coverage: the expected, the scored and the missing results, with reasons, so that no mean hides a gap."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.evaluation.batch_folder import PlannedResult
from benchbot.evaluation.result_document import NUMBERS, ResultDocument
from benchbot.evaluation.result_files import OtherFile

Missing = Literal["zero", "leave-out"]
"""Whether missing results count as zero or not at all."""


MOST_REASONS = 20


@dataclass
class Coverage:
    """A tally, filled while results are read and scored. Skipped results never count."""

    scored: list[ResultDocument] = field(default_factory=list)
    missing: list[dict[str, Any]] = field(default_factory=list)
    skipped: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    errors: list[BenchbotError] = field(default_factory=list)
    own_files: int = 0
    missing_counts: Missing = "zero"

    def skip(self, source: str, reason: str) -> None:
        """Note a file or result that does not count."""
        self.skipped.append({"source": source, "reason": reason})

    def leave_aside(self, file: OtherFile) -> None:
        """Note a file that lies among results: one of BenchBot's own is counted, any other is named."""
        if file.is_own:
            self.own_files += 1
        else:
            self.skip(file.source, file.why)

    def unfinished(self, episode: PlannedResult) -> None:
        """Note an episode of a batch that has no result yet."""
        reason = "Its batch has not finished this episode."
        self._miss(episode.source, episode.environment, reason, episode.condition, None)

    def unreadable(self, source: str, error: BenchbotError, *, counts: bool) -> None:
        """Note a file that holds no result: missing when it `counts`, else skipped."""
        self.errors.append(error)
        if counts:
            self._miss(source, None, error.why, {}, None)
        else:
            self.skip(source, error.why)

    def broken(self, result: ResultDocument, error: BenchbotError) -> None:
        """Note a result that cannot be scored."""
        self.errors.append(error)
        why = f"{error.title} {error.why}"
        self._miss(result.source, result.environment, why, result.condition, result.failure)

    def failed(self, result: ResultDocument) -> None:
        """Note an episode that ended without a result."""
        reason = f"The episode failed: {result.failure_why}"
        self._miss(result.source, result.environment, reason, result.condition, result.failure)

    def absent(self, required: Iterable[str], handed_in: Sequence[ResultDocument | PlannedResult]) -> None:
        """Note the required environments that nothing was handed in for.

        Each is missing as often as the environment with the most results is there, so that it weighs as much.
        """
        counts = Counter(result.environment for result in handed_in)
        fullest = max(counts, key=lambda environment: counts[environment], default=None)
        conditions = [result.condition for result in handed_in if result.environment == fullest] or [{}]
        for environment in dict.fromkeys(required):
            for said in conditions if environment not in counts else ():
                self._miss(None, environment, "There is no result of this environment.", said, None)

    def nothing(self, title: str, items: Sequence[Mapping[str, Any]], fix: str) -> BenchbotError:
        """Return the error that nothing of `items` counts: the only error noted if there is one item, else a list."""
        if len(self.errors) == 1 == len(items):
            return self.errors[0]
        reasons = [f"{item['source'] or item['environment']}: {item['reason']}" for item in items[:MOST_REASONS]]
        more = [f"and {len(items) - MOST_REASONS} more"] if len(items) > MOST_REASONS else []
        return BenchbotError(title, "\n".join([*reasons, *more, *self.warnings]) or "No result was given.", fix)

    def as_dict(self) -> dict[str, Any]:
        """Return the `coverage` of a scores document."""
        failures = [result.failure for result in self.scored] + [item["failure"] for item in self.missing]
        tally = Counter(failure.value for failure in failures if failure is not None)
        return {
            "expected": len(self.scored) + len(self.missing),
            "scored": len(self.scored),
            "missing_counts": self.missing_counts,
            "failures": {failure.value: tally[failure.value] for failure in FailureClass if tally[failure.value]},
            "warnings": self.warnings,
            **({"own_files": self.own_files} if self.own_files else {}),
            "missing": self.missing,
            "skipped": self.skipped,
        }

    def _miss(
        self,
        source: str | None,
        environment: str | None,
        reason: str,
        condition: Mapping[str, Any],
        failure: FailureClass | None,
    ) -> None:
        numbers: dict[str, Any] = dict.fromkeys(NUMBERS)
        about = {"source": source, "environment": environment, **numbers, **condition}
        self.missing.append({**about, "reason": reason, "failure": failure})


def means_of(
    names: Iterable[str], rows: Sequence[Mapping[str, Any]], expected: int, zeros: Collection[str]
) -> dict[str, int]:
    """Return how many of the rows that count each score is of, where fewer than expected; `zeros`: of missing ones."""
    counts = {name: sum(name in (row["scores"] or zeros) for row in rows) for name in names}
    return {name: count for name, count in counts.items() if count < expected}


def means_in_words(coverage: Mapping[str, Any], names: Iterable[str]) -> list[str]:
    """Return what scores are a mean of, where not of all: `ATE_RMSE_m, ATE_max_m: mean of 3 of 5`."""
    groups: dict[int, list[str]] = {}
    for name in names:
        if name in coverage.get("means_of", ()):
            groups.setdefault(coverage["means_of"][name], []).append(name)
    return [f"{', '.join(group)}: mean of {count} of {coverage['expected']}" for count, group in groups.items()]


def counted_rows(rows: Iterable[dict[str, Any]], coverage: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a scores document that count: the missing ones in its `coverage` have no scores."""
    missing = coverage["missing"] if coverage.get("missing_counts", "zero") == "zero" else []
    return [*rows, *({**item, "scores": {}} for item in missing)]
