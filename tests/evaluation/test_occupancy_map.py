"""Maps of ROS's map_server: where they lie, what is free in them, and what of them is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from benchbot.core.errors import BenchbotError
from benchbot.evaluation.occupancy_map import OccupancyMap, map_file, read

ABOUT = {
    "image": "room.pgm",
    "mode": "trinary",
    "resolution": 0.5,
    "origin": [-1.0, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}
FREE, OCCUPIED, UNKNOWN = 254, 0, 205
PICTURE = np.array([[UNKNOWN, FREE, FREE], [OCCUPIED, FREE, UNKNOWN]], np.uint8)


def room(folder: Path, picture: Any = PICTURE, **changes: Any) -> Path:
    """Write a map of 3 x 2 cells of half a metre, its lower left corner at (-1, 2)."""
    about = {**ABOUT, **changes}
    Image.fromarray(picture).save(folder / str(about["image"]))
    path = folder / "room.yaml"
    path.write_text(yaml.safe_dump(about))
    return path


def places(found: OccupancyMap, *points: tuple[float, float]) -> list[str]:
    return [found.place(x, y) for x, y in points]


def test_what_is_dark_is_occupied_and_what_is_light_is_free(tmp_path: Path) -> None:
    found = read(room(tmp_path))

    assert places(found, (-0.75, 2.25), (-0.25, 2.25), (0.25, 2.25)) == ["occupied", "free", "unknown"]
    assert places(found, (-0.75, 2.75), (-1.1, 2.2), (0.0, 3.1)) == ["unknown", "outside", "outside"]


def test_a_map_turned_by_a_right_angle_lies_to_the_left_of_its_corner(tmp_path: Path) -> None:
    found = read(room(tmp_path, origin=[0.0, 0.0, math.pi / 2]))

    assert places(found, (-0.25, 0.25), (-0.25, 0.75), (0.25, 0.25)) == ["occupied", "free", "outside"]


@given(
    origin=st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-7, 7)),
    resolution_m=st.floats(0.01, 1.0),
    cell=st.tuples(st.integers(0, 8), st.integers(0, 5)),
)
def test_the_middle_of_each_cell_is_in_it_wherever_the_map_lies(
    origin: tuple[float, float, float], resolution_m: float, cell: tuple[int, int]
) -> None:
    row, column = cell
    free = np.zeros((9, 6), bool)
    free[row, column] = True
    found = OccupancyMap(~free, free, resolution_m, origin)
    across, up = (column + 0.5) * resolution_m, (9 - row - 0.5) * resolution_m
    x, y, yaw = origin
    middle = x + math.cos(yaw) * across - math.sin(yaw) * up, y + math.sin(yaw) * across + math.cos(yaw) * up

    assert found.place(*middle) == "free"
    assert found.corners()[0] == pytest.approx((x, y))


def test_a_negated_map_is_the_other_way_round(tmp_path: Path) -> None:
    plain, negated = read(room(tmp_path)), read(room(tmp_path, 255 - PICTURE, negate=1))
    assert (negated.occupied == plain.occupied).all()
    assert (negated.free == plain.free).all()


@pytest.mark.parametrize("image", ["room.pgm", "room.png", "room.bmp"])
def test_other_pictures_are_read_too(tmp_path: Path, image: str) -> None:
    assert read(room(tmp_path, image=image)).place(-0.25, 2.25) == "free"


def test_the_thresholds_are_the_maps_own(tmp_path: Path) -> None:
    assert read(room(tmp_path, free_thresh=0.25, occupied_thresh=0.9)).free.sum() == 5


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"mode": "raw"}, "Its mode is 'raw'; understood here: trinary, scale"),
        ({"resolution": 0}, "Its resolution is 0: it is the side of a pixel in metres"),
        ({"resolution": "fine"}, "A number in it is none"),
        ({"origin": [0.0, 0.0]}, "Its origin is the pose of the lower left corner"),
        ({"origin": [float("nan"), 0.0, 0.0]}, "Its origin is the pose of the lower left corner"),
        ({"free_thresh": 0.7}, "free below 0.7 and occupied above 0.65"),
    ],
)
def test_what_cannot_be_used_is_said(tmp_path: Path, changes: dict[str, Any], why: str) -> None:
    with pytest.raises(BenchbotError, match=r"The map .*room.yaml cannot be used") as caught:
        read(room(tmp_path, **changes))
    assert why in caught.value.why


def test_pictures_that_are_none_or_have_transparency_are_refused(tmp_path: Path) -> None:
    path = room(tmp_path, np.zeros((2, 3, 4), np.uint8), image="room.png")
    with pytest.raises(BenchbotError, match="cannot be used") as caught:
        read(path)
    assert "without transparency" in caught.value.why
    (tmp_path / "room.png").write_bytes(b"P5 no picture")
    with pytest.raises(BenchbotError, match="cannot be used") as caught:
        read(path)
    assert "cannot be read" in caught.value.why


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[1, 2]", "It is no mapping"),
        ("rooms: []", "It lacks image, resolution"),
        ("a: [", "no YAML file"),
        (None, "no YAML file"),
    ],
)
def test_other_files_are_no_maps(tmp_path: Path, text: str | None, why: str) -> None:
    if text is not None:
        (tmp_path / "room.yaml").write_text(text)
    with pytest.raises(BenchbotError, match="cannot be used") as caught:
        read(tmp_path / "room.yaml")
    assert why in caught.value.why


@pytest.mark.parametrize(
    ("data", "file"),
    [
        ({"type": "real", "map_path": "../scans/hall.yaml"}, "scans/hall.yaml"),
        ({"type": "real", "occupancy_map": "../maps/hall.yaml"}, "maps/hall.yaml"),
        ({"type": "real"}, "maps/hall_1.yaml"),
        ({"type": "sim_taichi", "map_path": "../layouts/hall.yaml"}, "maps/hall_1.yaml"),
        ({"type": "sim_taichi", "map_path": "../hall.glb", "occupancy_map": "../m.yaml"}, "m.yaml"),
    ],
)
def test_of_a_real_environment_map_path_names_the_map(tmp_path: Path, data: dict[str, str], file: str) -> None:
    hall = {"name": "hall", "variant": 1, **data}
    assert map_file(hall, tmp_path / "environments").resolve() == (tmp_path / file).resolve()
