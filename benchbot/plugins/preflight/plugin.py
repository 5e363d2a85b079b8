"""Checks before the first episode of a run, a submission or a batch."""

from collections.abc import Iterator

from benchbot.plugin import Check, hookimpl, target


@hookimpl
def benchbot_checks() -> Iterator[Check]:
    """Yield the checks that no other plug-in makes."""
    yield Check("solution", target("benchbot.plugins.preflight.solution:find"))
    yield Check("scenes", target("benchbot.plugins.preflight.material:scenes"))
    yield Check("start", target("benchbot.plugins.preflight.material:starts"))
    yield Check("ground_truth", target("benchbot.plugins.preflight.material:ground_truths"))
    yield Check("recorders", target("benchbot.plugins.preflight.folders:recorders"))
    yield Check("folders", target("benchbot.plugins.preflight.folders:room"))
