"""The golden room: coloured boxes of which everything is known, as a plain GLB file that any simulator loads.

Nothing in it is symmetric: what is mirrored, turned or shifted looks different.
"""

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.core import atomic
from benchbot.core.geometry import Pose
from benchbot.core.platform import Scene
from benchbot.plugins.authoring.comparability.world import Box, World

RED, GREEN, BLUE = (0.7, 0.04, 0.04), (0.04, 0.5, 0.04), (0.04, 0.06, 0.7)
YELLOW, CYAN, MAGENTA = (0.7, 0.6, 0.03), (0.03, 0.55, 0.6), (0.65, 0.03, 0.6)
GREY, LIGHT, DARK = (0.5, 0.5, 0.5), (0.8, 0.8, 0.8), (0.1, 0.1, 0.1)
LAMP_RADIANCE = 14.0

_LAMP = Box("lamp", None, (0.1, -0.1, 2.46), (0.9, 0.6, 2.48))
ROOM = World(
    (
        Box("floor", None, (-3.2, -2.7, -0.2), (4.2, 3.2, 0.0), GREY),
        Box("ceiling", None, (-3.2, -2.7, 2.5), (4.2, 3.2, 2.7), GREY),
        Box("wall east", None, (4.0, -2.7, 0.0), (4.2, 3.2, 2.5), GREY),
        Box("wall north", None, (-3.0, 3.0, 0.0), (4.0, 3.2, 2.5), GREY),
        Box("wall west", None, (-3.2, -2.7, 0.0), (-3.0, 3.2, 2.5), GREY),
        Box("wall south", None, (-3.0, -2.7, 0.0), (4.0, -2.5, 2.5), GREY),
        _LAMP,
        Box("light panel", None, (3.97, -0.2, 0.1), (4.0, 0.4, 2.4), LIGHT),
        Box("dark panel", None, (3.97, 0.4, 0.1), (4.0, 1.0, 2.4), DARK),
        Box("couch", "couch", (1.9, -2.1, 0.0), (2.7, -0.5, 0.9), RED),
        Box("table", "table", (2.2, 1.2, 0.0), (3.2, 2.4, 0.75), GREEN),
        Box("bottle", "bottle", (2.3, 1.4, 0.75), (2.6, 1.6, 1.3), MAGENTA),
        Box("chair 1", "chair", (0.6, 2.2, 0.0), (1.1, 2.7, 0.95), BLUE),
        Box("chair 2", "chair", (-2.7, -1.2, 0.0), (-2.1, -0.6, 1.1), CYAN),
        Box("refrigerator", "refrigerator", (-2.8, 1.5, 0.0), (-2.1, 2.3, 1.8), YELLOW),
        Box("bed", "bed", (-1.4, -2.4, 0.0), (0.3, -1.7, 0.55), BLUE),
    ),
    is_complete=True,
)
OBJECT_LABELS = ["bottle", "chair", "table", "couch", "bed", "refrigerator"]
PALETTE = (RED, GREEN, BLUE, YELLOW, CYAN, MAGENTA)
PANELS = ("light panel", "dark panel")
"""Two greys side by side on a wall, one of eight times the other's reflectance."""
STARTS = (Pose.planar(0.0, 0.0, 0.0), Pose.planar(0.2, 0.5, 2.2))
"""Where the robot looks around, each a metre away from everything."""
WALL_START = Pose.planar(1.0, 0.35, 0.0)
"""Three metres before a wall, with nothing in between."""


def scene(folder: Path, start: Pose, declared: Mapping[str, Any]) -> Scene:
    """Return the room with the robot at a start, an environment like the `declared` one; writes its file if need be."""
    path = folder / "golden_room.glb"
    data = glb()
    if not path.is_file() or path.read_bytes() != data:
        atomic.write(path, data)
    environment = {
        "name": "golden_room",
        "variant": 1,
        "type": declared["type"],
        "map_path": path.name,
        "description": "Boxes of known places, classes and colours.",
        "start_pose": [start.rotation_xyzw[3], *start.rotation_xyzw[:3], *start.translation_xyz],
        "object_labels": OBJECT_LABELS,
        "options": dict(declared.get("options", {})),
    }
    return Scene(environment, folder)


def glb() -> bytes:
    """Return the room as a binary glTF 2.0 file (y up), its objects named as docs/scenes.md has it."""
    lists: dict[str, list[Any]] = {name: [] for name in ("nodes", "meshes", "materials", "accessors", "bufferViews")}
    binary = bytearray()

    def accessor(values: Any, kind: str, component: int, target: int, **limits: Any) -> int:
        lists["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes, "target": target}
        )
        binary.extend(values.tobytes())
        view = len(lists["bufferViews"]) - 1
        count = values.size // (3 if kind == "VEC3" else 1)
        lists["accessors"].append(
            {"bufferView": view, "componentType": component, "count": count, "type": kind, **limits}
        )
        return len(lists["accessors"]) - 1

    for number, box in enumerate(ROOM.boxes):
        points, normals, triangles = _faces(box)
        ends = {"min": points.min(0).tolist(), "max": points.max(0).tolist()}
        attributes = {
            "POSITION": accessor(points, "VEC3", 5126, 34962, **ends),
            "NORMAL": accessor(normals, "VEC3", 5126, 34962),
        }
        part = {"attributes": attributes, "indices": accessor(triangles, "SCALAR", 5123, 34963), "material": number}
        lists["meshes"].append({"primitives": [part]})
        tag = {"class": box.class_name, "instance": box.name, "group": False}
        lists["nodes"].append({"name": box.name, "mesh": number, "extras": {"benchbot": tag}})
        lists["materials"].append(_material(box))
    document = {
        "asset": {"version": "2.0", "generator": "benchbot"},
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{"nodes": list(range(len(ROOM.boxes)))}],
        "buffers": [{"byteLength": len(binary)}],
        **lists,
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _material(box: Box) -> dict[str, Any]:
    color = box.color or LIGHT
    surface = {"baseColorFactor": [*color, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}
    material: dict[str, Any] = {"name": box.name, "pbrMetallicRoughness": surface}
    if box is _LAMP:
        strength = {"KHR_materials_emissive_strength": {"emissiveStrength": LAMP_RADIANCE}}
        material |= {"emissiveFactor": [1.0, 1.0, 1.0], "extensions": strength}
    return material


def _faces(box: Box) -> tuple[Any, Any, Any]:
    """Return points and normals (24, 3), float32 and y up, and triangles (12, 3) of a box, four points to a face."""
    low, high = np.array(box.low), np.array(box.high)
    points: list[Any] = []
    normals, triangles = [], []
    for axis in range(3):
        for side in (0, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            first = len(points)
            for at_u, at_v in ((0, 0), (1, 0), (1, 1), (0, 1)):
                point = np.where(np.eye(3, dtype=bool)[axis], (low, high)[side], low)
                point[u], point[v] = (low, high)[at_u][u], (low, high)[at_v][v]
                points.append(point)
            normals += [np.eye(3)[axis] * (1 if side else -1)] * 4
            corners = (0, 1, 2, 0, 2, 3) if side else (0, 2, 1, 0, 3, 2)
            triangles.append([first + corner for corner in corners])
    y_up = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    turned = [np.ascontiguousarray(np.array(values) @ y_up.T, np.float32) for values in (points, normals)]
    return turned[0], turned[1], np.array(triangles, np.uint16)
