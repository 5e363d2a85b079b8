"""The mode `sandbox`: a solution held by the kernel, with little to see and limits on everything."""

from collections.abc import Iterator

from benchbot.plugin import Check, SubmissionMode, hookimpl, target


@hookimpl
def benchbot_submission_modes() -> Iterator[SubmissionMode]:
    """Yield the submission mode."""
    yield SubmissionMode(
        "sandbox",
        "benchbot.plugins.sandbox.mode",
        "Held by the kernel: little to see, one way out, limits on everything.",
    )


@hookimpl
def benchbot_checks() -> Iterator[Check]:
    """Yield whether this machine can make a sandbox."""
    yield Check("sandbox", target("benchbot.plugins.sandbox.mode:check"))
