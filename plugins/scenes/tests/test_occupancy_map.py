"""Maps as ROS reads them."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image

from benchbot_scenes.free_space import free_space
from benchbot_scenes.occupancy_map import occupancy, write_occupancy_map
from plugins.scenes.tests.boxes import box, room, scene

SCENE = scene(*room(), box("table", (2.5, 0.5, 0.0), (3.5, 1.5, 0.7), "table"))
SPACE = free_space(SCENE, 0.03, 1.1)
START = (1.0, 1.5)


def read_as_ros(description: Path) -> tuple[npt.NDArray[np.int64], float, list[float]]:
    """Free 0, occupied 100, unknown -1, row 0 at the lowest y: what map_server publishes as OccupancyGrid.

    By its arithmetic: p = (255 - value) / 255 unless negated, occupied above one threshold, free below the other.
    """
    about = yaml.safe_load(description.read_text())
    with Image.open(description.parent / about["image"]) as picture:
        assert (picture.format, picture.mode) == ("PNG", "L")
        values = np.asarray(picture, float)
    probability = values / 255 if about["negate"] else (255 - values) / 255
    grid = np.full(values.shape, -1)
    grid[probability > about["occupied_thresh"]] = 100
    grid[probability < about["free_thresh"]] = 0
    return grid[::-1], about["resolution"], about["origin"]


def test_a_reader_finds_the_room_where_it_is(tmp_path: Path) -> None:
    _, description = write_occupancy_map(tmp_path / "maps" / "room", SPACE, START)
    grid, resolution_m, origin = read_as_ros(description)

    def at(x: float, y: float) -> int:
        return int(grid[int((y - origin[1]) / resolution_m), int((x - origin[0]) / resolution_m)])

    assert at(1.0, 1.5) == 0
    assert at(3.9, 2.9) == 0
    assert at(2.52, 1.0) == 100, "the table's edge"
    assert at(0.02, 1.5) == 100, "a wall"
    assert at(-0.28, 1.5) == -1, "outside"
    assert origin[2] == 0.0


def test_the_first_row_is_the_one_with_the_largest_y() -> None:
    picture = occupancy(SPACE, START)
    columns, rows = SPACE.shape
    assert picture.shape == (rows, columns)
    column, row = SPACE.cell(3.0, 2.48)
    assert picture[rows - 1 - row, column] == 254
    assert picture[row, column] == 0, "mirrored, it is the table"


def test_a_room_that_is_closed_off_is_unknown() -> None:
    wall = box("wall", (1.9, 0.0, 0.0), (2.1, 3.0, 2.5))
    space = free_space(scene(*room(), wall), 0.03, 1.1)
    picture = occupancy(space, START)
    column, row = space.cell(3.0, 1.5)
    assert picture[picture.shape[0] - 1 - row, column] == 205


def test_nothing_is_left_beside_the_files(tmp_path: Path) -> None:
    write_occupancy_map(tmp_path / "room", SPACE, START)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["room.png", "room.yaml"]
