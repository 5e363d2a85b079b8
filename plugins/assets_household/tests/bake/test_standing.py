"""Where things can stand on a model."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plugins.assets_household.bake.standing import standing_places


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """The twelve triangles of a box, outward."""
    corner = np.array([[(low, high)[(i >> a) & 1][a] for a in range(3)] for i in range(8)])
    faces = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return np.array([[corner[a], corner[b], corner[c]] for q in faces for a, b, c in (q[:3], (q[0], *q[2:]))])


def _table() -> np.ndarray:
    legs = [_box((x - 0.03, y - 0.03, 0), (x + 0.03, y + 0.03, 0.7)) for x in (-0.55, 0.55) for y in (-0.35, 0.35)]
    return np.concatenate([_box((-0.6, -0.4, 0.7), (0.6, 0.4, 0.74)), *legs])


def test_top_of_a_table_is_found_whole() -> None:
    (place,) = standing_places(_table())
    assert place["z_m"] == pytest.approx(0.74, abs=0.002)
    np.testing.assert_allclose(place["low_m"], (-0.6, -0.4), atol=0.021)
    np.testing.assert_allclose(place["high_m"], (0.6, 0.4), atol=0.041)
    assert place["headroom_m"] == 1.5


def test_boards_of_a_shelf_have_the_room_up_to_the_next_board() -> None:
    boards = [_box((-0.15, -0.4, z), (0.15, 0.4, z + 0.02)) for z in (0.1, 0.45, 0.8)]
    sides = [_box((-0.15, y, 0), (0.15, y + 0.02, 0.82)) for y in (-0.42, 0.4)]
    places = standing_places(np.concatenate(boards + sides))
    assert [place["z_m"] for place in places] == [pytest.approx(z, abs=0.002) for z in (0.12, 0.47, 0.82)]
    assert [place["headroom_m"] for place in places] == [pytest.approx(h, abs=0.005) for h in (0.33, 0.33, 1.5)]
    assert all(place["low_m"][1] >= -0.41 and place["high_m"][1] <= 0.43 for place in places[:2])


def test_thing_on_the_top_is_left_out_of_the_rectangle() -> None:
    place, _ = standing_places(np.concatenate([_table(), _box((0.2, -0.4, 0.74), (0.6, 0.4, 0.84))]))
    assert place["high_m"][0] <= 0.2
    np.testing.assert_allclose(place["low_m"], (-0.6, -0.4), atol=0.021)


@pytest.mark.parametrize(
    "shape",
    [
        _box((-0.05, -0.4, 0.0), (0.05, 0.4, 0.9)),
        np.array([[[0.0, 0.0, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]]]),
    ],
    ids=["too narrow", "sloping"],
)
def test_nothing_stands_there(shape: np.ndarray) -> None:
    assert standing_places(shape) == []


@settings(max_examples=15, deadline=None)
@given(x=st.floats(0.3, 1.2), y=st.floats(0.3, 1.2), z=st.floats(0.05, 1.5))
def test_rectangle_lies_on_the_box(x: float, y: float, z: float) -> None:
    (place,) = standing_places(_box((-x / 2, -y / 2, 0), (x / 2, y / 2, z)))
    assert place["z_m"] == pytest.approx(z, abs=0.001)
    assert np.all(np.abs([*place["low_m"], *place["high_m"]]) <= np.array([x, y, x, y]) / 2 + 0.021)
    area = np.prod(np.subtract(place["high_m"], place["low_m"]))
    assert area >= 0.75 * x * y
