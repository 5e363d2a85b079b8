"""Contact of a robot's footprint with obstacles: the clearance along a way, and where the way ends."""

import math
from collections.abc import Callable, Iterable

from benchbot.plugins.simulation.dynamics import State

CONTACT_TOLERANCE_M = 1e-6


class Clearance:
    """The distance between one robot's footprint and obstacles, negative in contact.

    It is looked up only where the way since the last place that it was looked up at is longer than what was free
    there (conservative advancement). `distance_m` is that from a point (x, y) of the map frame to the nearest obstacle.
    """

    def __init__(self, distance_m: Callable[[float, float], float], radius_m: float) -> None:
        self._distance_m = distance_m
        self._radius_m = radius_m
        self._known = (math.nan, math.nan, 0.0)

    def exactly_m(self, state: State) -> float:
        """Return the clearance in a state."""
        clearance_m = self._distance_m(state.x, state.y) - self._radius_m
        self._known = (state.x, state.y, clearance_m)
        return clearance_m

    def at_least_m(self, state: State) -> float:
        """Return a positive lower bound of the clearance, or the clearance."""
        x, y, clearance_m = self._known
        free_m = clearance_m - math.hypot(state.x - x, state.y - y)
        return free_m if free_m > 0 else self.exactly_m(state)

    def exceeds(self, state: State, distance_m: float) -> bool:
        """Return whether the clearance is more than a distance."""
        return self.at_least_m(state) > distance_m or self.exactly_m(state) > distance_m


def travel(state: State, way: Iterable[State], clearance: Clearance) -> tuple[State, bool]:
    """Follow a way up to contact: return the last free state, and whether there was contact."""
    for following in way:
        if clearance.at_least_m(following) < 0:
            return up_to_contact(state, following, clearance), True
        state = following
    return state, False


def up_to_contact(free: State, touching: State, clearance: Clearance) -> State:
    """Return the last free state, at rest, on the straight line between a free state and one in contact."""
    while math.hypot(touching.x - free.x, touching.y - free.y) > CONTACT_TOLERANCE_M:
        middle = State((free.x + touching.x) / 2, (free.y + touching.y) / 2, (free.yaw_rad + touching.yaw_rad) / 2)
        free, touching = (free, middle) if clearance.exactly_m(middle) < 0 else (middle, touching)
    return State(free.x, free.y, free.yaw_rad)
