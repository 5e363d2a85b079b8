import math
from itertools import combinations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.text import Annotation

from benchbot.plugins.drawing.figures import draw_maps, scale_length_m, style
from benchbot.plugins.drawing.map_model import Box, MapObject, MapPath, SceneMap
from benchbot.plugins.drawing.palette import PRINT_CLASSES, class_colors
from benchbot.plugins.drawing.scene_maps import chosen, fitted


@given(st.floats(0.02, 1e5))
def test_a_scale_bar_has_a_round_length_and_is_a_tenth_to_a_quarter_wide(width_m: float) -> None:
    length_m = scale_length_m(width_m)
    assert width_m / 10.01 <= length_m <= width_m / 3.99
    leading = length_m / 10 ** math.floor(math.log10(length_m * 1.0001))
    assert any(math.isclose(leading, round_one) for round_one in (1, 2, 5))


@given(st.floats(-math.pi, math.pi), st.floats(-50, 50), st.floats(-50, 50), st.integers(2, 30))
def test_an_estimate_that_is_only_moved_and_turned_fits(angle_rad: float, x: float, y: float, count: int) -> None:
    true = np.random.default_rng(count).normal(size=(count, 2))
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    believed = true @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
    np.testing.assert_allclose(fitted(believed, true), true, atol=1e-9)


def test_an_estimate_is_never_mirrored_nor_stretched() -> None:
    true = np.array([[0, 0], [4, 0], [4, 1.0]])
    mirrored = true * (1, -1) * 3
    moved = fitted(mirrored, true)
    sides = [np.linalg.norm(points[1:] - points[:-1], axis=1) for points in (moved, mirrored)]
    np.testing.assert_allclose(*sides)
    turns = [np.linalg.det(points[1:] - points[0]) for points in (moved, mirrored)]
    np.testing.assert_allclose(*turns)


@given(st.sets(st.integers(0, 500), min_size=1), st.integers(1, 40))
def test_frames_are_chosen_evenly_with_the_first_and_the_last(numbers: set[int], count: int) -> None:
    from pathlib import Path

    frames = {number: Path(f"{number:05d}.jpg") for number in numbers}
    found = chosen(frames, count)
    assert found.items() <= frames.items()
    assert len(found) == min(count, len(frames))
    if count > 1:
        assert {min(numbers), max(numbers)} <= found.keys()


@given(st.permutations(range(30)), st.integers(1, 8))
def test_classes_that_stand_side_by_side_have_colours_that_differ(order: list[int], reach: int) -> None:
    names = [f"class {number}" for number in order]
    beside = {name: set(names[max(i - reach, 0) : i + reach + 1]) - {name} for i, name in enumerate(names)}
    degree = max(map(len, beside.values()))

    colors = class_colors(names, PRINT_CLASSES, beside)

    same = [
        pair for pair in combinations(names, 2) if pair[1] in beside[pair[0]] and colors[pair[0]] == colors[pair[1]]
    ]
    # With fewer neighbours than colours each class finds one that none of them has.
    assert degree >= len(PRINT_CLASSES) or not same


def scene(seed: int, solution: str) -> SceneMap:
    random = np.random.default_rng(seed)
    places = random.uniform(-2, 2, (60, 2))
    objects = [
        MapObject(f"thing {i % 20}", estimated=Box((float(x), float(y), 0.5), (0.2, 0.2, 0.2)))
        for i, (x, y) in enumerate(places)
    ]
    return SceneMap("flat:1", objects=tuple(objects), path=MapPath(((0.0, 0.0), (float(seed), 1.0))), solution=solution)


def test_maps_of_one_place_name_their_solutions_show_the_same_part_and_print_no_label_over_another() -> None:
    with style():
        figure = draw_maps([scene(1, "new"), scene(3, "old")], 180.0)
        figure.draw_without_rendering()
        panels = figure.axes

        assert [panel.get_title() for panel in panels] == ["(a) new, flat:1", "(b) old, flat:1"]
        assert panels[0].get_xlim() == panels[1].get_xlim()
        assert panels[0].get_ylim() == panels[1].get_ylim()
        for panel in panels:
            labels = [text for text in panel.texts if isinstance(text, Annotation)]
            assert len(labels) > 20
            boxes = [label.get_window_extent() for label in labels]
            for one, other in combinations(boxes, 2):
                wide = min(one.x1, other.x1) - max(one.x0, other.x0)
                high = min(one.y1, other.y1) - max(one.y0, other.y0)
                assert min(wide, high) < 1.0  # a pixel of the 100 of an inch
