"""Commands that take their time, one after the other beside the screen, and what became of them."""

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchbot.core.errors import BenchbotError


@dataclass(frozen=True)
class Outcome:
    """What became of a command: `done` is called with `value`, in the screen's own thread, unless there is an error."""

    what: str
    value: Any
    error: BenchbotError | None
    done: Callable[[Any], None] | None


class Commands:
    """Carries out commands. A supervisor that does not answer never holds up the screen, or its end."""

    def __init__(self) -> None:
        self._under_way: list[str] = []
        self._outcomes: queue.SimpleQueue[Outcome] = queue.SimpleQueue()

    @property
    def under_way(self) -> str:
        """What is being done, in words; empty when nothing is."""
        return ", ".join(self._under_way)

    def begin(
        self, what: str, call: Callable[[], Any], done: Callable[[Any], None] | None = None, *, beside: bool = False
    ) -> bool:
        """Begin a command; say whether it could be begun: no other is under way, or it may go on `beside` others."""
        if what in self._under_way or (self._under_way and not beside):
            return False
        self._under_way.append(what)
        # Of threads like this one, nobody waits for the end: a screen can be left while a robot still drives.
        threading.Thread(target=self._carry_out, args=(what, call, done), daemon=True, name="benchbot-command").start()
        return True

    def ended(self) -> list[Outcome]:
        """Return what has ended since it was last asked."""
        found: list[Outcome] = []
        while not self._outcomes.empty():
            found.append(self._outcomes.get())
            self._under_way.remove(found[-1].what)
        return found

    def _carry_out(self, what: str, call: Callable[[], Any], done: Callable[[Any], None] | None) -> None:
        try:
            self._outcomes.put(Outcome(what, call(), None, done))
        except BenchbotError as error:
            self._outcomes.put(Outcome(what, None, error, done))
