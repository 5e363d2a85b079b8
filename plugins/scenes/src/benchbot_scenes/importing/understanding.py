"""A file understood: brought to metres, z up, its floor at z = 0, its objects named and sorted into classes."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.ground_truth import object_boxes
from benchbot_scenes.importing import (
    files,
    guesses,
    guessing,
    label_files,
    labels,
    names,
    objects,
    reading,
    splat_file,
)
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.labels import Labelled, OrientedBox
from benchbot_scenes.importing.model import UpAxis, turned, with_splats
from benchbot_scenes.importing.objects import Recognised
from benchbot_scenes.scene import SceneGeometry, only
from benchbot_scenes.splats import transformed

LARGEST_M, SMALLEST_M = 2000.0, 0.5
# Objects of one class are one, exported twice, when their boxes differ by no more.
TWIN_M, TWIN_SHARE = 0.01, 0.02
Box = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]
_MOSTLY_Y_UP = (".obj",)
_WITH_FILES_BESIDE = (".gltf", ".obj", ".usd", ".usda", ".usdc")
_BESIDE = {
    ".mtl",
    ".bin",
    ".png",
    ".jpg",
    ".jpeg",
    ".bmp",
    ".tga",
    ".tif",
    ".tiff",
    ".webp",
    ".usd",
    ".usda",
    ".usdc",
    ".usdz",
}
# Odd multipliers, of which the first is 2^64 over the golden ratio (Knuth, The Art of Computer Programming, 6.4).
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


@dataclass(frozen=True)
class Understood:
    """A scene in the map frame with what it was taken for, and why (`reasons`, by the keys of a guesses file)."""

    geometry: SceneGeometry
    unit: str | float
    up: UpAxis
    floor_z_m: float
    recognised: Recognised
    reasons: dict[str, str]
    notes: tuple[str, ...]
    labelled: Labelled | None = None

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Along x, y and z."""
        x, y, z = np.ptp(self.geometry.vertices, axis=0)
        return float(x), float(y), float(z)


def convert(path: Path) -> bytes:
    """Any importable file as a GLB file in metres, its floor at z = 0; what lies beside it as guesses counts.

    Raises BenchbotError when it cannot be read.
    """
    return to_glb(understand(path, guesses.beside(path)).geometry)


def digest(path: Path) -> str:
    """SHA-256, in hex, that changes when the file does, or its guesses, or what it may refer to.

    That are labels, textures, materials and the like beside it and in the folders there.
    """
    files.check(path)
    total = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(2**22):
            total.update(block)
    labels = label_files.find(path)
    for other in () if labels is None else label_files.beside(labels):
        state = other.stat()
        total.update(f"{other.name}\0{state.st_size}\0{state.st_mtime_ns}\0".encode())
    corrected = path.with_suffix(guesses.SUFFIX)
    if corrected.is_file():
        total.update(corrected.read_bytes())
    if path.suffix.lower() in _WITH_FILES_BESIDE:
        found = (other for pattern in ("*", "*/*") for other in path.parent.glob(pattern))
        for beside in sorted(other for other in found if other.suffix.lower() in _BESIDE and other.is_file()):
            state = beside.stat()
            total.update(f"{beside.relative_to(path.parent)}\0{state.st_size}\0{state.st_mtime_ns}\0".encode())
    return total.hexdigest()


def understand(
    path: Path, known: Guesses, labelled_by: Path | Literal["none"] | None = None, splats: Path | None = None
) -> Understood:
    """Read a file and guess the values that are not `known`; raise BenchbotError if it is not a scene.

    `labelled_by` names a file of labels; without it the one beside the scene's file counts, if there is one. `splats`
    names a file of splats in the frame of the scene's file.
    """
    model = reading.read(path)
    if splats is not None:
        cloud, notes = splat_file.read(splats)
        model = replace(with_splats(model, cloud), notes=(*model.notes, *notes))
    suffix = path.suffix.lower()
    reasons = {}
    up, unit, said = known.up, known.units, known.classes
    if labelled_by is None:
        labelled_by = label_files.find(path)
    found = label_files.read(labelled_by, path) if isinstance(labelled_by, Path) else None
    labelled: Labelled | None = None
    prior: UpAxis = "y" if suffix in _MOSTLY_Y_UP and (found is None or found.surface is None) else "z"
    if found is not None and found.surface is not None:
        # Floors and ceilings that are labelled tell more of the axis than the format does.
        model, labelled, said = labels.apply(model, found, up or prior, said)
        model = replace(model, up=None if any(map(_lies, labelled.classes)) else model.up)
    if up is None:
        up, reasons["up"] = guessing.up_axis(model, prior)
    if found is not None and found.surface is None:
        model, labelled, said = labels.apply(model, found, up, said)
    recognised = objects.recognise(model.paths, model.geometry.instances, said, known.hidden)
    if labelled is not None:
        recognised = _grouped(recognised, labelled)
    seen = objects.sorted_into(model.geometry, recognised)
    paths = tuple((found.name,) for found in recognised.objects)
    unit_m = known.unit_m
    if unit_m is None and model.unit_m is not None:
        unit_m, reasons["units"] = model.unit_m, "the file says so"
        unit = next((name for name, size in guessing.UNITS_M.items() if np.isclose(size, unit_m)), unit_m)
    elif unit_m is None:
        upright = _upright(seen, 1.0, up)
        unit, reasons["units"] = guessing.unit(upright, paths, is_gltf=suffix in (".glb", ".gltf"))
        unit_m = guessing.UNITS_M[unit]
    geometry = _upright(seen, unit_m, up)
    _check_size(geometry, path)
    floor_z_m = known.floor_z_m
    if floor_z_m is None:
        floor_z_m, reasons["floor_z_m"] = guessing.floor_z_m(geometry)
    geometry = _shifted(geometry, (0.0, 0.0, -floor_z_m))
    geometry, recognised, notes = _without_twins(geometry, recognised, model.notes)
    if labelled is not None:
        turn = np.eye(3) if up == "z" else Y_UP_TO_Z_UP
        boxes = {
            name: OrientedBox(box.points * unit_m @ turn.T - [0.0, 0.0, floor_z_m])
            for name, box in labelled.boxes.items()
        }
        labelled = replace(labelled, boxes=boxes)
    return Understood(with_sides(geometry), unit or unit_m, up, floor_z_m, recognised, reasons, notes, labelled)


def _without_twins(
    geometry: SceneGeometry, recognised: Recognised, notes: tuple[str, ...]
) -> tuple[SceneGeometry, Recognised, tuple[str, ...]]:
    """Leave out objects that are where another one of their class is: each thing is in the truth once."""
    boxes = object_boxes(geometry)
    kept: dict[str, list[str]] = {}
    twins: dict[str, str] = {}
    for found in recognised.objects:
        if found.class_name is None or found.name not in boxes:
            continue
        others = kept.setdefault(found.class_name, [])
        twin = next((other for other in others if _is_twin(boxes[found.name], boxes[other])), None)
        if twin is None:
            others.append(found.name)
        else:
            twins[found.name] = twin
    if not twins:
        return geometry, recognised, notes
    told = "; ".join(f"{name} is where {other} is" for name, other in list(twins.items())[:5])
    more = f" and {len(twins) - 5} more" if len(twins) > 5 else ""
    is_twin = np.array([False, *(found.name in twins for found in geometry.instances)])
    left = only(geometry, ~is_twin[geometry.triangle_instance])
    instances = tuple(replace(one, class_name=None) if one.name in twins else one for one in left.instances)
    return (
        replace(left, instances=instances),
        replace(recognised, objects=tuple(found for found in recognised.objects if found.name not in twins)),
        (*notes, f"Twins are left out: {told}{more}."),
    )


def _is_twin(box: Box, other: Box) -> bool:
    size = np.maximum(box[1] - box[0], other[1] - other[0])
    return bool((np.abs(np.array(box) - np.array(other)) <= np.maximum(TWIN_M, TWIN_SHARE * size)).all())


def _lies(label: str) -> bool:
    found = names.meaning(label)
    return found is not None and found.noun in ("floor", "ceiling")


def _grouped(recognised: Recognised, labelled: Labelled) -> Recognised:
    found = (replace(one, is_group=labelled.groups.get(one.name, one.is_group)) for one in recognised.objects)
    return replace(recognised, objects=tuple(found))


def with_sides(geometry: SceneGeometry) -> SceneGeometry:
    """Mark materials as one-sided where they are on closed bodies only, as both-sided elsewhere.

    What a file says of it is not believed: which side of a scanned or drawn wall is its front is often left to chance.
    """
    closed = is_closed(geometry)
    open_materials = set(np.unique(geometry.triangle_material[~closed]).tolist())
    materials = tuple(
        replace(material, double_sided=number in open_materials) for number, material in enumerate(geometry.materials)
    )
    return replace(geometry, materials=materials)


def is_closed(geometry: SceneGeometry) -> npt.NDArray[np.bool_]:
    """Say of each triangle (T,) whether its instance is closed and faces outwards.

    Closed: every edge is between two triangles that run along it in opposite directions. Outwards: the volume that it
    encloses is positive.
    """
    place = _places(geometry)
    corners = place[geometry.triangles]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    count = len(geometry.vertices)
    low, high = edges.min(axis=1), edges.max(axis=1)
    owner = np.repeat(geometry.triangle_instance.astype(np.int64), 3)
    # The balance of each edge of each instance, one way counting up and the other down, is 0 in a closed body.
    _, edge = np.unique((owner * count + low) * count + high, return_inverse=True)
    balance = np.bincount(edge, np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    is_open = np.zeros(int(geometry.triangle_instance.max()) + 1, bool)
    is_open[owner[balance[edge] != 0]] = True
    points = geometry.vertices[geometry.triangles].astype(np.float64)
    volume = np.bincount(geometry.triangle_instance, (points[:, 0] * np.cross(points[:, 1], points[:, 2])).sum(axis=1))
    closed: npt.NDArray[np.bool_] = (~is_open & (volume > 0))[geometry.triangle_instance]
    return closed


def _upright(geometry: SceneGeometry, unit_m: float, up: UpAxis) -> SceneGeometry:
    """The scene in metres with z up; y up turns as glTF's axes do: (x, y, z) becomes (x, -z, y)."""
    vertices = (geometry.vertices.astype(np.float64) * unit_m).astype(np.float32)
    scaled = replace(geometry, vertices=vertices, splats=geometry.splats and transformed(geometry.splats, scale=unit_m))
    return scaled if up == "z" else turned(scaled, Y_UP_TO_Z_UP)


def _shifted(geometry: SceneGeometry, by_m: tuple[float, float, float]) -> SceneGeometry:
    """The scene moved by a vector."""
    if by_m == (0.0, 0.0, 0.0):
        return geometry
    vertices = (geometry.vertices.astype(np.float64) + by_m).astype(np.float32)
    return replace(geometry, vertices=vertices, splats=geometry.splats and transformed(geometry.splats, offset=by_m))


def _check_size(geometry: SceneGeometry, path: Path) -> None:
    size = np.ptp(geometry.vertices, axis=0)
    if size[:2].max() > LARGEST_M or size[:2].max() < SMALLEST_M:
        what = "large" if size[:2].max() > LARGEST_M else "small"
        raise BenchbotError(
            f"{path.name} is too {what} for a place that a robot moves in",
            f"It is {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} m.",
            "Say which unit it has (--units), or take away what lies far off.",
        )


def _places(geometry: SceneGeometry) -> npt.NDArray[np.int64]:
    """A number for each vertex, equal for vertices at the same place."""
    x, y, z = (geometry.vertices + np.float32(0.0)).view(np.uint32).astype(np.uint64).T  # -0.0 becomes 0.0
    hashed = (x * _MIX[0]) ^ (y * _MIX[1] + _MIX[2]) ^ (z * _MIX[2] + (x ^ y) * _MIX[0])
    _, place = np.unique(hashed, return_inverse=True)
    return place
