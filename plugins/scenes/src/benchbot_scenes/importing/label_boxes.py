"""Labels as a plain list of boxes: labels.json by the schema beside this file, or labels.csv."""

import csv
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchbot.plugin import BenchbotError, check_declaration, read_declaration
from benchbot_scenes.importing.labels import LabelledObject, Labels, OrientedBox

_SCHEMAS = Path(__file__).parent
COLUMNS = ("label", "x", "y", "z", "size_x", "size_y", "size_z")
MAY = ("name", "yaw_deg", "qw", "qx", "qy", "qz", "group")


def read(path: Path, scan: Path) -> Labels:
    """Read boxes, in the unit and axes of the scan's file; raise BenchbotError that names what is wrong, and where."""
    del scan
    entries = _rows(path) if path.suffix == ".csv" else _entries(path)
    counts: dict[str, int] = {}
    objects, taken = [], set()
    for entry in entries:
        counts[entry["label"]] = counts.get(entry["label"], 0) + 1
        name = entry.get("name") or f"{entry['label']} {counts[entry['label']]}"
        if name in taken:
            raise BenchbotError(
                f"{path.name} has two objects '{name}'", "A name is that of one object.", "Rename one of them."
            )
        taken.add(name)
        objects.append(LabelledObject(name, entry["label"], _box(entry), entry.get("group")))
    return Labels("boxes", path, tuple(objects), None)


def _entries(path: Path) -> list[dict[str, Any]]:
    document = read_declaration(path)
    check_declaration(document, "labels", path, _SCHEMAS)
    found: list[dict[str, Any]] = document["objects"]
    return found


def _rows(path: Path) -> list[dict[str, Any]]:
    """The rows of a CSV file in the form of the entries of labels.json."""
    reader = csv.DictReader(io.StringIO(path.read_text("utf-8-sig", errors="replace")), skipinitialspace=True)
    missing = [column for column in COLUMNS if column not in (reader.fieldnames or ())]
    unknown = [column for column in reader.fieldnames or () if column not in (*COLUMNS, *MAY)]
    if missing or unknown:
        raise BenchbotError(
            f"{path.name} has other columns than boxes need",
            f"It lacks {', '.join(missing)}." if missing else f"Unknown are {', '.join(map(str, unknown))}.",
            f"Its first line must be {','.join(COLUMNS)}; {', '.join(MAY)} may follow.",
        )
    entries = []
    for row in reader:
        try:
            entry = _entry(row)
        except (ValueError, KeyError, AttributeError, TypeError) as error:
            raise BenchbotError(
                f"{path.name}:{reader.line_num} is no box",
                f"{type(error).__name__}: {error}",
                f"Each line has {', '.join(COLUMNS)}: a word, and six numbers in the unit of the scan.",
            ) from error
        entries.append(entry)
    return entries


def _entry(row: dict[str, str]) -> dict[str, Any]:
    values = {key: float(row[key]) for key in (*COLUMNS[1:], *MAY[1:6]) if (row.get(key) or "").strip()}
    if not all(math.isfinite(value) for value in values.values()):
        raise ValueError("a number is not finite")
    entry: dict[str, Any] = {
        "label": row["label"].strip(),
        "name": (row.get("name") or "").strip(),
        "centroid": [values[axis] for axis in "xyz"],
        "extent": [values[f"size_{axis}"] for axis in "xyz"],
        "yaw_deg": values.get("yaw_deg", 0.0),
    }
    if "qw" in values:
        entry["orientation"] = [values[key] for key in ("qw", "qx", "qy", "qz")]
    if not entry["label"] or min(entry["extent"]) <= 0:
        raise ValueError("a label is empty, or a size is not above 0")
    if row.get("group"):
        entry["group"] = row["group"].strip().lower() in ("1", "true", "yes")
    return entry


def _box(entry: dict[str, Any]) -> OrientedBox:
    """The box, turned by `orientation` (qw, qx, qy, qz), or by `yaw_deg` about z."""
    turn = Rotation.from_euler("z", float(entry.get("yaw_deg", 0.0)), degrees=True)
    if "orientation" in entry and any(entry["orientation"]):
        w, x, y, z = entry["orientation"]
        turn = Rotation.from_quat([x, y, z, w])
    middle = np.asarray(entry["centroid"], np.float64)
    axes = turn.as_matrix() * (np.asarray(entry["extent"], np.float64) / 2)
    return OrientedBox(np.concatenate([middle[None], middle + axes.T]))
