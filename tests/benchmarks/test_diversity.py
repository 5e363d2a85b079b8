"""How many distinct models the generator has, as the benchmark counts them."""

from dataclasses import replace

import numpy as np
import pytest

from benchbot_scenes.catalogue import AssetModel, pack
from benchbot_scenes.variations import OWN, Palette, SurfaceFinish, Varying
from benchmarks.bench_diversity import distinct, lab, varying_models

FEW = range(1, 13)


def in_finishes(*colors: tuple[float, float, float], scale: tuple[float, float] = (1.0, 1.0)) -> AssetModel:
    """A table in the tints of one palette."""
    table = pack("household").model("table_dining_oak")
    palette = Palette("tints", tuple(SurfaceFinish(color, OWN) for color in colors))
    return replace(table, varies=Varying((("xyz", *scale),), (palette,)))


def test_white_grey_and_red_are_where_cielab_has_them() -> None:
    found = lab(np.array([[1.0, 1.0, 1.0], [0.18, 0.18, 0.18], [1.0, 0.0, 0.0]]))
    expected = np.array([[100.0, 0.0, 0.0], [49.5, 0.0, 0.0], [53.24, 80.09, 67.2]])
    np.testing.assert_allclose(found, expected, atol=0.1)


def test_what_cannot_be_told_apart_is_one() -> None:
    assert distinct(in_finishes((1.0, 1.0, 1.0)), [1]) == 1
    assert distinct(in_finishes((0.2, 0.2, 0.2)), [1]) == 2
    assert distinct(in_finishes((0.2, 0.2, 0.2), (0.2, 0.2, 0.2)), range(1, 30)) <= 3


def test_another_size_is_another_model() -> None:
    table = in_finishes((1.0, 1.0, 1.0), scale=(1.05, 1.05))
    assert distinct(table, [1]) == 2
    assert distinct(table, [1], by_scale=False) == 1


def test_the_supply_has_more_than_a_thousand_by_colour_alone() -> None:
    assert sum(distinct(model, FEW, by_scale=False) for model in varying_models()) > 1000


@pytest.mark.parametrize(("kind", "least"), [("picture", 40), ("book", 24), ("chair", 40)])
def test_pictures_books_and_chairs_differ(kind: str, least: int) -> None:
    among = [model for model in varying_models() if model.kind == kind]
    assert sum(distinct(model, FEW, by_scale=False) for model in among) >= least
