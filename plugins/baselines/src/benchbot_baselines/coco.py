"""COCO's form of what was collected: instances with boxes and run-length encoded masks (https://cocodataset.org)."""

import json
from collections.abc import Iterator
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


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """Return COCO's uncompressed counts of a mask (H, W): runs down the columns, beginning with one of zeros."""
    flat = np.concatenate([[False], mask.ravel(order="F"), [False]])
    edges = np.flatnonzero(flat[1:-1] != flat[:-2])
    counts: list[int] = np.diff(edges, prepend=0, append=mask.size).tolist()
    return counts


def annotations(shots: Shots, row: int) -> Iterator[dict[str, Any]]:
    """Yield the annotations of one picture: objects of a class, of `FEWEST_PIXELS` at least."""
    numbers, counts = np.unique(shots.instance[row], return_counts=True)
    height, width = shots.instance[row].shape
    for number, area in zip(numbers.tolist(), counts.tolist(), strict=True):
        category = int(shots.classes[number])
        if number == 0 or area < FEWEST_PIXELS or category == BACKGROUND:
            continue
        mask = shots.instance[row] == number
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        left, top = int(columns[0]), int(rows[0])
        yield {
            "category_id": category + 1,
            "instance": number,
            "area": area,
            "bbox": [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1],
            "iscrowd": 0,
            "segmentation": {"size": [height, width], "counts": run_lengths(mask)},
        }


def picture_name(seed: int, row: int) -> str:
    """Return the name of a picture's file."""
    return f"{seed:06d}_{row:04d}.png"


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
        Image.fromarray(shots.rgb[row]).save(folder / "images" / name, compress_level=1)
        Image.fromarray(shots.depth_mm[row]).save(folder / "depth" / name, compress_level=1)
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
