"""Driving by hand: which action a key means, in steps whose size can be chosen."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

DISTANCES_M = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
ANGLES_DEG = (2.0, 5.0, 15.0, 30.0, 45.0, 90.0)

Order = tuple[str, Mapping[str, Any]]
"""An action and its arguments."""


@dataclass(frozen=True)
class Wheel:
    """What a step by hand is: `size` is a place in the lists above."""

    size: int = 2

    @property
    def distance_m(self) -> float:
        """How far a step forwards or backwards goes."""
        return DISTANCES_M[self.size]

    @property
    def angle_deg(self) -> float:
        """How far a step to the left or right turns."""
        return ANGLES_DEG[self.size]

    def resized(self, change: int) -> "Wheel":
        """Return one with smaller or larger steps, within bounds."""
        return replace(self, size=min(max(self.size + change, 0), len(DISTANCES_M) - 1))

    def order(self, where: str) -> Order:
        """Return the action of a step `forward`, `back`, `left`, `right`, or to the `next` pose of the trajectory."""
        if where == "next":
            return "move_next", {}
        if where in ("forward", "back"):
            return "move_distance", {"distance": self.distance_m if where == "forward" else -self.distance_m}
        return "move_angle", {"angle": self.angle_deg if where == "left" else -self.angle_deg}

    def __str__(self) -> str:
        """Return the size of a step, in words."""
        return f"{self.distance_m:g} m, {self.angle_deg:g}°"
