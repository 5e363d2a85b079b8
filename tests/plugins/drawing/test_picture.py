from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing import picture
from benchbot.plugins.drawing.palette import PRINT_CLASSES, Color, class_colors
from tests.made_results import Make, chair, ground_truth

SCORES = {
    "method": {"name": "omq", "version": "1.0", "headline": "OMQ"},
    "scores": {"OMQ": 0.5, "avg_label": 1.0, "avg_fp_quality": 0.0},
}
PATH = [Pose.planar(0.2 * i, 0.1 * i, 0.3 * i) for i in range(8)]


def frame(red: int) -> NDArray[np.uint8]:
    return np.full((54, 96, 3), (red, 10, 20), np.uint8)


def has_color(image: Image.Image, color: Color) -> bool:
    return bool((np.asarray(image) == color).all(axis=-1).any())


def test_the_picture_shows_frames_and_both_maps(make_result: Make) -> None:
    image = picture.draw(
        {0: frame(200), 3: frame(100), 7: frame(50)}, make_result(0.1, 3.0), ground_truth(1, chair(0.0)), SCORES, PATH
    )

    assert (image.mode, image.size) == ("RGB", (1840, 1000))
    for color in ((200, 10, 20), (100, 10, 20), (50, 10, 20), class_colors(["chair"], PRINT_CLASSES)["chair"]):
        assert has_color(image, color)


def test_the_same_input_gives_the_same_picture(make_result: Make) -> None:
    def once() -> bytes:
        return picture.draw({0: frame(200)}, make_result(0.1), ground_truth(1, chair(0.0)), SCORES, PATH).tobytes()

    assert once() == once()


@pytest.mark.parametrize("places", [(), (0.0,)])
@pytest.mark.parametrize("path", [[], PATH[:1]])
def test_little_to_show_is_no_trouble(make_result: Make, places: tuple[float, ...], path: list[Pose]) -> None:
    image = picture.draw({}, make_result(*places), ground_truth(1), SCORES, path)

    assert image.size == (1840, 1000)


def test_an_estimate_far_outside_makes_the_map_no_smaller(make_result: Make) -> None:
    near, far = (
        np.asarray(picture.draw({}, make_result(*places), ground_truth(1, chair(0.0)), SCORES, PATH))
        for places in ((0.1,), (0.1, 1000.0))
    )

    assert (near[:, :1500] == far[:, :1500]).all()  # beside it, it is counted
    assert (near != far).any()


def test_provenance_is_told_when_there_is_some(make_result: Make, failed_episode: dict[str, Any]) -> None:
    plain, told = (
        picture.draw({}, make_result(0.0, **keys), ground_truth(1), SCORES, PATH)
        for keys in ({}, {"provenance": failed_episode["provenance"]})
    )

    assert plain.tobytes() != told.tobytes()
