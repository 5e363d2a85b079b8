"""Coverage: what was expected, what was scored, and why the rest is missing, so that no mean hides a gap."""

from dataclasses import dataclass, field
from typing import Any

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.evaluation.inputs import Submission


@dataclass
class Coverage:
    """A tally, filled while results are read and scored. What is missing counts as zero, what is skipped not at all."""

    scored: int = 0
    missing: list[dict[str, Any]] = field(default_factory=list)
    skipped: list[dict[str, Any]] = field(default_factory=list)
    errors: list[BenchbotError] = field(default_factory=list)

    def skip(self, source: str, reason: str) -> None:
        """Note something that was handed in and does not count."""
        self.skipped.append({"source": source, "reason": reason})

    def unreadable(self, source: str, error: BenchbotError, *, counts: bool) -> None:
        """Note a file that holds no result; it counts unless what is missing is known by environment."""
        self.errors.append(error)
        if counts:
            self._miss(source, None, error.why, None)
        else:
            self.skip(source, error.why)

    def broken(self, submission: Submission, error: BenchbotError) -> None:
        """Note a result that cannot be scored."""
        self.errors.append(error)
        self._miss(submission.source, submission.environment, f"{error.title} {error.why}", submission.failure)

    def failed(self, submission: Submission) -> None:
        """Note an episode that ended without a result."""
        reason = f"The episode failed: {submission.failure_why}"
        self._miss(submission.source, submission.environment, reason, submission.failure)

    def absent(self, environment: str) -> None:
        """Note an environment that was asked for and that nothing was handed in for."""
        self._miss(None, environment, "There is no result of this environment.", None)

    def as_dict(self) -> dict[str, Any]:
        """Return what a scores document says of it."""
        return {
            "expected": self.scored + len(self.missing),
            "scored": self.scored,
            "missing": self.missing,
            "skipped": self.skipped,
        }

    def _miss(self, source: str | None, environment: str | None, reason: str, failure: FailureClass | None) -> None:
        self.missing.append({"source": source, "environment": environment, "reason": reason, "failure": failure})
