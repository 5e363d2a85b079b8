"""Floor plans: what a ground truth keeps of them, and what is damaged."""

import base64
import lzma
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchbot.core.errors import BenchbotError
from benchbot_task_navigation.floor_plan import FloorPlan, distance_to_box_m
from benchbot_task_navigation.formats import floor_plan
from plugins.task_navigation.tests.floors import floor


def test_a_plan_survives_being_written_to_the_millimetre_and_never_gains_room() -> None:
    clearance_m = np.random.default_rng(0).uniform(0, 3, (7, 5))
    plan = FloorPlan((-1.0, 2.0), 0.1, clearance_m)
    read = FloorPlan.from_ground_truth(plan.as_ground_truth())

    assert (read.origin_xy, read.resolution_m) == (plan.origin_xy, plan.resolution_m)
    lost_m = np.minimum(clearance_m, 2.0) - read.clearance_m
    assert (lost_m > -1e-6).all()
    assert (lost_m < 0.001).all()


@given(arrays.arrays(np.uint16, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.integers(0, 2000)))
def test_any_millimetres_are_kept_as_they_are(millimetres: np.ndarray) -> None:
    plan = FloorPlan((0.0, 0.0), 0.1, millimetres / 1000.0)

    assert (FloorPlan.from_ground_truth(plan.as_ground_truth()).clearance_m == millimetres / 1000.0).all()


def test_the_format_makes_and_checks_plans() -> None:
    made = floor_plan.create([0, 0], 0.5, [[1.0, 0.5], [0.25, 0.0]])
    floor_plan.validate(made)

    assert made["shape"] == [2, 2]


@pytest.mark.parametrize(
    "change",
    [
        {"shape": [3, 3]},
        {"shape": [2]},
        {"shape": [0, 0]},
        {"clearance_mm_differences": "not base64"},
        {"clearance_mm_differences": base64.b64encode(b"not xz").decode()},
        {"clearance_mm_differences": base64.b64encode(lzma.compress(bytes(2**20))).decode()},
        {"clearance_mm_differences": base64.b64encode(lzma.compress(bytes(6))).decode()},
        {"origin": [0]},
        {"resolution_m": "wide"},
    ],
)
def test_a_damaged_plan_is_refused(change: dict[str, Any]) -> None:
    made = floor_plan.create([0, 0], 0.5, [[1.0, 0.5], [0.25, 0.0]])

    with pytest.raises(BenchbotError, match="not a floor plan"):
        floor_plan.validate({**made, **change})


def test_clearance_is_interpolated_and_nothing_is_free_beyond_the_plan() -> None:
    plan = floor(2.0)

    found = plan.clearance_at(np.array([[0.0, 0.0], [0.5125, 0.0], [-0.99, 0.3], [5.0, 5.0]]))
    np.testing.assert_allclose(found, [1.0, 0.4875, 0.01, 0.0], atol=0.0015)


def test_nodes_near_a_box_are_those_within_the_distance_of_its_edge() -> None:
    plan = floor(2.0)
    near = plan.within((0.2, -0.1), (0.4, 0.2), 0.3)

    places = plan.points(np.argwhere(np.ones_like(near)))
    expected = [distance_to_box_m((x, y), (0.2, -0.1), (0.4, 0.2)) <= 0.3 for x, y in places]
    assert near.ravel().tolist() == expected


@pytest.mark.parametrize(
    ("point", "distance_m"), [((0.0, 0.0), 0.0), ((0.5, 0.5), 0.0), ((2.0, 0.0), 1.5), ((3.5, -4.5), 5.0)]
)
def test_the_distance_to_a_box_is_that_to_its_edge_and_nothing_inside(
    point: tuple[float, float], distance_m: float
) -> None:
    assert distance_to_box_m(point, (0.0, 0.0), (1.0, 1.0)) == pytest.approx(distance_m)
