"""Coverage: what was expected, what was scored, and why the rest is missing, so that no mean hides a gap."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.evaluation.inputs import Submission

Missing = Literal["zero", "leave-out"]
"""How results that are missing count."""


@dataclass
class Coverage:
    """A tally, filled while results are read and scored. What is skipped never counts, what is missing as chosen."""

    scored: list[Submission] = field(default_factory=list)
    missing: list[dict[str, Any]] = field(default_factory=list)
    skipped: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    errors: list[BenchbotError] = field(default_factory=list)
    missing_counts: Missing = "zero"

    def skip(self, source: str, reason: str) -> None:
        """Note something that was handed in and does not count."""
        self.skipped.append({"source": source, "reason": reason})

    def unreadable(self, source: str, error: BenchbotError, *, counts: bool) -> None:
        """Note a file that holds no result; it counts unless what is missing is known by environment."""
        self.errors.append(error)
        if counts:
            self._miss(source, None, error.why, {}, None)
        else:
            self.skip(source, error.why)

    def broken(self, submission: Submission, error: BenchbotError) -> None:
        """Note a result that cannot be scored."""
        self.errors.append(error)
        why = f"{error.title} {error.why}"
        self._miss(submission.source, submission.environment, why, submission.condition, submission.failure)

    def failed(self, submission: Submission) -> None:
        """Note an episode that ended without a result."""
        reason = f"The episode failed: {submission.failure_why}"
        self._miss(submission.source, submission.environment, reason, submission.condition, submission.failure)

    def absent(self, required: Iterable[str], handed_in: Sequence[Submission]) -> None:
        """Note the required environments that nothing was handed in for.

        Each is missing as often as the environment with the most results is there, so that it weighs as much.
        """
        counts = Counter(submission.environment for submission in handed_in)
        fullest = max(counts, key=lambda environment: counts[environment], default=None)
        conditions = [submission.condition for submission in handed_in if submission.environment == fullest] or [{}]
        for environment in dict.fromkeys(required):
            for said in conditions if environment not in counts else ():
                self._miss(None, environment, "There is no result of this environment.", said, None)

    def rows_of_missing(self) -> list[dict[str, Any]]:
        """Return what is missing and counts, as rows without scores."""
        counts = self.missing_counts == "zero"
        return [{**item, "scores": {}} for item in self.missing] if counts else []

    def as_dict(self) -> dict[str, Any]:
        """Return what a scores document says of it."""
        failures = [submission.failure for submission in self.scored] + [item["failure"] for item in self.missing]
        tally = Counter(failure.value for failure in failures if failure is not None)
        return {
            "expected": len(self.scored) + len(self.missing),
            "scored": len(self.scored),
            "missing_counts": self.missing_counts,
            "failures": {failure.value: tally[failure.value] for failure in FailureClass if tally[failure.value]},
            "warnings": self.warnings,
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
        numbers: dict[str, Any] = dict.fromkeys(("seed", "episode", "repeat"))
        about = {"source": source, "environment": environment, **numbers, **condition}
        self.missing.append({**about, "reason": reason, "failure": failure})
