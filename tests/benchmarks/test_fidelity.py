"""What the benchmark of pictures says of rows whose figures are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import views
from benchmarks.bench_fidelity import Row, clipped, side_by_side, summary, wall_ratio, wall_sigmas

GOOD = Row("a:1", "day", 0, 0.97, 4.0, 0.3, (0.5, -0.5, 0.0), 0.001, 0.0, 1000, 0.1, 0.36, 0.25)


def test_walls_are_taken_together_by_their_pixels() -> None:
    small = replace(GOOD, wall_pixels=100, wall_variance=4.0, reference_wall_variance=1.0)
    large = replace(GOOD, wall_pixels=300, wall_variance=1.0, reference_wall_variance=1.0)
    assert wall_sigmas([small, large]) == pytest.approx((math.sqrt(1.75), 1.0))


def test_a_wall_without_anything_on_it_counts_as_a_tenth_of_a_byte() -> None:
    """The covariance of two noisy pictures of a blank wall may fall below zero."""
    blank = replace(GOOD, wall_variance=0.04, reference_wall_variance=-0.01)
    assert wall_ratio([blank]) == pytest.approx(2.0)


def test_floors_name_the_worst_and_count_who_keeps_to_them() -> None:
    bad = replace(GOOD, environment="b:1", time="night", ssim=0.9, rmse=6.0, bias_rgb=(0.0, 0.0, -1.5))
    bare = replace(GOOD, environment="c:1", time="night", wall_pixels=0, wall_variance=9.0)
    lines = list(summary([GOOD, bad, bare]))
    text = "\n".join(lines[lines.index("\nfloors") + 1 :])
    assert [line.split(" in ")[1] for line in text.splitlines()] == [
        "2 of 3, median 0.97, worst 0.9 (b:1 night)",
        "2 of 3, median 4, worst 6 (b:1 night)",
        "2 of 3, median 0.5, worst 1.5 (b:1 night)",
        "2 of 2, median 1.2, worst 1.2 (a:1 day)",
        "1 of 1, median 0.1, worst 0.1 (a:1 day)",
    ]


def test_a_pixel_is_clipped_when_any_channel_is() -> None:
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[0, 0] = (255, 10, 10)
    picture[0, 1] = (254, 254, 254)
    assert clipped(picture) == 0.25


def test_equal_pictures_differ_by_grey_and_nothing_is_drawn_beside_walls() -> None:
    picture = np.full((40, 60, 3), 90, np.uint8)
    walls = np.zeros((40, 60), np.int32)
    walls[:, :30] = 1
    ours, reference, difference, waves = np.hsplit(side_by_side(picture, picture.astype(float), walls), 4)
    assert (ours == reference).all()
    assert (difference == 128).all()
    assert (waves[:, :30] == 128).all()
    assert not waves[:, 30:].any()


@given(st.lists(st.tuples(st.integers(0, 9), st.floats(0, 9)), min_size=1, max_size=30), st.integers(1, 5))
def test_middling_places_are_those_of_the_order(values: list[tuple[float, ...]], count: int) -> None:
    places = views.middling(values, count)
    chosen = [values[place] for place in places]
    assert len(chosen) == count
    assert chosen == sorted(chosen)
    assert values[views.middling(values, 1)[0]] == sorted(values)[len(values) // 2]


def test_the_median_is_the_same_whatever_the_order() -> None:
    values = [(3.0,), (1.0,), (2.0,)]
    assert views.middling(values, 1) == [2]
    assert views.middling(values, 3) == [1, 2, 0]
