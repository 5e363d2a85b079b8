"""PLY files of Gaussian splats, as the trainers of 3DGS write them (Kerbl et al. 2023, and most others since)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import files
from benchbot_scenes.importing.sanity import FAR
from benchbot_scenes.splats import Splats, colors_of_harmonics

MOST_SPLATS = 5_000_000
LARGEST = 1e6
"""Standard deviations beyond this, in the file's unit, are mistakes, as coordinates beyond `FAR` are."""
MOST_UNUSABLE_SHARE = 0.01
INVISIBLE = 1.0 / 255.0
"""Opacities below this are never drawn."""
_HEAD_BYTES = 2**16
_TYPES = {
    **dict.fromkeys(("float", "float32"), "<f4"),
    **dict.fromkeys(("double", "float64"), "<f8"),
    **dict.fromkeys(("char", "int8"), "<i1"),
    **dict.fromkeys(("uchar", "uint8"), "<u1"),
    **dict.fromkeys(("short", "int16"), "<i2"),
    **dict.fromkeys(("ushort", "uint16"), "<u2"),
    **dict.fromkeys(("int", "int32"), "<i4"),
    **dict.fromkeys(("uint", "uint32"), "<u4"),
}
_PLACE, _CONSTANT = ("x", "y", "z"), ("f_dc_0", "f_dc_1", "f_dc_2")
_SCALE, _ROTATION = ("scale_0", "scale_1", "scale_2"), ("rot_1", "rot_2", "rot_3", "rot_0")
NEEDED = (*_PLACE, *_CONSTANT, "opacity", *_SCALE, *_ROTATION)
_REST_OF_DEGREE = {0: 0, 9: 1, 24: 2, 45: 3}
_AS_TRAINED = "Name the point_cloud.ply that a trainer of 3DGS wrote (binary, little-endian, not compressed)."


@dataclass(frozen=True)
class _Head:
    """The head of a PLY file: where its vertices begin, how many there are, and their numbers."""

    begin: int
    count: int
    types: npt.DTypeLike
    names: tuple[str, ...]


def read(path: Path) -> tuple[Splats, tuple[str, ...]]:
    """The splats of a file in its own frame and unit, and notes on what is left out of them.

    Raises BenchbotError when it is missing, damaged, no file of splats, or too large.
    """
    files.check(path)
    head = _head(path)
    _check(path, head)
    rows = np.memmap(path, head.types, "r", head.begin, head.count)
    rest = tuple(name for name in head.names if name.startswith("f_rest_"))
    if len(rest) not in _REST_OF_DEGREE:
        raise _broken(path, f"It has {len(rest)} properties f_rest_…; 0, 9, 24 or 45 make spherical harmonics.")
    degree = _REST_OF_DEGREE[len(rest)]
    with np.errstate(all="ignore"):
        opacities = 1.0 / (1.0 + np.exp(-_columns(rows, ("opacity",))[:, 0]))
        places, scales = _columns(rows, _PLACE), np.exp(_columns(rows, _SCALE))
        rotations, constant = _columns(rows, _ROTATION), _columns(rows, _CONSTANT)
        length = np.linalg.norm(rotations, axis=1, keepdims=True)
        linear = np.zeros((head.count, 3, 3), np.float32)
        if degree:  # all of red, then all of green, then all of blue: the first three of each are of degree 1
            each = len(rest) // 3
            by_channel = [[f"f_rest_{channel * each + order}" for order in range(3)] for channel in range(3)]
            linear = np.stack([_columns(rows, tuple(names)) for names in by_channel], axis=2)
        is_usable = np.isfinite(np.concatenate([constant, linear.reshape(-1, 9), length], axis=1)).all(axis=1)
        is_usable &= (np.abs(places) < FAR).all(axis=1) & (scales < LARGEST).all(axis=1)
        is_usable &= (length[:, 0] > 0) & np.isfinite(opacities)
    _check_share(path, int((~is_usable).sum()), head.count)
    kept = is_usable & (opacities >= INVISIBLE)
    if not kept.any():
        raise _broken(path, "None of its splats can be seen: their opacities are all below 1/255.")
    colors, slopes = colors_of_harmonics(constant[kept], linear[kept])
    turned = (rotations[kept] / length[kept]).astype(np.float32)
    splats = Splats(places[kept], turned, scales[kept], opacities[kept].astype(np.float32), colors, slopes)
    return splats, _notes(kept, is_usable, degree)


def _columns(rows: npt.NDArray[np.void], names: tuple[str, ...]) -> npt.NDArray[np.float32]:
    return np.stack([np.asarray(rows[name], np.float32) for name in names], axis=1)


def _notes(kept: npt.NDArray[np.bool_], is_usable: npt.NDArray[np.bool_], degree: int) -> tuple[str, ...]:
    notes = [f"{int(kept.sum()):,} splats give its colours; light, lamps and materials do not change these."]
    if not is_usable.all():
        notes.append(f"{int((~is_usable).sum()):,} splats with numbers that are none, or far too large, are left out.")
    if (is_usable & ~kept).any():
        notes.append(f"{int((is_usable & ~kept).sum()):,} splats that cannot be seen are left out.")
    if degree > 1:
        notes.append(f"Of its spherical harmonics of degree {degree}, those up to degree 1 are kept.")
    return tuple(notes)


def _head(path: Path) -> _Head:
    with path.open("rb") as stream:
        start = stream.read(_HEAD_BYTES)
    text, end, _ = start.partition(b"end_header\n")
    if not start.startswith(b"ply") or not end:
        raise _broken(path, "It does not begin with the head of a PLY file.")
    lines = [line.split() for line in text.decode("ascii", "replace").splitlines()]
    format_ = next((line[1:2] for line in lines if line[:1] == ["format"]), [])
    if format_ != ["binary_little_endian"]:
        raise _broken(path, f"It is of the format {' '.join(format_) or 'that is not said'}.")
    elements = [index for index, line in enumerate(lines) if line[:1] == ["element"]]
    if not elements or lines[elements[0]][1:2] != ["vertex"] or not "".join(lines[elements[0]][2:3]).isdigit():
        raise _broken(path, "Its first element is no list of vertices: compressed splats are not read.")
    last = elements[1] if len(elements) > 1 else len(lines)
    properties = [line[1:] for line in lines[elements[0] + 1 : last] if line[:1] == ["property"]]
    if any(len(entry) != 2 or entry[0] not in _TYPES for entry in properties):
        raise _broken(path, "Its vertices have properties that are no single numbers.")
    names = tuple(name for _, name in properties)
    if len(set(names)) != len(names):
        raise _broken(path, "Two properties of its vertices have the same name.")
    types = np.dtype([(name, _TYPES[type_]) for type_, name in properties])
    return _Head(len(text) + len(end), int(lines[elements[0]][2]), types, names)


def _check(path: Path, head: _Head) -> None:
    missing = [name for name in NEEDED if name not in head.names]
    if missing:
        kind = "a mesh or a point cloud" if {*_CONSTANT, "opacity"} <= set(missing) else "incomplete"
        raise BenchbotError(
            f"{path.name} is no file of Gaussian splats",
            f"Its vertices lack {', '.join(missing)}: it is {kind}.",
            _AS_TRAINED,
        )
    if head.count == 0:
        raise _broken(path, "It holds no splats.")
    if head.count > MOST_SPLATS:
        raise BenchbotError(
            f"{path.name} has too many splats",
            f"It has {head.count:,}; up to {MOST_SPLATS:,} are read.",
            "Prune it, for example in SuperSplat: cut away what is outside the room.",
        )
    size = np.dtype(head.types).itemsize
    have = (path.stat().st_size - head.begin) // max(size, 1)
    if have < head.count:
        raise _broken(path, f"It should have {head.count:,} splats but ends after {have:,}.")


def _check_share(path: Path, unusable: int, count: int) -> None:
    if unusable > MOST_UNUSABLE_SHARE * count:
        raise BenchbotError(
            f"{path.name} holds numbers that are none",
            f"{unusable:,} of its {count:,} splats have NaN, infinity, or sizes beyond {LARGEST:g}.",
            "Train it again: its training has diverged, or something else has written the file.",
        )


def _broken(path: Path, why: str) -> BenchbotError:
    return BenchbotError(f"{path.name} is no sound file of Gaussian splats", why, _AS_TRAINED)
