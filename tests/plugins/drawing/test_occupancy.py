"""Walls behind a map: an occupancy map of ROS's map_server, as it is found beside an environment."""

import io
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.plugin_manager import load
from benchbot.plugins.drawing.map_model import MapPath, SceneMap, occupancy_of
from benchbot.plugins.report.camera_pictures import Budget
from benchbot.plugins.report.page import draw

ABOUT = {
    "image": "flat_1.pgm",
    "resolution": 0.5,
    "origin": [-1.0, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def flat(folder: Path, **changes: Any) -> Declaration:
    """A flat of 4 x 3 cells of half a metre, unknown but for two occupied ones: one at the left of the lowest row."""
    cells = np.full((3, 4), 205, np.uint8)
    cells[2, 0] = cells[1, 2] = 0
    for name in ("maps", "environments"):
        (folder / name).mkdir()
    Image.fromarray(cells).save(folder / "maps" / "flat_1.pgm")
    (folder / "maps" / "flat_1.yaml").write_text(yaml.safe_dump({**ABOUT, **changes}))
    data = {"name": "flat", "variant": 1}
    return Declaration("environments", "flat:1", folder / "environments" / "flat_1.yaml", "flats", data)


def test_the_picture_holds_what_is_occupied_and_says_where_it_lies(tmp_path: Path) -> None:
    floor = occupancy_of(flat(tmp_path))

    assert floor is not None
    # The two cells are in the lower two rows and the first three columns.
    assert (floor.low, floor.high) == ((-1.0, 2.0), (0.5, 3.0))
    alpha = np.asarray(Image.open(io.BytesIO(floor.png((1, 2, 3)))).convert("RGBA"))[..., 3]
    assert (alpha > 0).tolist() == [[False, False, True], [True, False, False]]


def test_it_lies_behind_the_map_at_its_scale(tmp_path: Path) -> None:
    path = MapPath(((-1.0, 2.0), (0.5, 3.0)), (), recorded=True)
    drawing = draw(SceneMap(occupancy=occupancy_of(flat(tmp_path)), path=path), [], Budget())

    assert drawing is not None
    assert drawing.walls is not None
    walls = drawing.layout.floor
    assert walls is not None
    (left, low), (right, high) = drawing.layout.path
    assert (walls.left, walls.top) == pytest.approx((left, high), abs=0.1)
    assert (walls.width, walls.height) == pytest.approx((right - left, low - high), abs=0.1)


@pytest.mark.parametrize(
    "changes",
    [
        {"image": "none.pgm"},
        {"image": "flat_1.yaml"},
        {"resolution": "fine"},
        {"resolution": 0},
        {"origin": [float("nan"), 0.0, 0.0]},
        {"occupied_thresh": 1.0},
    ],
)
def test_a_map_that_cannot_be_shown_is_left_out(tmp_path: Path, changes: dict[str, Any]) -> None:
    assert occupancy_of(flat(tmp_path, **changes)) is None


def test_a_turned_map_is_drawn_upright(tmp_path: Path) -> None:
    floor = occupancy_of(flat(tmp_path, origin=[0.0, 0.0, math.pi / 2]))

    assert floor is not None
    # The lowest row of the picture is the first column to the left of its corner, from below.
    assert floor.low == pytest.approx((-1.0, 0.0))
    assert floor.high == pytest.approx((0.0, 1.5))
    assert floor.occupied.tolist() == [[True, False], [False, False], [False, True]]


def test_of_a_real_environment_the_map_is_what_map_path_names(tmp_path: Path) -> None:
    declared = flat(tmp_path)
    (tmp_path / "maps" / "flat_1.yaml").rename(tmp_path / "maps" / "scan.yaml")
    real = {**declared.data, "type": "real", "map_path": "../maps/scan.yaml"}

    assert occupancy_of(replace(declared, data=real)) is not None
    assert occupancy_of(replace(declared, data={**real, "type": "sim_taichi"})) is None


def test_without_a_map_there_is_none(tmp_path: Path) -> None:
    declared = flat(tmp_path)
    (tmp_path / "maps" / "flat_1.yaml").unlink()

    assert occupancy_of(declared) is None
    assert occupancy_of(None) is None


def test_the_installed_rooms_have_theirs() -> None:
    rooms = Catalog(load()).pool("environments")

    assert all(occupancy_of(rooms[f"{place}:1"]) is not None for place in ("miniroom", "house", "company"))
