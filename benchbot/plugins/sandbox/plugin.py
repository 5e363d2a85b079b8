"""The mode `sandbox`: a solution held by the kernel, with little to see and limits on everything."""

from collections.abc import Iterator

from benchbot.plugin import SubmissionMode, hookimpl


@hookimpl
def benchbot_submission_modes() -> Iterator[SubmissionMode]:
    """Yield the submission mode."""
    yield SubmissionMode(
        "sandbox",
        "benchbot.plugins.sandbox.mode",
        "Held by the kernel: little to see, one way out, limits on everything.",
    )
