"""The gate before the robot: the host of a run may hold a solution's next step, let single ones through, or drive."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from benchbot.supervisor import RefusedError

MOST_WAITING = 4
"""Requests beyond so many are refused: each that waits has a thread of the supervisor's."""
MOST_STEPS = 1_000_000
DRIVE_WAIT_S = 10.0


@dataclass(frozen=True)
class GateState:
    """The state of a gate: closed or not, the number of steps that it still lets through, whether a request waits."""

    paused: bool
    steps_left: int
    held: bool


class Gate:
    """A gate that a solution's requests pass one by one; it is open at first. Safe to use from any thread.

    A request that does not move the robot is held only while the host drives.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._paused = False
        self._steps_left = 0
        self._waiting = 0
        self._inside = 0
        self._driving = False
        self._ended = False

    @property
    def state(self) -> GateState:
        """Where it stands now."""
        with self._changed:
            return GateState(self._paused, self._steps_left, self._waiting > 0)

    def close(self) -> None:
        """Hold the requests that come from now on; those under way go on to their end."""
        self._set(paused=True, steps=0)

    def open(self) -> None:
        """Let everything through."""
        self._set(paused=False, steps=0)

    def let_through(self, steps: int) -> None:
        """Let so many more steps through, and hold the next."""
        self._set(paused=True, steps=steps)

    def end(self) -> None:
        """Hold nothing any more: the run is over, and requests that wait are refused."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def look_again(self) -> None:
        """Wake the requests that wait, so that each checks whether its client is still there."""
        with self._changed:
            self._changed.notify_all()

    @contextmanager
    def passing(self, is_gone: Callable[[], bool], *, moves: bool) -> Iterator[None]:
        """Wait until a request may pass, and hold the host's driving until it is done.

        It passes, too, when the run ends or the client `is_gone`: the run then refuses the request. Raises
        RefusedError (409) when too many wait already.
        """
        with self._changed:
            if self._holds(moves=moves):
                self._wait(is_gone, moves=moves)
            if moves and self._steps_left and not is_gone():
                self._steps_left -= 1
            self._inside += 1
        try:
            yield
        finally:
            with self._changed:
                self._inside -= 1
                self._changed.notify_all()

    @contextmanager
    def driving(self, *, begun: bool) -> Iterator[None]:
        """Drive: only while the gate is closed, or no solution has `begun`; waits until no request is past it.

        Raises RefusedError (409) otherwise, and when the action under way takes too long.
        """
        with self._changed:
            if begun and not self._paused:
                raise RefusedError(
                    409,
                    "The solution drives.",
                    "The host may drive while the run is paused, or before a solution has begun.",
                    "Pause the run first.",
                )
            if self._driving:
                raise busy("Another action by hand is under way, and there is one robot.")
            self._driving = True
            if not self._changed.wait_for(lambda: not self._inside, DRIVE_WAIT_S):
                self._driving = False
                self._changed.notify_all()
                raise busy("The solution's action before is still under way, and there is one robot.")
        try:
            yield
        finally:
            with self._changed:
                self._driving = False
                self._changed.notify_all()

    def _set(self, *, paused: bool, steps: int) -> None:
        with self._changed:
            self._paused, self._steps_left = paused, min(steps, MOST_STEPS)
            self._changed.notify_all()

    def _holds(self, *, moves: bool) -> bool:
        if self._ended:
            return False
        return self._driving or (moves and self._paused and not self._steps_left)

    def _wait(self, is_gone: Callable[[], bool], *, moves: bool) -> None:
        if self._waiting >= MOST_WAITING:
            raise busy("The run is paused, and other requests wait already until it goes on.")
        self._waiting += 1
        try:
            while self._holds(moves=moves) and not is_gone():
                self._changed.wait()
        finally:
            self._waiting -= 1


def busy(why: str) -> RefusedError:
    """Return the refusal of a request for which the robot is not free."""
    return RefusedError(
        409, "The robot is busy.", why, "Wait for the answer to the request before, then send this one again."
    )
