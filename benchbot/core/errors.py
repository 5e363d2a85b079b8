"""The one error class that users see, and the exit codes of every command."""

from enum import IntEnum, StrEnum


class ExitCode(IntEnum):
    """The exit status of a command."""

    OK = 0
    SUBMISSION_FAILED = 1
    USAGE = 2
    INTERNAL = 3
    BELOW_THRESHOLD = 4
    INTERRUPTED = 130


class FailureClass(StrEnum):
    """The cause of an episode that did not end well; carried through to the score."""

    AGENT = "agent"
    COLLISION = "collision"
    TIMEOUT = "timeout"
    PLATFORM = "platform"
    INFRASTRUCTURE = "infrastructure"


class BenchbotError(Exception):
    """An error that a user can understand and mend: what went wrong, why, and the exact fix.

    `failure` is set when the error ends an episode; `ends_run` when nothing may be tried again, as after a safety stop.
    """

    def __init__(
        self,
        title: str,
        why: str,
        fix: str,
        *,
        exit_code: ExitCode = ExitCode.USAGE,
        failure: FailureClass | None = None,
        ends_run: bool = False,
    ) -> None:
        # All three, of which `pickle` makes the error again in another process.
        super().__init__(title, why, fix)
        self.title = title
        self.why = why
        self.fix = fix
        self.exit_code = exit_code
        self.failure = failure
        self.ends_run = ends_run

    def __str__(self) -> str:
        return f"{self.title}\n{self.why}\n{self.fix}"

    def as_dict(self) -> dict[str, str | bool]:
        """Return the error as it travels in JSON: `{title, why, fix[, failure][, ends_run]}`."""
        document: dict[str, str | bool] = {"title": self.title, "why": self.why, "fix": self.fix}
        if self.failure is not None:
            document["failure"] = self.failure.value
        if self.ends_run:
            document["ends_run"] = True
        return document


def did_you_mean(wrong: str, known: list[str]) -> str:
    """Return ` Did you mean 'x'?` for the first known name that begins with it and a colon, or the nearest name.

    Returns an empty string when none is near.
    """
    from difflib import get_close_matches

    originals = {name.lower(): name for name in known}
    longer = [name for name in known if name.lower().startswith(f"{wrong.lower()}:")]
    near = longer or [originals[name] for name in get_close_matches(wrong.lower(), originals, n=1)]
    return f" Did you mean '{near[0]}'?" if near else ""
