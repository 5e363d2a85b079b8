"""Pictures with what a detector finds in them, and sheets of what it misses."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

from benchmarks.boxes import Truth, match
from benchmarks.realism_tables import OVERLAPS, Row

GREEN, RED, BLUE = (40, 200, 60), (230, 40, 40), (60, 110, 255)
TILE_PIXELS, LABEL_PIXELS, TILES_IN_A_ROW = 240, 20, 6


def save_drawn(row: Row, picture: npt.NDArray[np.uint8], folder: Path) -> None:
    """Write a picture with what is found (green), missed (red) and wrong (blue)."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = Image.fromarray(picture)
    pen = ImageDraw.Draw(drawn)
    matches = match(row.truths, row.detections, OVERLAPS[0])
    boxes = [(row.detections[place], BLUE) for place in matches.wrong]
    boxes += [(row.detections[place], GREEN) for place in matches.found.values()]
    for each, colour in boxes:
        pen.rectangle(each.box, outline=colour, width=2)
        pen.text((each.box[0] + 4, each.box[1] + 4), f"{each.class_name} {each.score:.2f}", fill=colour, font_size=16)
    for truth in missed(row):
        pen.rectangle(truth.box, outline=RED, width=2)
        pen.text((truth.box[0] + 4, truth.box[3] - 20), truth.class_name, fill=RED, font_size=16)
    drawn.save(folder / f"{row.environment.replace(':', '_')}-{row.time}-{row.view}.jpg", quality=90)


def missed(row: Row) -> list[Truth]:
    """Objects of a picture that count and are not found."""
    matches = match(row.truths, row.detections, OVERLAPS[0])
    return [truth for place, truth in enumerate(row.truths) if truth.is_counted and place not in matches.found]


def add_misses(row: Row, picture: npt.NDArray[np.uint8], misses: dict[str, list[Image.Image]]) -> None:
    """Cut what is missed out of a picture, with a quarter of its box around it, by its class."""
    for truth in missed(row):
        left, top, right, bottom = truth.box
        margin = max(right - left, bottom - top) / 4
        around = (round(left - margin), round(top - margin), round(right + margin), round(bottom + margin))
        cut = Image.fromarray(picture).crop(around)
        cut.thumbnail((TILE_PIXELS, TILE_PIXELS))
        tile = Image.new("RGB", (TILE_PIXELS, TILE_PIXELS + LABEL_PIXELS))
        tile.paste(cut)
        label = f"{row.environment} {row.time} {row.view}, {truth.pixels} px"
        ImageDraw.Draw(tile).text((4, TILE_PIXELS + 2), label, fill="white", font_size=14)
        misses[truth.class_name].append(tile)


def save_misses(tiles: Sequence[Image.Image], path: Path) -> None:
    """Write tiles side by side, in rows."""
    across = min(len(tiles), TILES_IN_A_ROW)
    width, height = tiles[0].size
    sheet = Image.new("RGB", (across * width, -(-len(tiles) // across) * height))
    for number, tile in enumerate(tiles):
        sheet.paste(tile, (number % across * width, number // across * height))
    sheet.save(path, quality=88)
