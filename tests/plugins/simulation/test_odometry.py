"""Dead reckoning drifts without bias, the same way for the same seed, and not at all at rest."""

import math
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.declarations import schema
from benchbot.plugins.simulation.dynamics import DriveLimits, State, drive
from benchbot.plugins.simulation.odometry import Odometry

LIMITS = DriveLimits((-0.6, 1.5), 1.0, 2.0, 3.0)
START = State(1.0, -2.0, 0.5)

commands = st.lists(st.tuples(st.floats(-0.6, 1.5), st.floats(-1.0, 1.0)), max_size=20)


def drive_along(odometry: Odometry, commands: list[tuple[float, float]]) -> State:
    state = START
    for linear_mps, angular_radps in commands:
        *_, after = drive(state, linear_mps, angular_radps, 0.05, LIMITS)
        odometry.follow(state, after)
        state = after
    return state


@given(commands)
def test_without_noise_it_follows_the_truth(commands: list[tuple[float, float]]) -> None:
    odometry = Odometry(START, 0.0, 0.0, seed=0)
    end = drive_along(odometry, commands)
    x, y, yaw_rad = odometry.pose
    assert yaw_rad == pytest.approx(end.yaw_rad, abs=1e-9)
    assert math.dist((x, y), (end.x, end.y)) < 1e-3


@given(commands, st.integers(0, 2**32))
def test_the_same_seed_drifts_the_same_way(commands: list[tuple[float, float]], seed: int) -> None:
    first, second = (Odometry(START, 0.1, 0.1, seed) for _ in range(2))
    drive_along(first, commands)
    drive_along(second, commands)
    assert first.pose == second.pose


def test_other_seeds_drift_otherwise() -> None:
    first, second = (Odometry(START, 0.1, 0.1, seed) for seed in (0, 1))
    drive_along(first, [(1.0, 0.5)] * 20)
    drive_along(second, [(1.0, 0.5)] * 20)
    assert first.pose != second.pose


def test_there_is_no_noise_at_rest() -> None:
    odometry = Odometry(START, 0.1, 0.1, seed=0)
    for _ in range(10):
        odometry.follow(START, START)
    assert odometry.pose == (START.x, START.y, START.yaw_rad)


def test_drift_has_no_bias() -> None:
    straight, runs = [(1.5, 0.0)] * 40, 400
    ways_m = []
    for seed in range(runs):
        odometry = Odometry(START, 0.1, 0.1, seed)
        end = drive_along(odometry, straight)
        x, y, _ = odometry.pose
        ways_m.append(math.dist((x, y), (START.x, START.y)))
    true_m = math.dist((end.x, end.y), (START.x, START.y))
    mean_m = sum(ways_m) / runs
    deviation_m = math.sqrt(sum((way_m - mean_m) ** 2 for way_m in ways_m) / (runs - 1))
    assert deviation_m > 0.01
    assert abs(mean_m - true_m) < 4 * deviation_m / math.sqrt(runs)


def test_with_v2s_bias_every_motion_is_taken_for_a_longer_one() -> None:
    ways_m = []
    for seed in range(100):
        odometry = Odometry(START, 0.2, 0.1, seed, bias=(0.2, 0.1))
        end = drive_along(odometry, [(1.5, 0.0)] * 40)
        x, y, _ = odometry.pose
        ways_m.append(math.dist((x, y), (START.x, START.y)))
    true_m = math.dist((end.x, end.y), (START.x, START.y))
    assert sum(ways_m) / len(ways_m) == pytest.approx(1.2 * true_m, rel=0.02)


def test_carter_omni_is_declared_as_v2_had_it() -> None:
    folder = Path(str(files("benchbot_sim_taichi"))) / "robots"
    carter, omni = (schema.read(folder / f"{name}.yaml") for name in ("carter", "carter_omni"))
    assert omni["noise"] == {"linear": 0.2, "angular": 0.1, "linear_bias": 0.2, "angular_bias": 0.1}
    assert omni["stops_before_contact"] is False
    assert omni["tolerances"] == {"position_m": 0.01, "angle_deg": 1.0}
    differ = {key for key in carter.keys() | omni.keys() if carter.get(key) != omni.get(key)}
    assert differ == {"name", "description", "noise", "tolerances", "stops_before_contact"}
