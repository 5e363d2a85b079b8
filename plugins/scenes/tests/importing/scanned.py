"""A scanned room with its labels, written as each data set publishes them, from the descriptions of the formats."""

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from plugins.scenes.tests.importing.places import trimesh

Floats = npt.NDArray[np.float64]
GRID_M = 0.25


@dataclass(frozen=True)
class Scanned:
    """A box of the room: where its middle is, its full lengths, how far it is turned about z, its label and colour."""

    label: str
    middle: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw_deg: float = 0.0
    color: tuple[int, int, int] = (200, 200, 200)
    class_name: str | None = None

    @property
    def turn(self) -> Floats:
        angle = np.radians(self.yaw_deg)
        return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Low and high corner of the axis-aligned box around it."""
        reach = np.abs(self.turn) @ np.array(self.size) / 2
        return np.array(self.middle) - reach, np.array(self.middle) + reach


ROOM = (
    Scanned("floor", (2.5, 2.0, -0.05), (5.2, 4.2, 0.1), color=(150, 120, 90)),
    Scanned("wall", (-0.05, 2.0, 1.25), (0.1, 4.2, 2.5), color=(220, 215, 205)),
    Scanned("wall", (5.05, 2.0, 1.25), (0.1, 4.2, 2.5), color=(220, 215, 205)),
    Scanned("wall", (2.5, -0.05, 1.25), (5.0, 0.1, 2.5), color=(215, 215, 210)),
    Scanned("wall", (2.5, 4.05, 1.25), (5.0, 0.1, 2.5), color=(215, 215, 210)),
    Scanned("dining table", (3.9, 3.0, 0.37), (1.2, 0.7, 0.74), 30.0, (150, 95, 60), "table"),
    Scanned("office chair", (3.9, 1.0, 0.45), (0.5, 0.5, 0.9), 20.0, (60, 90, 160), "chair"),
    Scanned("couch", (0.5, 2.6, 0.4), (0.9, 1.9, 0.8), 0.0, (130, 60, 60), "couch"),
    Scanned("refrigerator", (0.4, 0.4, 0.85), (0.6, 0.6, 1.7), 0.0, (235, 235, 240), "refrigerator"),
    Scanned("cabinet", (2.0, 3.75, 0.2), (1.2, 0.45, 0.4), 0.0, (90, 80, 70)),
    Scanned("tv", (2.0, 3.75, 0.65), (0.7, 0.4, 0.5), 0.0, (20, 20, 25), "tv"),
    Scanned("zorbing ball", (2.9, 0.4, 0.25), (0.4, 0.4, 0.5), 0.0, (180, 160, 40)),
)
"""Open from above, as most scans are. The label of the last is in no vocabulary."""
TRUTH = {number: box for number, box in enumerate(ROOM) if box.class_name is not None}


def quads_of(box: Scanned) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Vertices and quads of a box's sides, each a grid, seen from outside counter-clockwise."""
    vertices, quads, count = [], [], 0
    half = np.array(box.size) / 2
    for axis in range(3):
        for side in (-1, 1):
            u, v = ((axis + 1) % 3, (axis + 2) % 3) if side > 0 else ((axis + 2) % 3, (axis + 1) % 3)
            columns, rows = (max(1, int(np.ceil(2 * half[along] / GRID_M))) for along in (u, v))
            points = np.zeros((columns + 1, rows + 1, 3))
            points[..., axis] = side * half[axis]
            points[..., u] = np.linspace(-half[u], half[u], columns + 1)[:, None]
            points[..., v] = np.linspace(-half[v], half[v], rows + 1)[None]
            place = count + np.arange((columns + 1) * (rows + 1)).reshape(columns + 1, rows + 1)
            corners = [place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]]
            vertices.append(points.reshape(-1, 3))
            quads.append(np.stack(corners, axis=-1).reshape(-1, 4))
            count += place.size
    return np.concatenate(vertices) @ box.turn.T + box.middle, np.concatenate(quads)


@dataclass(frozen=True)
class Mesh:
    """The room as one mesh: the object (its number in ROOM) of each vertex and of each quad."""

    vertices: Floats
    quads: npt.NDArray[np.int64]
    vertex_object: npt.NDArray[np.int64]
    quad_object: npt.NDArray[np.int64]

    @property
    def triangles(self) -> npt.NDArray[np.int64]:
        return self.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)

    @property
    def colors(self) -> npt.NDArray[np.uint8]:
        return np.array([box.color for box in ROOM], np.uint8)[self.vertex_object]


def room() -> Mesh:
    """The room's mesh."""
    pieces = [quads_of(box) for box in ROOM]
    counts = [len(vertices) for vertices, _ in pieces]
    first = np.cumsum([0, *counts[:-1]])
    return Mesh(
        np.concatenate([vertices for vertices, _ in pieces]),
        np.concatenate([quads + start for (_, quads), start in zip(pieces, first, strict=True)]),
        np.repeat(np.arange(len(ROOM)), counts),
        np.repeat(np.arange(len(ROOM)), [len(quads) for _, quads in pieces]),
    )


def write_ply(
    path: Path,
    mesh: Mesh,
    *,
    quads: bool = False,
    vertex: dict[str, npt.NDArray[np.int64]] | None = None,
    face: dict[str, npt.NDArray[np.int64]] | None = None,
) -> Path:
    """Write binary PLY, with more properties of vertices and faces."""
    polygons = mesh.quads if quads else mesh.triangles
    corners = polygons.shape[1]
    more, of_faces = vertex or {}, face or {}
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.vertices)}"]
    head += [f"property float {axis}" for axis in "xyz"] + [
        f"property uchar {name}" for name in ("red", "green", "blue")
    ]
    head += [f"property ushort {name}" for name in more] + [f"element face {len(polygons)}"]
    head += ["property list uchar int vertex_indices", *(f"property int {name}" for name in of_faces), "end_header", ""]
    points = np.zeros(len(mesh.vertices), [("p", "<f4", 3), ("c", "u1", 3), *((name, "<u2") for name in more)])
    points["p"], points["c"] = mesh.vertices, mesh.colors
    sides = np.zeros(len(polygons), [("n", "u1"), ("i", "<i4", corners), *((name, "<i4") for name in of_faces)])
    sides["n"], sides["i"] = corners, polygons
    for name, values in more.items():
        points[name] = values
    for name, values in of_faces.items():
        sides[name] = values
    path.write_bytes("\n".join(head).encode() + points.tobytes() + sides.tobytes())
    return path


def _segments(numbers: npt.NDArray[np.int64]) -> tuple[list[int], dict[int, list[int]]]:
    """Segment ids, two for each object, as an over-segmentation has them, and those of each object."""
    halves = np.arange(len(numbers)) % 2
    ids = 1000 + 7 * (2 * numbers + halves)
    return ids.tolist(), {number: [1000 + 14 * number, 1007 + 14 * number] for number in range(len(ROOM))}


def _groups(groups: dict[int, list[int]], *, has_boxes: bool) -> list[dict[str, Any]]:
    found = []
    for number, box in enumerate(ROOM):
        entry: dict[str, Any] = {"id": number, "objectId": number, "segments": groups[number], "label": box.label}
        if has_boxes:
            axes = box.turn.T.ravel().tolist()
            entry["obb"] = {"centroid": list(box.middle), "axesLengths": list(box.size), "normalizedAxes": axes}
        found.append(entry)
    return found


def scannet(folder: Path) -> Path:
    """ScanNet: groups of segments of vertices."""
    mesh = room()
    scan = write_ply(folder / "scene0000_00_vh_clean_2.ply", mesh)
    ids, groups = _segments(mesh.vertex_object)
    segments = {"params": {}, "sceneId": "scene0000_00", "segIndices": ids}
    (folder / "scene0000_00_vh_clean_2.0.010000.segs.json").write_text(json.dumps(segments))
    annotation = {"sceneId": "scannet.scene0000_00", "segGroups": _groups(groups, has_boxes=False)}
    (folder / "scene0000_00.aggregation.json").write_text(json.dumps(annotation))
    return scan


def scannetpp(folder: Path) -> Path:
    """ScanNet++: the same with oriented boxes, under other names."""
    mesh = room()
    scan = write_ply(folder / "mesh_aligned_0.05.ply", mesh)
    ids, groups = _segments(mesh.vertex_object)
    (folder / "segments.json").write_text(json.dumps({"sceneId": "a", "segIndices": ids}))
    (folder / "segments_anno.json").write_text(json.dumps({"segGroups": _groups(groups, has_boxes=True)}))
    return scan


def three_rscan(folder: Path) -> Path:
    """3RScan: a textured OBJ, z up, and a PLY of another mesh that is labelled."""
    mesh = room()
    plain: Any = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    plain.export(folder / "mesh.refined.v2.obj")
    write_ply(folder / "labels.instances.annotated.v2.ply", mesh, vertex={"objectId": mesh.vertex_object + 1})
    ids, groups = _segments(mesh.vertex_object)
    (folder / "mesh.refined.0.010000.segs.v2.json").write_text(json.dumps({"segIndices": ids}))
    (folder / "semseg.v2.json").write_text(json.dumps({"scan_id": "a", "segGroups": _groups(groups, has_boxes=True)}))
    return folder / "mesh.refined.v2.obj"


def replica(folder: Path) -> Path:
    """Replica: quads that name their object, and a box of each object in a frame of its own."""
    mesh = room()
    objects = []
    for number, box in enumerate(ROOM):
        half = np.radians(box.yaw_deg) / 2
        orientation = {
            "rotation": [0.0, 0.0, float(np.sin(half)), float(np.cos(half))],
            "translation": list(box.middle),
        }
        abb = {"center": [0.0, 0.0, 0.0], "sizes": list(box.size)}
        objects.append(
            {"id": number + 1, "class_id": number, "class_name": box.label.replace(" ", "-"),
             "oriented_bbox": {"abb": abb, "orientation": orientation}}
        )  # fmt: skip
    classes = [{"id": number, "name": box.label.replace(" ", "-")} for number, box in enumerate(ROOM)]
    (folder / "info_semantic.json").write_text(json.dumps({"classes": classes, "objects": objects}))
    return write_ply(folder / "mesh_semantic.ply", mesh, quads=True, face={"object_id": mesh.quad_object + 1})


def hm3d(folder: Path) -> Path:
    """HM3D: a scene in glTF and a second one of the same shape whose texture has a colour for each object."""
    mesh = room()
    y_up = mesh.vertices[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    plain = trimesh.Trimesh(y_up, mesh.triangles, vertex_colors=mesh.colors, process=False)
    plain.export(folder / "a7Xq.glb")
    colors = [(37 * number % 256, 91 * number % 256, 255 - number) for number in range(len(ROOM))]
    picture = np.zeros((4, 4 * len(ROOM), 3), np.uint8)
    for number, color in enumerate(colors):
        picture[:, 4 * number : 4 * number + 4] = color
    uv = np.stack([(mesh.vertex_object + 0.5) / len(ROOM), np.full(len(y_up), 0.5)], axis=1)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(picture))
    visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    trimesh.Trimesh(y_up, mesh.triangles, visual=visual, process=False).export(folder / "a7Xq.semantic.glb")
    lines = ["HM3D Semantic Annotations"]
    for number, (box, color) in enumerate(zip(ROOM, colors, strict=True)):
        lines.append(f'{number + 1},{"".join(f"{part:02X}" for part in color)},"{box.label}",0')
    (folder / "a7Xq.semantic.txt").write_text("\n".join(lines) + "\n")
    return folder / "a7Xq.glb"


def matterport(folder: Path) -> Path:
    """Matterport3D: faces that name their segment, and a .house of segments, objects, categories and regions."""
    mesh = room()
    face = np.repeat(mesh.quad_object, 2)
    segment = 500 + 3 * face
    lines = ["ASCII 1.0", "H 17DR 17DR 0 0 0 0 12 12 12 1 0 1  0 0 0 0 0  0 0 0 5 4 2.5  0 0 0 0 0"]
    lines += ["R 0 0 0 0 k  2 2 1  0 0 0 5 4 2.5  2.5 0 0 0"]
    for number, box in enumerate(ROOM):
        lines.append(f"C {number} {number} {box.label.replace(' ', '#')} 1 objects 0 0 0 0 0")
    for number, box in enumerate(ROOM):
        values = [*box.middle, *box.turn[:, 0], *box.turn[:, 1], *(np.array(box.size) / 2)]
        lines.append(f"O {number} 0 {number} {' '.join(f'{value:.6f}' for value in values)} 0 0 0 0 0 0 0 0")
    for number in range(len(ROOM)):
        lines.append(f"E {number} {number} {500 + 3 * number} 1.0 0 0 0  0 0 0 0 0 0  0 0 0 0 0")
    (folder / "17DR.house").write_text("\n".join(lines) + "\n")
    properties = {"material_id": segment, "segment_id": face, "category_id": face}
    return write_ply(folder / "17DR.ply", mesh, face=properties)


def region(folder: Path) -> Path:
    """A region of Matterport3D: groups of segments of faces."""
    mesh = room()
    ids, groups = _segments(np.repeat(mesh.quad_object, 2))
    (folder / "region0.fsegs.json").write_text(json.dumps({"segIndices": ids}))
    (folder / "region0.semseg.json").write_text(json.dumps({"segGroups": _groups(groups, has_boxes=False)}))
    return write_ply(folder / "region0.ply", mesh)


def boxes_json(folder: Path) -> Path:
    """A scan with a labels.json of oriented boxes."""
    entries = [
        {"label": box.label, "centroid": list(box.middle), "extent": list(box.size), "yaw_deg": box.yaw_deg}
        for box in ROOM
        if box.label not in ("floor", "wall")
    ]
    (folder / "labels.json").write_text(json.dumps({"objects": entries}))
    return write_ply(folder / "lab.ply", room())


def boxes_csv(folder: Path) -> Path:
    """A scan with boxes that are not turned, of a spreadsheet."""
    with (folder / "lab.labels.csv").open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(("label", "x", "y", "z", "size_x", "size_y", "size_z"))
        for box in TRUTH.values():
            low, high = box.bounds
            writer.writerow((box.label, *((low + high) / 2).tolist(), *(high - low).tolist()))
    return write_ply(folder / "lab.ply", room())


FORMATS: dict[str, Callable[[Path], Path]] = {
    "ScanNet": scannet,
    "ScanNet++": scannetpp,
    "3RScan": three_rscan,
    "Replica": replica,
    "HM3D": hm3d,
    "Matterport3D": matterport,
    "Matterport3D region": region,
    "labels.json": boxes_json,
    "labels.csv": boxes_csv,
}
