from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure

from benchbot.core.errors import BenchbotError
from benchbot.plugins.formats.object_map import create
from benchbot_api.extras import CLASS_TO_COLOR_MAP, get_bbox3d, vis_semantic_map3d

OBJECTS = [
    {"class": "table", "centroid": [1.0, 2.0, 0.4], "extent": [1.2, 0.8, 0.8]},
    {"class": "cup", "centroid": [1.0, 2.0, 0.9], "extent": [0.1, 0.1, 0.2]},
]
Numbers = st.tuples(*[st.floats(0.01, 100)] * 3)


def test_every_class_but_the_background_has_a_colour_of_its_own() -> None:
    assert [*CLASS_TO_COLOR_MAP, "background"] == create()["class_list"]
    assert len(set(CLASS_TO_COLOR_MAP.values())) == 30
    assert all(is_color_like(color) for color in CLASS_TO_COLOR_MAP.values())


def test_corners_are_in_the_order_of_v2() -> None:
    below = [[-1, 1, -0.5], [-1, -1, -0.5], [1, -1, -0.5], [1, 1, -0.5]]
    above = [[x, y, 0.5] for x, y, _ in below]

    np.testing.assert_array_equal(get_bbox3d([2, 2, 1], [0, 0, 0]), below + above)


@given(Numbers, Numbers)
def test_corners_span_the_box(extent: tuple[float, float, float], centroid: tuple[float, float, float]) -> None:
    corners = get_bbox3d(extent, centroid)

    np.testing.assert_allclose(np.ptp(corners, axis=0), extent, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(corners.mean(axis=0), centroid, rtol=1e-9)


def test_a_map_is_drawn_to_scale() -> None:
    figure = Figure()
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(projection="3d")
    vis_semantic_map3d(axes, OBJECTS, CLASS_TO_COLOR_MAP, "k")
    figure.savefig(BytesIO())

    assert [box.get_label() for box in axes.collections[::2]] == ["table", "cup"]
    assert {round(high - low, 6) for low, high in (axes.get_xlim(), axes.get_ylim(), axes.get_zlim())} == {1.2}


def test_an_empty_map_is_drawn() -> None:
    vis_semantic_map3d(Figure().add_subplot(projection="3d"), [], CLASS_TO_COLOR_MAP, "k")


def test_a_class_without_a_colour_is_an_error_in_words() -> None:
    axes = Figure().add_subplot(projection="3d")

    with pytest.raises(BenchbotError, match="'tabel' has no colour"):
        vis_semantic_map3d(axes, [{**OBJECTS[0], "class": "tabel"}], CLASS_TO_COLOR_MAP, "k")
