"""Dead reckoning that drifts: the estimated pose of a robot whose wheels are measured with errors."""

import math
from collections.abc import Iterator
from itertools import count

from benchbot.plugin import randomness
from benchbot.plugins.simulation.dynamics import State, along_arc

_BLOCK = 64
"""The number of ticks whose noise is drawn at once, to save time."""


class Odometry:
    """Integrates the true motion with multiplicative noise, from the seed of the episode.

    Each tick's way is scaled by 1 + N(bias[0], linear_noise), its turn by 1 + N(bias[1], angular_noise). This is the
    model of BenchBot v2, whose bias was as large as its deviation. There is no noise at rest. The way of a `holonomic`
    base has a part to its left, which is scaled alike; that of another base has none, however it is pushed.
    """

    def __init__(
        self,
        start: State,
        linear_noise: float,
        angular_noise: float,
        seed: int,
        bias: tuple[float, float] = (0.0, 0.0),
        *,
        holonomic: bool = False,
    ) -> None:
        self._pose = (start.x, start.y, start.yaw_rad)
        self._noise = (linear_noise, angular_noise)
        self._bias = bias
        self._holonomic = holonomic
        self._noise_of_ticks = normals(seed)

    @property
    def pose(self) -> tuple[float, float, float]:
        """The believed (x, y, yaw) in the map frame."""
        return self._pose

    def follow(self, before: State, after: State) -> None:
        """Update the estimate by the measured motion from one true state to the next."""
        turn_rad = after.yaw_rad - before.yaw_rad
        heading_rad = before.yaw_rad + turn_rad / 2
        x, y, cos, sin = after.x - before.x, after.y - before.y, math.cos(heading_rad), math.sin(heading_rad)
        way_m = x * cos + y * sin
        side_m = y * cos - x * sin if self._holonomic else 0.0
        if not way_m and not side_m and not turn_rad:
            return
        linear, angular = next(self._noise_of_ticks)
        scale = 1.0 + self._bias[0] + self._noise[0] * linear
        self._pose = along_arc(
            self._pose,
            way_m * scale,
            turn_rad * (1.0 + self._bias[1] + self._noise[1] * angular),
            side_m * scale,
        )


def normals(seed: int) -> Iterator[tuple[float, float]]:
    """Yield the normal errors (way, turn) of one tick in motion after the other."""
    for block in count():
        yield from randomness.generator(seed, "odometry", block).standard_normal((_BLOCK, 2)).tolist()
