"""Errors of a robot, as the driver raises them."""

from benchbot.plugin import BenchbotError, ExitCode, FailureClass


def failed(title: str, why: str, fix: str) -> BenchbotError:
    """Return the error of a robot that does not do what it should: it ends the episode, not the run."""
    return BenchbotError(title, why, fix, exit_code=ExitCode.INTERNAL, failure=FailureClass.PLATFORM)


def safety_stop(why: str, fix: str) -> BenchbotError:
    """Return the error of a robot that was stopped for safety: it ends the run, and nothing is tried again."""
    return BenchbotError(
        "The robot was stopped for safety.",
        why,
        fix,
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.PLATFORM,
        ends_run=True,
    )
