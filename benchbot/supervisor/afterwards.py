"""What an answer does not wait for: noted while a request is carried out, done when its answer is on its way."""

import threading
from collections import deque
from collections.abc import Callable


class Afterwards:
    """Work in the order in which it was noted, each once. Safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._due: deque[Callable[[], object]] = deque()

    def note(self, work: Callable[[], object]) -> None:
        """Have something done later, by whoever settles next."""
        self._due.append(work)

    def settle(self) -> None:
        """Return when all that was noted is done: do what is left, and wait for what another thread does."""
        with self._lock:
            while self._due:
                self._due.popleft()()
