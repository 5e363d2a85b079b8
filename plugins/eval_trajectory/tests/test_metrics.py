"""Errors against numbers worked out by hand, and what must not change them."""

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from benchbot_eval_trajectory import comparison, metrics
from benchbot_eval_trajectory.trajectory import Trajectory
from plugins.eval_trajectory.tests.ways import SHIFTS, TURNS, estimate_of, moved, wander

Vector = tuple[float, float, float]


def straight(steps_m: list[float], yaw_deg: list[float]) -> Trajectory:
    positions = np.zeros((len(steps_m), 3))
    positions[:, 0] = np.cumsum(steps_m)
    return Trajectory(positions, Rotation.from_euler("z", np.reshape(yaw_deg, (-1, 1)), degrees=True).as_matrix())


def test_errors_are_summed_up() -> None:
    found = metrics.summary(np.array([3.0, 4.0, 0.0, 0.0]))

    assert found == metrics.Summary(rmse=2.5, mean=1.75, median=1.5, max=4.0, count=4)
    assert metrics.summary(np.zeros(0)) is None


def test_absolute_errors_are_distances() -> None:
    truth = straight([0, 1, 1], [0, 0, 0])
    estimate = Trajectory(truth.positions_m + np.array([[0, 0, 0], [3, 4, 0], [0, 0, 2]]), truth.rotations)

    assert metrics.absolute_m(estimate, truth).tolist() == [0.0, 5.0, 2.0]


def test_relative_errors_are_those_of_each_step() -> None:
    truth = straight([0, 1, 1, 1], [0, 0, 0, 0])
    estimate = straight([0, 1.5, 1, 1], [0, 0, 30, 30])
    errors_m, errors_deg = metrics.relative(estimate, truth, metrics.neighbours(4))

    # The last step leads sideways, seen from a pose that is turned by 30 degrees.
    assert errors_m == pytest.approx([0.5, 0.0, 2 * np.sin(np.radians(15))])
    assert errors_deg == pytest.approx([0.0, 30.0, 0.0], abs=1e-9)


def test_pairs_by_path_follow_the_way_not_the_beeline() -> None:
    there_and_back = np.array([[0.0, 0, 0], [0.6, 0, 0], [0, 0, 0], [0.6, 0, 0], [0.7, 0, 0], [2.7, 0, 0]])

    assert metrics.pairs_by_path(there_and_back, 1.0).tolist() == [[0, 2], [2, 5]]
    assert metrics.pairs_by_path(there_and_back, 9.0).shape == (0, 2)
    assert metrics.pairs_by_path(there_and_back[:1], 1.0).shape == (0, 2)
    assert metrics.neighbours(1).shape == metrics.neighbours(0).shape == (0, 2)


@given(TURNS, SHIFTS)
def test_where_trajectories_are_seen_from_does_not_change_relative_errors(turn: Vector, shift: Vector) -> None:
    truth = wander(50)
    estimate = estimate_of(truth)
    pairs = metrics.pairs_by_path(truth.positions_m, 0.5)
    expected = metrics.relative(estimate, truth, pairs)

    for found in (
        metrics.relative(moved(estimate, turn, shift), truth, pairs),
        metrics.relative(estimate, moved(truth, turn, shift), pairs),
    ):
        assert found[0] == pytest.approx(expected[0], abs=1e-9)
        assert found[1] == pytest.approx(expected[1], abs=1e-6)


@pytest.mark.parametrize("align", ["none", "se3", "sim3"])
def test_the_truth_has_no_error(align: str) -> None:
    found = comparison.compare(wander(), wander(), align=align)

    assert found["poses"] == 200
    assert found["scale"] == pytest.approx(1)
    assert all(values["max"] < 1e-5 for values in found["errors"].values())
    assert found["errors"]["ATE_m"]["max"] < 1e-12
