"""Label files of scans as data sets ship them, recognised by their form: see docs/import.md for the sources."""

import csv
import io
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import files, label_boxes, reading
from benchbot_scenes.importing.label_mesh import LabelMesh, counts_of, malformed, read_ply
from benchbot_scenes.importing.labels import Floats, Integers, LabelledObject, LabelledSurface, Labels, OrientedBox

NOTHING = frozenset(("", "unlabeled", "unlabelled", "undefined", "anomaly", "void", "remove", "split", "unknown"))
"""Labels of surfaces that are no object."""
HM3D_HEAD = "HM3D Semantic Annotations"
_SEGMENTED = {
    "ScanNet": (".aggregation.json", "segs.json"),
    "ScanNet++": ("segments_anno.json", "segments.json"),
    "Matterport3D": (".semseg.json", ".fsegs.json"),
    "3RScan": ("semseg", "segs"),
}


def find(path: Path) -> Path | None:
    """The file beside a scan's that says what is what in it; None if there is none."""
    stem = path.stem
    folder = path.parent
    for name in (f"{stem}.labels.json", f"{stem}.labels.csv", "labels.json", "labels.csv"):
        if (folder / name).is_file():
            return folder / name
    scan = stem.removesuffix(".basis")
    for name in (f"{scan}.semantic.txt", f"{stem}.house", f"{stem}.semseg.json", "segments_anno.json"):
        if (folder / name).is_file():
            return folder / name
    for name in ("info_semantic.json", "habitat/info_semantic.json"):
        if (folder / name).is_file() and (folder / name).with_name("mesh_semantic.ply").is_file():
            return folder / name
    for name in ("semseg.v2.json", "semseg.json"):
        if (folder / name).is_file():
            return folder / name
    groups = [found for found in folder.glob("*.aggregation.json") if stem.startswith(_scan(found))]
    return max(groups, key=lambda found: (len(_scan(found)), found.name), default=None)


def read(labels: Path, scan: Path) -> Labels:
    """Read labels of a scan, and the files beside them that they need; raise BenchbotError for what is none."""
    files.check(labels)
    name = labels.name
    readers: list[tuple[bool, Callable[[Path, Path], Labels]]] = [
        (name.endswith(".semantic.txt"), _hm3d),
        (name.endswith(".house"), _matterport),
        (name.endswith("info_semantic.json"), _replica),
        (_format_of(name) is not None, _segmented),
        (labels.suffix in (".json", ".csv"), label_boxes.read),
    ]
    for is_it, reader in readers:
        if is_it:
            found = reader(labels, scan)
            break
    else:
        raise BenchbotError(
            f"{name} is no file of labels that is known",
            "Known are those of ScanNet, ScanNet++, 3RScan, Replica, HM3D and Matterport3D, and labels.json or .csv.",
            "Name one of these, or write boxes into a labels.json: docs/import.md",
        )
    if not found.objects:
        raise BenchbotError(f"{name} names no object", "Its list is empty.", "Import without it: --labels none.")
    return found


def beside(labels: Path) -> Iterator[Path]:
    """The files that labels may need, and they themselves; for a digest of all that counts."""
    yield labels
    for other in sorted(labels.parent.iterdir()):
        if other != labels and other.is_file() and other.suffix in (".json", ".ply", ".txt", ".glb"):
            yield other


def _scan(aggregation: Path) -> str:
    """The name of the scan that a file of ScanNet's is of: scene0000_00 for scene0000_00_vh_clean.aggregation.json."""
    return aggregation.name.removesuffix(".aggregation.json")


def _format_of(name: str) -> str | None:
    for title, (end, _) in _SEGMENTED.items():
        if name.endswith(end) or (title == "3RScan" and name in ("semseg.json", "semseg.v2.json")):
            return title
    return None


def _segmented(labels: Path, scan: Path) -> Labels:
    """ScanNet, ScanNet++, 3RScan and regions of Matterport3D: segments of a mesh, and groups of them with a label."""
    title = _format_of(labels.name) or ""
    groups = _list(_json(labels), "segGroups", labels)
    mesh, segment = _segments(title, labels, scan)
    objects: list[LabelledObject] = []
    owner: dict[int, int] = {}
    for place, group in enumerate(groups):
        label = _label(group, "label", labels, place)
        if label in NOTHING:
            continue
        objects.append(LabelledObject(f"{label} {group.get('objectId', place)}", label, _obb(group, labels)))
        for number in _list(group, "segments", labels):
            owner[int(number) if isinstance(number, int) else -1] = len(objects)
    numbers, place_of = np.unique(segment, return_inverse=True)
    of_segment = np.array([owner.get(int(number), 0) for number in numbers], np.int64)[place_of.reshape(-1)]
    if len(of_segment) == len(mesh.vertices) and title != "Matterport3D":
        of_triangle = _majority(of_segment[mesh.triangles])
    else:
        of_triangle = of_segment[mesh.face]
    return Labels(title, labels, _unique(objects), LabelledSurface(mesh.vertices, mesh.triangles, of_triangle))


def _segments(title: str, labels: Path, scan: Path) -> tuple[LabelMesh, Integers]:
    """The mesh that is labelled, and the segment of each of its vertices (Matterport3D: faces)."""
    folder = labels.parent
    if title == "ScanNet":
        scan_name = labels.name.removesuffix(".aggregation.json").removesuffix("_vh_clean")
        exact = labels.name.endswith("_vh_clean.aggregation.json")
        segs = sorted(folder.glob(f"{scan_name}_vh_clean{'' if exact else '_2'}*.segs.json")) or sorted(
            folder.glob(f"{scan_name}*segs.json")
        )
    elif title == "3RScan":
        version = ".v2" if labels.name.endswith(".v2.json") else ""
        segs = sorted(folder.glob(f"mesh*.segs{version}.json"))
        annotated = folder / f"labels.instances.annotated{version}.ply"
        if not segs and annotated.is_file():
            return _by_object_id(annotated, labels)
    else:
        segs = [labels.with_name(labels.name.removesuffix(_SEGMENTED[title][0]) + _SEGMENTED[title][1])]
    if not segs or not segs[0].is_file():
        raise BenchbotError(
            f"{labels.name} needs a file of segments that is not there",
            f"In {title} its name ends in {_SEGMENTED[title][1]}.",
            f"Copy it to {folder}, or import without labels: --labels none.",
        )
    segment = _integers(_list(_json(segs[0]), "segIndices", segs[0]), segs[0])
    candidates = (
        [scan, *sorted(folder.glob("*.ply"))] if scan.suffix.lower() == ".ply" else sorted(folder.glob("*.ply"))
    )
    for candidate in dict.fromkeys(candidates):
        vertices, faces = counts_of(candidate)
        if len(segment) == (faces if title == "Matterport3D" else vertices):
            return read_ply(candidate), segment
    raise BenchbotError(
        f"{segs[0].name} fits none of the meshes beside it",
        f"It has segments of {len(segment):,} {'faces' if title == 'Matterport3D' else 'vertices'}; "
        f"no PLY file in {folder} has as many.",
        "Copy the mesh there that was labelled (in ScanNet it ends in _vh_clean_2.ply).",
    )


def _by_object_id(annotated: Path, labels: Path) -> tuple[LabelMesh, Integers]:
    """3RScan's annotated mesh, whose vertices name their object, with each object's first segment for all of it."""
    mesh = read_ply(annotated)
    ids = mesh.vertex_property("objectId", "object_id")
    if ids is None:
        raise malformed(annotated, "Its vertices have no objectId.")
    first = {}
    for group in _list(_json(labels), "segGroups", labels):
        first[group.get("objectId")] = next(iter(_list(group, "segments", labels)), -1)
    values, place = np.unique(ids, return_inverse=True)
    return mesh, np.array([first.get(int(value), -1) for value in values], np.int64)[place.reshape(-1)]


def _replica(labels: Path, scan: Path) -> Labels:
    """Replica: faces of mesh_semantic.ply name the object, info_semantic.json has its class and box."""
    del scan
    document = _json(labels)
    classes = {entry.get("id"): entry.get("name") for entry in _list(document, "classes", labels, optional=True)}
    objects, number_of = list[LabelledObject](), dict[int, int]()
    for place, entry in enumerate(_list(document, "objects", labels)):
        label = str(entry.get("class_name") or classes.get(entry.get("class_id")) or "")
        if label in NOTHING:
            continue
        identity = entry.get("id", place)
        objects.append(LabelledObject(f"{label} {identity}", label, _replica_box(entry, labels)))
        number_of[int(identity)] = len(objects)
    mesh = read_ply(labels.with_name("mesh_semantic.ply"))
    ids = mesh.face_property("object_id", "objectId")
    if ids is None:
        raise malformed(labels.with_name("mesh_semantic.ply"), "Its faces have no object_id.")
    of_triangle = _looked_up(ids, number_of)[mesh.face]
    return Labels("Replica", labels, _unique(objects), LabelledSurface(mesh.vertices, mesh.triangles, of_triangle))


def _replica_box(entry: dict[str, Any], path: Path) -> OrientedBox | None:
    given = entry.get("oriented_bbox")
    if given is None:
        return None
    from scipy.spatial.transform import Rotation

    try:
        middle, sizes = (np.asarray(given["abb"][key], np.float64).reshape(3) for key in ("center", "sizes"))
        turn = Rotation.from_quat(np.asarray(given["orientation"]["rotation"], np.float64).reshape(4)).as_matrix()
        offset = np.asarray(given["orientation"]["translation"], np.float64).reshape(3)
    except (LookupError, TypeError, ValueError) as error:
        raise malformed(path, f"An oriented_bbox is none: {type(error).__name__}: {error}") from error
    return _box(turn @ middle + offset, turn, sizes / 2)


def _matterport(labels: Path, scan: Path) -> Labels:
    """Matterport3D: faces of NAME.ply name a segment, NAME.house has each segment's object, its category and box."""
    del scan
    categories, rows, objects_of = dict[int, str](), list[tuple[int, int, Floats]](), dict[int, int]()
    for line_number, line in enumerate(labels.read_text("utf-8", errors="replace").splitlines(), start=1):
        parts = line.split()
        try:
            if parts and parts[0] == "C":
                categories[int(parts[1])] = parts[3].replace("#", " ")
            elif parts and parts[0] == "O":
                rows.append((int(parts[1]), int(parts[3]), np.array(parts[4:16], np.float64)))
            elif parts and parts[0] == "E":
                objects_of[int(parts[3])] = int(parts[2])
        except (ValueError, IndexError) as error:
            raise malformed(labels, f"Line {line_number} is cut short or no number: {line[:60]!r}") from error
    objects, number_of = list[LabelledObject](), dict[int, int]()
    for index, category, numbers in rows:
        label = categories.get(category, "")
        if label in NOTHING:
            continue
        first, second, radii = numbers[3:6], numbers[6:9], numbers[9:12]
        turn = np.stack([first, second, np.cross(first, second)], axis=1)
        objects.append(LabelledObject(f"{label} {index}", label, _box(numbers[:3], turn, radii)))
        number_of[index] = len(objects)
    mesh = read_ply(labels.with_suffix(".ply"))
    segment = mesh.face_property("material_id", "face_material")
    if segment is None:
        raise malformed(labels.with_suffix(".ply"), "Its faces have no material_id (face_material).")
    number_of_segment = {found: number_of.get(index, 0) for found, index in objects_of.items()}
    of_triangle = _looked_up(segment, number_of_segment)[mesh.face]
    return Labels("Matterport3D", labels, _unique(objects), LabelledSurface(mesh.vertices, mesh.triangles, of_triangle))


def _hm3d(labels: Path, scan: Path) -> Labels:
    """HM3D: colours in the textures of NAME.semantic.glb, and in NAME.semantic.txt the object that has each colour."""
    del scan
    lines = labels.read_text("utf-8", errors="replace").splitlines()
    if not lines or lines[0].strip() != HM3D_HEAD:
        raise malformed(labels, f"Its first line is not '{HM3D_HEAD}'.")
    objects, number_of = list[LabelledObject](), dict[int, int]()
    for place, row in enumerate(csv.reader(io.StringIO("\n".join(lines[1:]))), start=2):
        if not row:
            continue
        try:
            identity, color, label = int(row[0]), int(row[1], 16), row[2].strip().lower()
        except (ValueError, IndexError) as error:
            raise malformed(
                labels, f"Line {place} is not 'number,colour,\"name\",room': {','.join(row)[:60]!r}"
            ) from error
        if label not in NOTHING:
            objects.append(LabelledObject(f"{label} {identity}", label))
            number_of[color] = len(objects)
    geometry = reading.read(labels.with_suffix(".glb")).geometry
    colors = np.full(len(geometry.triangles), -1, np.int64)
    # Of three places in each triangle, since its corners lie on the border to the next object.
    weights = np.full((3, 3), 0.2) + 0.4 * np.eye(3)
    for number, material in enumerate(geometry.materials):
        chosen = np.flatnonzero(geometry.triangle_material == number)
        if material.base_color_image is None or not len(chosen):
            continue
        image = geometry.images[material.base_color_image][..., :3].astype(np.int64)
        places = (weights @ geometry.uvs[geometry.triangles[chosen]].astype(np.float64)) % 1.0
        column = np.minimum((places[..., 0] * image.shape[1]).astype(int), image.shape[1] - 1)
        row_number = np.minimum((places[..., 1] * image.shape[0]).astype(int), image.shape[0] - 1)
        texel = image[row_number, column]
        colors[chosen] = _majority((texel[..., 0] << 16) | (texel[..., 1] << 8) | texel[..., 2])
    of_triangle = _looked_up(colors, number_of)
    if not of_triangle.any():
        raise malformed(labels.with_suffix(".glb"), f"None of the colours in its textures is in {labels.name}.")
    surface = LabelledSurface(
        geometry.vertices.astype(np.float64), geometry.triangles.astype(np.int64), of_triangle, any_up=True
    )
    return Labels("HM3D", labels, _unique(objects), surface)


def _majority(values: Integers) -> Integers:
    """Of rows of three (N, 3) the value that two agree on, else the first."""
    return np.where(values[:, 1] == values[:, 2], values[:, 1], values[:, 0])


def _looked_up(ids: Integers, number_of: dict[int, int]) -> Integers:
    values, place = np.unique(ids, return_inverse=True)
    return np.array([number_of.get(int(value), 0) for value in values], np.int64)[place.reshape(-1)]


def _obb(group: dict[str, Any], path: Path) -> OrientedBox | None:
    """The oriented box of ScanNet++ and 3RScan: `normalizedAxes` has its three axes, one after the other."""
    given = group.get("obb")
    if given is None:
        return None
    try:
        middle, lengths = (np.asarray(given[key], np.float64).reshape(3) for key in ("centroid", "axesLengths"))
        axes = np.asarray(given["normalizedAxes"], np.float64).reshape(3, 3)
    except (LookupError, TypeError, ValueError) as error:
        raise malformed(path, f"An obb is none: {type(error).__name__}: {error}") from error
    return _box(middle, axes.T, lengths / 2)


def _box(middle: Floats, axes: Floats, half: Floats) -> OrientedBox | None:
    """The box of a middle, axes (columns) and half lengths; None where a number is none."""
    points = np.concatenate([middle[None], middle + (axes * half).T])
    return OrientedBox(points) if np.isfinite(points).all() else None


def _unique(objects: list[LabelledObject]) -> tuple[LabelledObject, ...]:
    """The objects, their names told apart."""
    taken: dict[str, int] = {}
    result = []
    for found in objects:
        taken[found.name] = taken.get(found.name, 0) + 1
        count = taken[found.name]
        result.append(found if count == 1 else replace(found, name=f"{found.name} ({count})"))
    return tuple(result)


def _json(path: Path) -> dict[str, Any]:
    files.check(path)
    try:
        document = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise malformed(path, f"It is no JSON: {error}") from error
    if not isinstance(document, dict):
        raise malformed(path, "It holds no object with keys.")
    return document


def _list(document: dict[str, Any], key: str, path: Path, *, optional: bool = False) -> list[Any]:
    found = document.get(key, [] if optional else None)
    if not isinstance(found, list):
        raise malformed(path, f"It has no list '{key}'.")
    if key != "segments" and key != "segIndices" and not all(isinstance(entry, dict) for entry in found):
        raise malformed(path, f"An entry of '{key}' has no keys.")
    return found


def _label(group: dict[str, Any], key: str, path: Path, place: int) -> str:
    found = group.get(key)
    if not isinstance(found, str):
        raise malformed(path, f"Group {place} has no '{key}'.")
    return found.strip()


def _integers(values: list[Any], path: Path) -> Integers:
    try:
        found: npt.NDArray[Any] = np.asarray(values)
    except ValueError as error:
        raise malformed(path, f"segIndices are no numbers: {error}") from error
    if found.ndim != 1 or found.dtype.kind not in "iu":
        raise malformed(path, "segIndices are no list of whole numbers.")
    return found.astype(np.int64)
