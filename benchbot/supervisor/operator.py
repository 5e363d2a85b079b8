"""The operator: the person beside a real robot, who may be asked to do what it cannot do by itself."""

import threading
from collections.abc import Callable


class Operator:
    """What the operator is asked to do, and their word that it is done. Safe to use from any thread.

    `changed` is told the request that waits for them, or None when none does.
    """

    def __init__(self, changed: Callable[[str | None], None]) -> None:
        self._changed = changed
        self._lock = threading.Lock()
        self._pending: tuple[str, Callable[[], None]] | None = None

    def ask(self, request: str, done: Callable[[], None]) -> None:
        """Show a request, and call `done` when the operator says so. Does not wait."""
        with self._lock:
            self._pending = (request, done)
        self._changed(request)

    def confirm(self) -> str | None:
        """Say that the request is done; return it, or None when there was none."""
        pending = self._take()
        if pending is None:
            return None
        request, done = pending
        done()
        return request

    def withdraw(self) -> None:
        """Forget the request: nobody waits for it any more."""
        self._take()

    def _take(self) -> tuple[str, Callable[[], None]] | None:
        with self._lock:
            pending, self._pending = self._pending, None
        if pending is not None:
            self._changed(None)
        return pending
