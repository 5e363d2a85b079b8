"""COCO's form of what was collected: instances with boxes and run-length encoded masks (https://cocodataset.org)."""

import json
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchbot.mapping import CLASS_LIST
from benchbot.plugin import write_atomically
from benchbot_baselines.collecting import BACKGROUND, Shots, read_shots, whole

FEWEST_PIXELS = 25
PICTURES_PER_PLACE = 10_000


@dataclass(frozen=True)
class Runs:
    """The runs of equal numbers down the columns of a picture, of `height` and so many `pixels`, one after the other.

    `first` and `end` (R,) are their first pixels, and those after their last ones; `number` (R,) what they are of.
    """

    first: NDArray[np.int64]
    end: NDArray[np.int64]
    number: NDArray[np.int64]
    height: int
    pixels: int

    def of(self, number: int) -> "Runs":
        """Return the runs of one number."""
        own = self.number == number
        return replace(self, first=self.first[own], end=self.end[own], number=self.number[own])

    def counts(self) -> list[int]:
        """Return COCO's uncompressed counts of the mask of these runs, which do not touch; they begin with zeros."""
        edges = np.stack([self.first, self.end], 1).ravel()
        counts: list[int] = np.diff(edges, prepend=0, append=self.pixels).tolist()
        return counts if counts[-1] else counts[:-1]

    def box(self) -> list[int]:
        """Return left, top, width and height in pixels."""
        left, right = int(self.first.min()) // self.height, (int(self.end.max()) - 1) // self.height
        top, bottom = self.first % self.height, (self.end - 1) % self.height
        if (self.first // self.height != (self.end - 1) // self.height).any():
            # One that goes on in the next column was at the bottom, and is at the top.
            return [left, 0, right - left + 1, self.height]
        return [left, int(top.min()), right - left + 1, int(bottom.max()) - int(top.min()) + 1]


def runs(numbers: NDArray[np.integer[Any]]) -> Runs:
    """Return all runs of a picture (H, W) of numbers."""
    flat = numbers.ravel(order="F")
    first = np.concatenate([[0], np.flatnonzero(flat[1:] != flat[:-1]) + 1])
    return Runs(first, np.append(first[1:], flat.size), flat[first].astype(np.int64), len(numbers), flat.size)


def annotations(shots: Shots, row: int) -> Iterator[dict[str, Any]]:
    """Yield the annotations of one picture: objects of a class, of `FEWEST_PIXELS` at least."""
    found = runs(shots.instance[row])
    areas = np.bincount(found.number, found.end - found.first).astype(np.int64)
    height, width = shots.instance[row].shape
    large: list[int] = (np.flatnonzero(areas[1:] >= FEWEST_PIXELS) + 1).tolist()
    for number in large:
        category = int(shots.classes[number])
        if category == BACKGROUND:
            continue
        own = found.of(number)
        yield {
            "category_id": category + 1,
            "instance": number,
            "area": int(areas[number]),
            "bbox": own.box(),
            "iscrowd": 0,
            "segmentation": {"size": [height, width], "counts": own.counts()},
        }


def picture_name(seed: int, row: int) -> str:
    """Return the name of a picture's file."""
    return f"{seed:06d}_{row:04d}.png"


def png(pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """Return the file of a picture, packed by its runs alone: no larger, and quicker than by searching for more."""
    encoded = BytesIO()
    Image.fromarray(pixels).save(encoded, "png", compress_level=1, compress_type=zlib.Z_RLE)
    return encoded.getvalue()


def write_place(folder: Path, seed: int, places: Path) -> None:
    """Write pictures, depth (16 bit, millimetres) and annotations of a place, unless they are there."""
    part = folder / "parts" / f"{seed:06d}.json"
    if part.exists():
        return
    for name in ("images", "depth", "parts"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    shots = read_shots(places)
    images, found = [], []
    for row in range(len(shots.rgb)):
        name, image_id = picture_name(seed, row), seed * PICTURES_PER_PLACE + row
        (folder / "images" / name).write_bytes(png(shots.rgb[row]))
        (folder / "depth" / name).write_bytes(png(shots.depth_mm[row]))
        height, width = shots.depth_mm[row].shape
        images.append(
            {
                "id": image_id,
                "file_name": name,
                "width": width,
                "height": height,
                "seed": seed,
                "light": str(shots.light),
                "camera_to_map": shots.camera_to_map[row].tolist(),
                "intrinsics": dict(zip(("fx", "fy", "cx", "cy"), shots.intrinsics[row].tolist(), strict=True)),
            }
        )
        found += [{"image_id": image_id, **each} for each in annotations(shots, row)]
    with whole(part) as file:
        file.write(json.dumps({"images": images, "annotations": found}).encode())


def finish(folder: Path) -> Path:
    """Join the annotations of all places in `instances.json`, numbered in the order of their pictures."""
    parts = [json.loads(path.read_text(encoding="utf-8")) for path in sorted((folder / "parts").glob("*.json"))]
    found = [each for part in parts for each in part["annotations"]]
    document = {
        "images": [each for part in parts for each in part["images"]],
        "annotations": [{"id": number, **each} for number, each in enumerate(found, 1)],
        "categories": [{"id": number, "name": name} for number, name in enumerate(CLASS_LIST[:-1], 1)],
    }
    path = folder / "instances.json"
    write_atomically(path, json.dumps(document).encode())
    return path
