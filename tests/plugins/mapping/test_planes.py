"""Floor and walls of a room that is turned against the axes, with furniture in it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from benchbot.mapping import floor_height_m, on_floor, on_walls

Points = NDArray[np.float64]


def surface(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Points:
    """Return points on a rectangle, 4 cm apart."""
    lines = [np.arange(low, high + 1e-9, 0.04) for low, high in (x, y, z)]
    return np.stack(np.meshgrid(*lines), -1).reshape(-1, 3)


def room(turned_rad: float = 0.3, noise_m: float = 0.005, height_m: float = 0.0) -> dict[str, Points]:
    floor = surface((-2, 2), (-1.5, 1.5), (0, 0))
    walls = [surface((-2, 2), (y, y), (0.02, 2)) for y in (-1.5, 1.5)]
    walls += [surface((x, x), (-1.5, 1.5), (0.02, 2)) for x in (-2, 2)]
    table = np.concatenate([surface((0, 1), (0, 0.6), (0.7, 0.7)), surface((0, 1), (0, 0), (0.2, 0.7))])
    cosine, sine = np.cos(turned_rad), np.sin(turned_rad)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    chance = np.random.default_rng(7)
    return {
        name: points @ turn.T + chance.normal(0, noise_m, points.shape) + (0.5, 0.2, height_m)
        for name, points in {"floor": floor, "walls": np.concatenate(walls), "table": table}.items()
    }


@pytest.mark.parametrize("turned_rad", [0.0, 0.3, 1.2])
def test_walls_are_found_and_furniture_is_left(turned_rad: float) -> None:
    parts = room(turned_rad)
    found = on_walls(np.concatenate(list(parts.values())))
    floor, walls, table = np.split(found, np.cumsum([len(part) for part in parts.values()])[:-1])

    assert walls.mean() > 0.97
    assert not table.any()
    assert floor.mean() < 0.2, "only where it meets a wall"


def test_furniture_below_a_ceiling_is_no_wall() -> None:
    """A column of floor, table and ceiling reaches as high as one of a wall, and is all but empty."""
    parts = room()
    ceiling = parts["floor"] + np.array([0, 0, 2.0])
    points = np.concatenate([*parts.values(), ceiling, parts["table"] + np.array([0, 0, 0.3])])
    found = on_walls(points)

    assert found[len(parts["floor"]) :][: len(parts["walls"])].mean() > 0.97
    assert not found[-len(parts["table"]) :].any()


def test_walls_with_a_door_between_them_leave_what_stands_in_the_door() -> None:
    left, right = surface((-3, -0.6), (0, 0), (0, 2)), surface((0.6, 3), (0, 0), (0, 2))
    chair = surface((-0.2, 0.2), (-0.2, 0.2), (0.45, 0.45))
    found = on_walls(np.concatenate([left, right, chair]))

    assert found[: len(left) + len(right)].mean() > 0.97
    assert not found[-len(chair) :].any()


def test_two_posts_far_from_each_other_are_no_wall() -> None:
    posts = np.concatenate([surface((x, x + 0.2), (0, 0.1), (0, 2)) for x in (0, 3)])

    assert not on_walls(posts).any()


@pytest.mark.parametrize("height_m", [-0.04, 0.0, 0.11])
def test_the_floor_is_where_most_low_points_are(height_m: float) -> None:
    parts = room(height_m=height_m)
    points = np.concatenate(list(parts.values()))

    assert floor_height_m(points) == pytest.approx(height_m, abs=0.005)
    assert on_floor(parts["floor"], height_m).mean() > 0.999
    assert not on_floor(parts["table"], height_m).any()


def test_nothing_has_neither_floor_nor_walls() -> None:
    assert floor_height_m(np.zeros((0, 3))) == 0.0
    assert not len(on_walls(np.zeros((0, 3))))
    assert not on_walls([[0, 0, 0.0], [0, 0, 3.0]]).any()
