"""Recording: what a recorder is told of a session while it runs."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from benchbot.core.plugins import Plugins

if TYPE_CHECKING:
    from benchbot.core.session import Progress, Step


class Recording(Protocol):
    """One recording in progress; what it writes goes into the folder that its recorder's `create` was given."""

    def reset(self) -> None:
        """Start over: the session begins again in the first scene, and what was recorded is void."""

    def step(self, action: str | None, arguments: Mapping[str, Any], step: "Step", progress: "Progress") -> None:
        """Take note of one observation; `action` is what led to it, None after a reset or a plain look."""

    def close(self) -> None:
        """Finish the recording. Safe to call twice."""


def start(plugins: Plugins, wanted: Mapping[str, Path]) -> list[Recording]:
    """Start the wanted recordings: recorder name to the folder that it writes into.

    Raises BenchbotError for an unknown recorder, before any has been started.
    """
    recorders = [(plugins.record("recorders", name), folder) for name, folder in wanted.items()]
    return [recorder.create(folder) for recorder, folder in recorders]
