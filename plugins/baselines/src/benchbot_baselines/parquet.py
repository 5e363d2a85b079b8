"""Parquet of what was collected, a file for each place, which `datasets.load_dataset` of Hugging Face reads."""

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow.parquet import write_table

from benchbot.mapping import CLASS_LIST
from benchbot_baselines.coco import annotations, picture_name, png
from benchbot_baselines.collecting import read_shots, whole
from benchbot_baselines.seeds import split_of

ROWS_PER_GROUP = 100
PICTURES = ("image", "depth_mm", "instance", "label")
_PICTURE = pa.struct({"bytes": pa.binary(), "path": pa.string()})
_NUMBERS = pa.list_(pa.int64())
_CLASS = {"_type": "ClassLabel", "names": list(CLASS_LIST[:-1])}
_INTEGER = {"_type": "Value", "dtype": "int64"}
_FEATURES = {
    **{name: {"_type": "Image"} for name in PICTURES},
    "objects": {
        "id": {"_type": "Sequence", "feature": _INTEGER},
        "category": {"_type": "Sequence", "feature": _CLASS},
        "area": {"_type": "Sequence", "feature": _INTEGER},
        "bbox": {"_type": "Sequence", "feature": {"_type": "Sequence", "feature": _INTEGER, "length": 4}},
    },
}
"""What types alone do not say: which columns are pictures, and the names of classes."""
SCHEMA = pa.schema(
    {
        **dict.fromkeys(PICTURES, _PICTURE),
        "objects": pa.struct(
            {"id": _NUMBERS, "category": _NUMBERS, "area": _NUMBERS, "bbox": pa.list_(pa.list_(pa.int64(), 4))}
        ),
        "camera_to_map": pa.list_(pa.list_(pa.float64())),
        "intrinsics": pa.struct(dict.fromkeys(("fx", "fy", "cx", "cy"), pa.float64())),
        "seed": pa.int64(),
        "light": pa.string(),
    },
    metadata={"huggingface": json.dumps({"info": {"features": _FEATURES}})},
)


def write_place(folder: Path, seed: int, places: Path) -> None:
    """Write a place's file, whose name begins with its split, unless it is there.

    A row is a picture: `image`; `depth_mm` and `instance`, 16 bit, and `label`, the number in `CLASS_LIST` of each
    pixel, as PNG; `objects` are those of `coco.annotations`, boxes [left, top, width, height] in pixels.
    """
    path = folder / f"{split_of(seed)}-{seed:06d}.parquet"
    if path.exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    shots = read_shots(places)
    rows: list[dict[str, Any]] = []
    for row in range(len(shots.rgb)):
        instance = shots.instance[row]
        pictures = zip(PICTURES, (shots.rgb[row], shots.depth_mm[row], instance, shots.classes[instance]), strict=True)
        found = list(annotations(shots, row))
        rows.append(
            {
                **{name: {"bytes": png(each), "path": picture_name(seed, row)} for name, each in pictures},
                "objects": {
                    "id": [each["instance"] for each in found],
                    "category": [each["category_id"] - 1 for each in found],
                    "area": [each["area"] for each in found],
                    "bbox": [each["bbox"] for each in found],
                },
                "camera_to_map": shots.camera_to_map[row].tolist(),
                "intrinsics": dict(zip(("fx", "fy", "cx", "cy"), shots.intrinsics[row].tolist(), strict=True)),
                "seed": seed,
                "light": str(shots.light),
            }
        )
    with whole(path) as file:
        write_table(pa.Table.from_pylist(rows, SCHEMA), file, row_group_size=ROWS_PER_GROUP)
