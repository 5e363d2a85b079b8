"""The covariances of odometry: those of the errors that the simulator really makes."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.plugins.simulation.dynamics import State, along_arc
from benchbot.plugins.simulation.odometry import Odometry
from benchbot_robot_ros2.bridge.odometry_errors import EXACT_VARIANCE, OdometryErrors, exact
from benchbot_robot_ros2.ramp import REST

NOISE = {"linear": 0.1, "angular": 0.1}
TICK_S = 0.05
PLANAR = np.ix_([0, 1, 5], [0, 1, 5])
# Ahead in a bend, and a holonomic base's way to the side in one.
WAYS = [(0.05, 0.03, 0.0), (0.02, 0.03, -0.04)]
STEPS = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))


def drive(steps: Sequence[tuple[float, ...]], noise: dict[str, float], *, holonomic: bool = False) -> OdometryErrors:
    errors, place = OdometryErrors(noise, holonomic=holonomic), (0.0, 0.0, 0.0)
    for step in steps:
        place = along_arc(place, *step)
        errors.follow(Pose.planar(*place), TICK_S)
    return errors


@pytest.mark.parametrize("way", WAYS)
def test_the_covariance_is_that_of_the_simulators_odometry(way: tuple[float, float, float]) -> None:
    # A way of 3 m in a bend, ten times over, with the noise of so many seeds.
    steps, holonomic = [way] * 60, way[2] != 0
    states = [State(0.0, 0.0, 0.0)]
    for step in steps:
        states.append(State(*along_arc((states[-1].x, states[-1].y, states[-1].yaw_rad), *step)))
    off = []
    for seed in range(500):
        odometry = Odometry(states[0], NOISE["linear"], NOISE["angular"], seed, holonomic=holonomic)
        for before, after in itertools.pairwise(states):
            odometry.follow(before, after)
        x, y, yaw_rad = odometry.pose
        off.append([x - states[-1].x, y - states[-1].y, yaw_rad - states[-1].yaw_rad])
    said = drive(steps, NOISE, holonomic=holonomic).pose_covariance().reshape(6, 6)[PLANAR]

    real = np.cov(np.array(off).T)
    # The normalised squared error of three dimensions is 3 on average, with a spread of 0.11 over 500 seeds.
    squared = np.einsum("ni,ij,nj->n", off, np.linalg.inv(said), off)
    assert squared.mean() == pytest.approx(3.0, abs=0.5)
    np.testing.assert_allclose(np.diag(said), np.diag(real), rtol=0.25)


@given(st.lists(STEPS, max_size=30), st.floats(0, 1), st.floats(0, 1))
def test_covariances_are_positive_definite_and_uncertainty_of_the_heading_never_shrinks(
    steps: list[tuple[float, float]], linear: float, angular: float
) -> None:
    variances = [0.0]
    for count in range(len(steps) + 1):
        errors = drive(steps[:count], {"linear": linear, "angular": angular})
        for covariance in (errors.pose_covariance(), errors.twist_covariance()):
            matrix = covariance.reshape(6, 6)
            assert np.array_equal(matrix, matrix.T)
            assert np.linalg.eigvalsh(matrix).min() > 0.5 * EXACT_VARIANCE
        variances.append(float(errors.pose_covariance()[35]))
    assert variances == sorted(variances)


@given(STEPS, st.floats(-math.pi, math.pi))
def test_its_velocity_is_that_of_the_last_tick(step: tuple[float, float], yaw_rad: float) -> None:
    way_m, turn_rad = step
    errors = OdometryErrors(NOISE)
    errors.start(Pose.planar(1.0, 2.0, yaw_rad))
    x, y, heading_rad = along_arc((1.0, 2.0, yaw_rad), way_m, turn_rad)
    errors.follow(Pose.planar(x, y, wrap_angle_rad(heading_rad)), TICK_S)

    assert errors.velocity == pytest.approx((way_m / TICK_S, turn_rad / TICK_S, 0.0), abs=1e-6)
    variances = np.diag(errors.twist_covariance().reshape(6, 6))[[0, 5]]
    assert variances == pytest.approx(np.square([0.1 * way_m / TICK_S, 0.1 * turn_rad / TICK_S]), abs=1e-7)


def test_what_stands_still_is_exact_and_a_robot_without_noise_stays_so() -> None:
    assert np.array_equal(drive([], NOISE).pose_covariance(), exact())
    quiet = drive([(0.05, 0.02)] * 10, {})
    assert np.array_equal(quiet.pose_covariance(), exact())
    assert np.array_equal(quiet.twist_covariance(), exact())


def test_a_robot_that_is_put_elsewhere_stands_still_and_has_forgotten_nothing() -> None:
    errors = drive([(0.05, 0.02)] * 10, NOISE)
    before = errors.pose_covariance()
    errors.rest()
    assert errors.velocity == REST
    assert np.array_equal(errors.pose_covariance(), before)
