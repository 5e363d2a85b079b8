"""Triangles as cells of a grid."""

import numpy as np
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from benchbot_scenes.slab import project_slab, rasterise

CELL_M = 0.1
SHAPE = (30, 20)

coordinates = st.tuples(st.floats(0.0, 3.0), st.floats(0.0, 2.0))


def test_a_wall_is_the_line_that_it_stands_on() -> None:
    wall = np.array([[(0.5, 1.0, 0.0), (2.5, 1.0, 0.0), (2.5, 1.0, 2.0)]])
    touched = rasterise(project_slab(wall, 0.1, 1.0), (0.0, 0.0), SHAPE, CELL_M)
    assert touched[6:24, 10].all()
    assert touched.sum() <= 21


def test_what_is_above_is_left_out() -> None:
    shelf = np.array([[(0.5, 0.5, 1.2), (2.5, 0.5, 1.2), (2.5, 1.5, 1.2)]])
    assert not rasterise(project_slab(shelf, 0.03, 1.1), (0.0, 0.0), SHAPE, CELL_M).any()


def test_what_is_off_the_grid_is_left_out() -> None:
    table = np.array([[(-9.0, 0.5), (-8.0, 0.5), (-8.0, 1.5)]])
    assert not rasterise(table, (0.0, 0.0), SHAPE, CELL_M).any()


@settings(max_examples=40, deadline=None)
@given(st.lists(coordinates, min_size=3, max_size=3))
def test_cells_within_are_touched_and_none_outside(corners: list[tuple[float, float]]) -> None:
    triangle = shapely.Polygon(corners)
    assume(triangle.area > 0.01)
    touched = rasterise(np.array([corners]), (0.0, 0.0), SHAPE, CELL_M)
    columns, rows = np.indices(SHAPE)
    centres = shapely.points((columns + 0.5) * CELL_M, (rows + 0.5) * CELL_M)
    within = shapely.contains(triangle, centres) & (shapely.distance(centres, triangle.exterior) > CELL_M)
    assert touched[within].all()
    assert (shapely.distance(centres, triangle)[touched] <= CELL_M * np.sqrt(0.5) + 1e-6).all()
