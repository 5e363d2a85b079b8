"""Strips of before and now on one sheet."""

from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.then_and_now import SHEET_BYTES, SHOW, SMALL_PX, write_sheet

BLACK, GREY, WHITE, RED = (0, 0, 0), (128, 128, 128), (255, 255, 255), (200, 0, 0)


def strip(path: Path, *colors: tuple[int, int, int]) -> Path:
    views = [np.full((SHOW.height, SHOW.width, 3), color, np.uint8) for color in colors]
    Image.fromarray(np.hstack(views)).save(path)
    return path


def test_each_view_is_beside_that_of_before(tmp_path: Path) -> None:
    before, now = strip(tmp_path / "before.png", BLACK, GREY), strip(tmp_path / "now.png", WHITE, RED)
    write_sheet(before, now, tmp_path / "sheet.jpg")
    sheet = np.asarray(Image.open(tmp_path / "sheet.jpg"))
    assert (tmp_path / "sheet.jpg").stat().st_size <= SHEET_BYTES
    assert sheet.shape == (SMALL_PX[1], 4 * SMALL_PX[0], 3)
    middles = sheet[SMALL_PX[1] // 2, SMALL_PX[0] // 2 :: SMALL_PX[0]].astype(int)
    assert np.abs(middles - np.array([BLACK, WHITE, GREY, RED])).max() <= 3
