"""What the screens ask of what feeds them."""

import threading
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from benchbot.plugins.watching.views import BatchView, RunView


class RunFeed(Protocol):
    """What the screen shows and commands: `benchbot.plugins.watching.run_feed.RunFeed`."""

    @property
    def view(self) -> RunView:
        """The newest view."""
        ...

    def choose(self, channels: Sequence[str], width: int) -> None:
        """Look at these channels from now on."""
        ...

    def pause(self) -> None:
        """Hold the solution's next step."""
        ...

    def go_on(self) -> None:
        """Let the solution go on."""
        ...

    def single_step(self) -> None:
        """Let one step of the solution through."""
        ...

    def drive(self, action: str, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        """Take a step by hand."""
        ...

    def stop(self) -> None:
        """End the run."""
        ...

    def confirm(self) -> str:
        """Say that what the operator was asked is done."""
        ...

    def close(self) -> None:
        """End the feed."""
        ...


class BatchFeed(Protocol):
    """What the screen shows and commands: `benchbot.plugins.watching.batch_feed.BatchFeed`."""

    @property
    def view(self) -> BatchView:
        """The newest view."""
        ...

    def cancel(self) -> None:
        """End the batch's workers."""
        ...

    def retry(self, classes: Sequence[str]) -> int:
        """Have episodes that failed like this computed once more."""
        ...

    def close(self) -> None:
        """End the feed."""
        ...


def leave(feed: RunFeed | BatchFeed) -> None:
    """Close a feed without waiting for it: one whose network or file system is gone must not hold up the screen."""
    threading.Thread(target=feed.close, daemon=True, name="benchbot-closing").start()
