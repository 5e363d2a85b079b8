"""The differential drive keeps its limits and integrates its motion exactly."""

import math
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from benchbot.plugins.simulation.dynamics import DriveLimits, State, along_arc, drive, drive_and_brake

LIMITS = DriveLimits((-0.6, 1.5), 1.0, 2.0, 3.0)

linear = st.floats(-0.6, 1.5)
angular = st.floats(-1.0, 1.0)
states = st.builds(State, st.floats(-5, 5), st.floats(-5, 5), st.floats(-4, 4), linear, angular)


@given(states, st.floats(-5, 5), st.floats(-5, 5), st.floats(0.001, 0.5))
def test_way_points_are_close_together(state: State, linear: float, angular: float, duration_s: float) -> None:
    for before, after in pairwise([state, *drive(state, linear, angular, duration_s, LIMITS)]):
        assert math.dist((before.x, before.y), (after.x, after.y)) <= 0.01 + 1e-9
        assert abs(after.yaw_rad - before.yaw_rad) <= math.radians(1.0) + 1e-9


@given(states, st.floats(-5, 5), st.floats(-5, 5), st.floats(0.001, 0.5))
def test_velocities_keep_the_limits(state: State, linear: float, angular: float, duration_s: float) -> None:
    *_, end = drive(state, linear, angular, duration_s, LIMITS)
    assert -0.6 <= end.linear_mps <= 1.5
    assert abs(end.angular_radps) <= 1.0
    assert abs(end.linear_mps - state.linear_mps) <= 2.0 * duration_s + 1e-9
    assert abs(end.angular_radps - state.angular_radps) <= 3.0 * duration_s + 1e-9


@given(st.floats(0.01, 1.5))
def test_braking_takes_the_way_that_physics_says(linear_mps: float) -> None:
    start = State(0.0, 0.0, 0.0, linear_mps)
    *_, end = drive_and_brake(start, linear_mps, 0.0, 0.1, LIMITS)
    assert end.linear_mps == 0.0
    assert end.x == pytest.approx(0.1 * linear_mps + linear_mps**2 / (2 * 2.0))


@given(states, linear, st.floats(0.01, 0.2))
def test_reach_is_never_exceeded(state: State, linear_mps: float, duration_s: float) -> None:
    *_, end = drive_and_brake(state, linear_mps, state.angular_radps, duration_s, LIMITS)
    assert math.dist((state.x, state.y), (end.x, end.y)) <= LIMITS.reach_m(state, linear_mps, duration_s) + 1e-9


@given(linear, angular, st.floats(0.05, 3.0))
def test_a_steady_command_drives_a_circle(linear_mps: float, angular_radps: float, duration_s: float) -> None:
    assume(abs(angular_radps) > 0.01)
    start = State(0.0, 0.0, 0.0, linear_mps, angular_radps)
    *_, end = drive(start, linear_mps, angular_radps, duration_s, LIMITS)
    radius_m, turn_rad = linear_mps / angular_radps, angular_radps * duration_s
    assert end.x == pytest.approx(radius_m * math.sin(turn_rad), abs=1e-9)
    assert end.y == pytest.approx(radius_m * (1 - math.cos(turn_rad)), abs=1e-9)
    assert end.yaw_rad == pytest.approx(turn_rad)


@given(states, linear, angular, st.floats(0.01, 0.2))
def test_two_half_ticks_make_a_whole_one(state: State, linear_mps: float, angular_radps: float, half_s: float) -> None:
    *_, whole = drive(state, linear_mps, angular_radps, 2 * half_s, LIMITS)
    *_, half = drive(state, linear_mps, angular_radps, half_s, LIMITS)
    *_, halves = drive(half, linear_mps, angular_radps, half_s, LIMITS)
    assert halves.linear_mps == pytest.approx(whole.linear_mps, abs=1e-9)
    assert halves.yaw_rad == pytest.approx(whole.yaw_rad, abs=1e-9)
    # Within a substep the path is one arc, so that only its shape depends on where the substeps end.
    assert math.dist((halves.x, halves.y), (whole.x, whole.y)) < 2e-4


def test_a_straight_arc_is_a_line() -> None:
    assert along_arc((1.0, 2.0, 0.0), 3.0, 0.0) == (4.0, 2.0, 0.0)
    assert along_arc((0.0, 0.0, math.pi / 2), -1.0, 1e-9) == pytest.approx((0.0, -1.0, math.pi / 2), abs=1e-8)
