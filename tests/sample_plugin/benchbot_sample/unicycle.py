"""How a differential drive moves: velocity and acceleration limits, arcs."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

SUBSTEP_S = 0.005


@dataclass(frozen=True)
class State:
    """Where the base is (m, m, rad) and how fast it moves (m/s along +x, rad/s about +z)."""

    x: float
    y: float
    yaw_rad: float
    linear_mps: float = 0.0
    angular_radps: float = 0.0

    def moved(self, linear_mps: float, angular_radps: float, duration_s: float) -> "State":
        """Return the state after an arc of constant velocity."""
        turn = angular_radps * duration_s
        # The chord of an arc is its length times sinc(turn / 2), half a turn away from the heading.
        chord = linear_mps * duration_s * (1.0 if abs(turn) < 1e-9 else math.sin(turn / 2) / (turn / 2))
        heading = self.yaw_rad + turn / 2
        return State(
            self.x + chord * math.cos(heading),
            self.y + chord * math.sin(heading),
            self.yaw_rad + turn,
            linear_mps,
            angular_radps,
        )


@dataclass(frozen=True)
class Limits:
    """What the drive can do; accelerations may be infinite."""

    linear_mps: tuple[float, float]
    angular_radps: float
    linear_acceleration_mps2: float = math.inf
    angular_acceleration_radps2: float = math.inf

    @classmethod
    def from_mapping(cls, limits: Mapping[str, Any]) -> "Limits":
        """Read a robot's `limits`."""
        low, high = limits["linear_mps"]
        return cls(
            (float(low), float(high)),
            float(limits["angular_radps"]),
            float(limits.get("linear_acceleration_mps2", math.inf)),
            float(limits.get("angular_acceleration_radps2", math.inf)),
        )


def substeps(
    state: State, linear_mps: float, angular_radps: float, duration_s: float, limits: Limits
) -> Iterator[State]:
    """Yield the states on the way of one command."""
    low, high = limits.linear_mps
    linear_mps = min(max(linear_mps, low), high)
    angular_radps = min(max(angular_radps, -limits.angular_radps), limits.angular_radps)
    count = max(1, math.ceil(duration_s / SUBSTEP_S - 1e-9))
    step_s = duration_s / count
    for _ in range(count):
        linear = _towards(state.linear_mps, linear_mps, limits.linear_acceleration_mps2 * step_s)
        angular = _towards(state.angular_radps, angular_radps, limits.angular_acceleration_radps2 * step_s)
        state = state.moved(linear, angular, step_s)
        yield state


def rollout(state: State, linear_mps: float, angular_radps: float, horizon_s: float, limits: Limits) -> Iterator[State]:
    """Yield the states on the way of one command and of the braking that follows it."""
    for ahead in substeps(state, linear_mps, angular_radps, horizon_s, limits):
        state = ahead
        yield state
    while state.linear_mps or state.angular_radps:
        for ahead in substeps(state, 0.0, 0.0, SUBSTEP_S, limits):
            state = ahead
            yield state


def _towards(value: float, target: float, largest_change: float) -> float:
    return min(max(target, value - largest_change), value + largest_change)
