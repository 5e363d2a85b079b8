"""Steps by which a person drives a robot: their sizes, and the action of each."""

from dataclasses import dataclass, replace

DISTANCES_M = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
ANGLES_DEG = (2.0, 5.0, 15.0, 30.0, 45.0, 90.0)


@dataclass(frozen=True)
class Teleop:
    """The size of a step by hand: an index into the lists above."""

    size: int = 2

    @property
    def distance_m(self) -> float:
        """The length of a step forwards or backwards."""
        return DISTANCES_M[self.size]

    @property
    def angle_deg(self) -> float:
        """The angle of a step to the left or right."""
        return ANGLES_DEG[self.size]

    def resized(self, change: int) -> "Teleop":
        """Return smaller or larger steps, within bounds."""
        return replace(self, size=min(max(self.size + change, 0), len(DISTANCES_M) - 1))

    def action(self, where: str) -> tuple[str, dict[str, float]]:
        """Return the action of a step, and its arguments.

        The step is `forward`, `back`, `left`, `right`, or to the `next` pose of the trajectory.
        """
        if where == "next":
            return "move_next", {}
        if where in ("forward", "back"):
            return "move_distance", {"distance": self.distance_m if where == "forward" else -self.distance_m}
        return "move_angle", {"angle": self.angle_deg if where == "left" else -self.angle_deg}

    def __str__(self) -> str:
        """Return the size of a step, in words."""
        return f"{self.distance_m:g} m, {self.angle_deg:g}°"
