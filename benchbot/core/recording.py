"""Recording: what a recorder is told of a session while it runs."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from benchbot.core.progress import Progress, Step


class Recording(Protocol):
    """One recording in progress; what it writes goes into the folder that its recorder's `create` was given."""

    def reset(self) -> None:
        """Start over: the session begins again in the first scene, and what was recorded is void."""

    def step(self, action: str | None, arguments: Mapping[str, Any], step: "Step", progress: "Progress") -> None:
        """Take note of one observation; `action` is what led to it, None after a reset or a plain look."""

    def close(self) -> None:
        """Finish the recording. Safe to call twice."""
