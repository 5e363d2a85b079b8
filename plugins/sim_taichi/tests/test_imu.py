"""The inertial measurement unit: what it measures is the second derivative of its way, and gravity."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.platform import Scene
from benchbot.plugins.simulation.dynamics import along_arc
from benchbot.plugins.simulation.imu import GRAVITY_MPS2, Imu, Motion
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.sim_taichi.tests.test_simulator import robot, room, simulator

__all__ = ["room"]

QUIET = {"frame": "base_link"}
SPEEDS = st.floats(-2, 2)


def unit(**values: Any) -> Imu:
    return Imu.from_mapping(QUIET | values)


def loaded(scene: Scene, imu: dict[str, Any] | None = None, seed: int = 0) -> RayTracedSimulator:
    platform = simulator(robot(imu=imu) if imu else robot())
    platform.load(scene, seed)
    return platform


def way_of(motion: Motion, mount: Pose, time_s: float) -> np.ndarray[Any, Any]:
    """Return where the unit is some moments from now, if the base goes on accelerating."""
    way_m = motion.linear_mps * time_s + motion.linear_mps2 * time_s**2 / 2
    turn_rad = motion.angular_radps * time_s + motion.angular_radps2 * time_s**2 / 2
    x, y, yaw_rad = along_arc((0.0, 0.0, 0.0), way_m, turn_rad)
    return np.array((Pose.planar(x, y, yaw_rad) @ mount).translation_xyz)


@given(SPEEDS, SPEEDS, SPEEDS, SPEEDS, st.tuples(*[st.floats(-1, 1)] * 3), st.tuples(*[st.floats(-180, 180)] * 3))
def test_the_acceleration_is_that_of_its_way_wherever_it_is_mounted(
    linear: float,
    angular: float,
    linear_change: float,
    angular_change: float,
    xyz: tuple[float, float, float],
    rpy_deg: tuple[float, float, float],
) -> None:
    motion, mount = Motion(linear, angular, linear_change, angular_change), Pose.from_xyz_rpy_deg(xyz, rpy_deg)
    measured = unit().measure(motion, mount, np.random.default_rng(0))
    step_s = 1e-3
    before, now, after = (way_of(motion, mount, time_s) for time_s in (-step_s, 0.0, step_s))
    acceleration = (after - 2 * now + before) / step_s**2 + np.array([0, 0, GRAVITY_MPS2])
    to_base = mount.matrix()[:3, :3]
    np.testing.assert_allclose(to_base @ measured["linear_acceleration_mps2"], acceleration, atol=1e-3)
    np.testing.assert_allclose(to_base @ measured["angular_velocity_radps"], [0, 0, angular], atol=1e-12)
    assert np.isnan(measured["orientation_xyzw"]).all()


def test_a_robot_that_drives_off_in_a_bend_feels_it(room: Scene) -> None:
    platform = loaded(room, QUIET)
    at_rest = platform.observe(["imu"])["imu"]
    assert at_rest["linear_acceleration_mps2"].tolist() == [0, 0, GRAVITY_MPS2]
    for _ in range(4):
        platform.drive(0.4, 0.5, platform.control_period_s)
    # Its limits let it speed up by 2 m/s² and 3 rad/s²: after 0.2 s both speeds have been reached.
    linear_mps, angular_radps = platform.velocity
    speeding = platform.observe(["imu"])["imu"]
    assert speeding["angular_velocity_radps"] == pytest.approx([0, 0, angular_radps])
    assert speeding["linear_acceleration_mps2"] == pytest.approx([2.0, linear_mps * angular_radps, GRAVITY_MPS2])
    platform.drive(0.4, 0.5, platform.control_period_s)
    assert platform.observe(["imu"])["imu"]["linear_acceleration_mps2"] == pytest.approx([0, 0.2, GRAVITY_MPS2])
    platform.place(Pose())
    assert platform.observe(["imu"])["imu"]["linear_acceleration_mps2"].tolist() == [0, 0, GRAVITY_MPS2]


def test_its_errors_are_those_declared_and_of_the_seed(room: Scene) -> None:
    noise = {"angular_velocity_sigma_radps": 0.02, "linear_acceleration_sigma_mps2": 0.3}
    platforms = [loaded(room, QUIET | {"noise": noise}, seed) for seed in (0, 0, 1)]
    measured = []
    for platform in platforms:
        rows = []
        for _ in range(400):
            platform.drive(0.0, 0.0, platform.control_period_s)
            imu = platform.observe(["imu"])["imu"]
            rows.append([*imu["angular_velocity_radps"], *imu["linear_acceleration_mps2"]])
        measured.append(np.array(rows))
    assert np.array_equal(measured[0], measured[1])
    assert not np.array_equal(measured[0], measured[2])
    spread = measured[0].std(0)
    np.testing.assert_allclose(spread, [0.02] * 3 + [0.3] * 3, rtol=0.15)
    assert abs(measured[0][:, 5].mean() - GRAVITY_MPS2) < 0.1


@pytest.mark.parametrize(
    ("imu", "words"),
    [
        ({"frame": "nowhere"}, "has no frame 'nowhere'"),
        ({"frame": "base_link", "noise": {"sigma": 1}}, "imu: "),
        ({"frame": "base_link", "noise": {"angular_velocity_sigma_radps": -1}}, "is negative or not finite"),
        ({"frame": "base_link", "noise": {"angular_velocity_sigma_radps": math.nan}}, "is negative or not finite"),
        ({"frame": "base_link", "bias": 1}, "imu has no 'bias'"),
        ({}, "KeyError: 'frame'"),
    ],
)
def test_a_unit_that_cannot_be_is_explained(imu: dict[str, Any], words: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        simulator(robot(imu=imu))
    assert words in f"{caught.value.title} {caught.value.why}"


def test_a_robot_without_one_says_so(room: Scene) -> None:
    declaration = robot()
    del declaration["imu"]
    platform = simulator(declaration)
    platform.load(room, seed=0)
    with pytest.raises(BenchbotError, match="has no imu"):
        platform.observe(["imu"])
