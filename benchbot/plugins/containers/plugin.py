"""The mode `container`: a solution in a container of podman or docker."""

from collections.abc import Iterator

from benchbot.plugin import Check, SubmissionMode, hookimpl, target


@hookimpl
def benchbot_submission_modes() -> Iterator[SubmissionMode]:
    """Yield the mode."""
    yield SubmissionMode(
        "container",
        "benchbot.plugins.containers.mode",
        "In a container of podman or docker, built from its Dockerfile.",
    )


@hookimpl
def benchbot_checks() -> Iterator[Check]:
    """Yield whether there is an engine for containers."""
    yield Check("container", target("benchbot.plugins.containers.mode:check"))
