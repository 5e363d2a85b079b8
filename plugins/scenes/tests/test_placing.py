"""Transforms, and models of another pack in place of those that a layout names."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_scenes.catalogue import AssetModel, Catalogue
from benchbot_scenes.layout import Placement
from benchbot_scenes.placing import Placed, fit_into, place, turned

LENGTHS = st.floats(0.05, 3.0)


def model(name: str, size: tuple[float, float, float], placement: str = "floor") -> AssetModel:
    return AssetModel(name, Path(f"{name}.glb"), "chair", "chair", placement, size, (), False, 12, "CC0-1.0", "", "")


def stood_in(wanted: tuple[float, float, float], *models: AssetModel, placement: str = "floor") -> Placed:
    """The models of another pack in the place of one of this size at (1, 2, 0)."""
    original = model("original", (1.0, 1.0, 1.0), placement)
    other = Catalogue("other", {entry.id: entry for entry in models})
    return place(Placement("seat", "original", (1.0, 2.0, 0.0), size_m=wanted), original, other)


def box(placed: Placed) -> np.ndarray:
    """Low and high corner of the placed model's box."""
    x, y, z = placed.model.size_m
    corners = np.array([[sx * x / 2, sy * y / 2, up * z, 1] for sx in (-1, 1) for sy in (-1, 1) for up in (0, 1)])
    points = (corners @ placed.matrix.T)[:, :3]
    return np.round([points.min(axis=0), points.max(axis=0)], 6)


def test_a_stand_in_fills_the_box_of_the_original() -> None:
    placed = stood_in((0.5, 0.6, 0.9), model("other", (1.0, 1.1, 2.0)))
    assert placed.model.id == "other"
    assert placed.class_name == "chair"
    assert box(placed) == pytest.approx(np.array([[0.75, 1.7, 0.0], [1.25, 2.3, 0.9]]))


def test_the_original_stays_rather_than_that_another_is_stretched_much() -> None:
    placed = stood_in((0.5, 0.5, 1.0), model("other", (1.0, 1.0, 1.0)))
    assert placed.model.id == "original"
    assert box(placed) == pytest.approx(np.array([[0.75, 1.75, 0.0], [1.25, 2.25, 1.0]]))


def test_one_is_chosen_that_need_not_be_stretched_much() -> None:
    tall, long = model("tall", (1.0, 1.0, 1.4)), model("long", (1.5, 1.0, 1.0))
    chosen = {stood_in((0.5, 0.5, height), tall, long).model.id for height in (0.55, 0.7, 0.8)}
    assert chosen == {"tall"}


def test_it_is_turned_where_it_lies_across() -> None:
    placed = stood_in((1.0, 2.0, 0.7), model("other", (2.0, 1.0, 0.7)))
    assert box(placed) == pytest.approx(np.array([[0.5, 1.0, 0.0], [1.5, 3.0, 0.7]]))


def test_it_keeps_its_front_where_turning_gains_little() -> None:
    assert stood_in((0.5, 0.55, 0.9), model("other", (0.55, 0.5, 0.9))).matrix[0, 0] > 0


def test_what_hangs_stays_at_its_wall() -> None:
    flat = model("other", (0.05, 0.4, 0.4), "wall")
    low, high = box(stood_in((0.04, 0.4, 0.4), flat, placement="wall"))
    assert low[0] == pytest.approx(1.0 - 0.02)
    assert high[0] == pytest.approx(1.0 + 0.02)


def test_what_hangs_is_replaced_by_what_hangs() -> None:
    alarm, wall = model("alarm", (0.1, 0.1, 0.1)), model("wall", (0.05, 0.3, 0.3), "wall")
    assert stood_in((0.05, 0.3, 0.3), alarm, wall, placement="wall").model.id == "wall"
    assert stood_in((0.1, 0.1, 0.1), alarm, wall, placement="wall").model.id == "alarm"


def test_a_class_that_the_pack_lacks_stays() -> None:
    assert stood_in((0.5, 0.5, 0.9)).model.id == "original"


def test_the_same_object_always_gets_the_same_stand_in() -> None:
    models = [model(f"chair {i}", (1.0, 1.0, 1.0)) for i in range(5)]
    assert len({stood_in((0.5, 0.5, 0.9), *models).model.id for _ in range(5)}) == 1


@given(st.tuples(LENGTHS, LENGTHS, LENGTHS), st.tuples(LENGTHS, LENGTHS, LENGTHS), st.sampled_from(["floor", "wall"]))
def test_a_stand_in_fills_the_box_exactly(
    wanted: tuple[float, float, float], size: tuple[float, float, float], placement: str
) -> None:
    matrix = fit_into(np.array(wanted), model("other", size, placement))
    low, high = box(Placed("seat", model("other", size, placement), matrix, "chair", False))
    assert low == pytest.approx([-wanted[0] / 2, -wanted[1] / 2, 0.0], abs=2e-6)
    assert high == pytest.approx([wanted[0] / 2, wanted[1] / 2, wanted[2]], abs=2e-6)


@given(st.integers(-8, 8))
def test_quarter_turns_are_exact(quarters: int) -> None:
    assert set(turned(90.0 * quarters).ravel()) <= {-1.0, 0.0, 1.0}


@given(st.floats(-720, 720), st.floats(-720, 720))
def test_turns_add_up(first: float, second: float) -> None:
    assert np.allclose(turned(first) @ turned(second), turned(first + second))
