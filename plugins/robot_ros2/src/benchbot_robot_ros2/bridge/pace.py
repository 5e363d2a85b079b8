"""The bridged robot's time: simulated time that ticks at real-time pace at most, another node's, or the system's."""

import time
from typing import Protocol

NANOSECONDS = 1_000_000_000
LONGEST_TICK_S = 0.15


class RobotTime(Protocol):
    """The robot's clock; it never jumps back."""

    @property
    def stamp_ns(self) -> int:
        """The robot's time, in nanoseconds."""

    def left_s(self) -> float:
        """Return how long to wait for the next tick, at most, in seconds; nothing when it is due."""

    def next_tick(self) -> float:
        """Go on to the next tick; return how long it takes, in seconds."""


class SimulatedTime:
    """Time that goes on by `period_s` a tick, from zero, at real-time pace at most."""

    def __init__(self, period_s: float) -> None:
        self.stamp_ns = 0
        self._period_s = period_s
        self._due_s = time.monotonic()

    def left_s(self) -> float:
        """Return how long to wait for the next tick."""
        return self._due_s - time.monotonic()

    def next_tick(self) -> float:
        """Go on to the next tick; return how long it takes, in seconds."""
        self.stamp_ns += round(self._period_s * NANOSECONDS)
        # A late tick is not made up for: a burst of ticks would outrun the commands that are meant for them.
        self._due_s = max(self._due_s + self._period_s, time.monotonic())
        return self._period_s


class WallTime:
    """The system's time. A tick takes as long as it took, up to 0.15 s: a robot that was held up does not jump."""

    def __init__(self, period_s: float) -> None:
        self.stamp_ns = time.time_ns()
        self._period_s = period_s
        self._ticked_s = self._due_s = time.monotonic()

    def left_s(self) -> float:
        """Return how long to wait for the next tick."""
        return self._due_s - time.monotonic()

    def next_tick(self) -> float:
        """Go on to the next tick; return how long it takes, in seconds."""
        before_s, self._ticked_s = self._ticked_s, time.monotonic()
        self._due_s = max(self._due_s + self._period_s, self._ticked_s)
        # The system's time may be set back while the bridge runs; the robot's stamps wait for it.
        self.stamp_ns = max(time.time_ns(), self.stamp_ns + 1)
        return min(self._ticked_s - before_s, LONGEST_TICK_S)


class Rate:
    """A timer for something that happens `rate_hz` times per second of the robot's time."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = round(NANOSECONDS / rate_hz)
        self._due_ns = 0

    def due(self, stamp_ns: int) -> bool:
        """Return whether it is due now; what was missed is not made up for."""
        if stamp_ns < self._due_ns:
            return False
        self._due_ns = max(self._due_ns + self._period_ns, stamp_ns)
        return True
