"""Writes small GLB files for the tests; shapes are given in the map frame (z up)."""

import io
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

Z_UP_TO_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


@dataclass
class Glb:
    """A document under construction."""

    materials: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    nodes: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    views: list[dict[str, Any]] = field(default_factory=list)
    images: list[dict[str, Any]] = field(default_factory=list)
    binary: bytearray = field(default_factory=bytearray)

    def material(
        self,
        color: tuple[float, float, float] = (0.8, 0.8, 0.8),
        *,
        roughness: float = 1.0,
        metallic: float = 0.0,
        emission: tuple[float, float, float] = (0.0, 0.0, 0.0),
        glass: bool = False,
        image: np.ndarray | None = None,
        glow_image: np.ndarray | None = None,
        ior: float | None = None,
        solid: bool = False,
    ) -> int:
        strength = max(1.0, *emission)
        entry: dict[str, Any] = {
            "pbrMetallicRoughness": {
                "baseColorFactor": [*color, 1.0],
                "metallicFactor": metallic,
                "roughnessFactor": roughness,
            },
            "emissiveFactor": [channel / strength for channel in emission],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}},
        }
        if glass:
            entry["extensions"]["KHR_materials_transmission"] = {"transmissionFactor": 1.0}
        if ior is not None:
            entry["extensions"]["KHR_materials_ior"] = {"ior": ior}
        if solid:
            entry["extensions"]["KHR_materials_volume"] = {"thicknessFactor": 0.1}
        if image is not None:
            entry["pbrMetallicRoughness"]["baseColorTexture"] = {"index": self._image(image)}
        if glow_image is not None:
            entry["emissiveTexture"] = {"index": self._image(glow_image)}
        self.materials.append(entry)
        return len(self.materials) - 1

    def add(
        self,
        name: str,
        vertices: np.ndarray,
        triangles: np.ndarray,
        material: int,
        *,
        class_name: str | None = None,
        normals: np.ndarray | None = None,
        uvs: np.ndarray | None = None,
        extras: bool = True,
    ) -> None:
        attributes = {"POSITION": self._floats(np.asarray(vertices) @ Z_UP_TO_Y_UP.T, "VEC3")}
        if normals is not None:
            attributes["NORMAL"] = self._floats(np.asarray(normals) @ Z_UP_TO_Y_UP.T, "VEC3")
        if uvs is not None:
            attributes["TEXCOORD_0"] = self._floats(uvs, "VEC2")
        self.accessors.append(
            {
                "bufferView": self._view(np.asarray(triangles, "<u4").tobytes()),
                "componentType": 5125,
                "count": int(np.size(triangles)),
                "type": "SCALAR",
            }
        )
        primitive = {"attributes": attributes, "indices": len(self.accessors) - 1, "material": material}
        self.meshes.append({"primitives": [primitive]})
        node: dict[str, Any] = {"mesh": len(self.meshes) - 1, "name": name}
        if extras:
            node["extras"] = {"benchbot": {"class": class_name, "instance": name, "group": False}}
        self.nodes.append(node)

    def box(self, name: str, low: Any, high: Any, material: int, *, inward: bool = False, **options: Any) -> None:
        vertices, triangles, uvs = box(low, high)
        self.add(name, vertices, triangles[:, ::-1] if inward else triangles, material, uvs=uvs, **options)

    def sphere(self, name: str, center: Any, radius: float, material: int, detail: int = 32, **options: Any) -> None:
        vertices, triangles, normals = sphere(detail)
        self.add(name, vertices * radius + np.asarray(center), triangles, material, normals=normals, **options)

    def write(self, path: Path) -> Path:
        document = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self.nodes)))}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.binary)}],
            "images": self.images,
            "textures": [{"source": index} for index in range(len(self.images))],
        }
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path

    def _image(self, image: np.ndarray) -> int:
        encoded = io.BytesIO()
        Image.fromarray(image).save(encoded, "PNG")
        self.images.append({"bufferView": self._view(encoded.getvalue()), "mimeType": "image/png"})
        return len(self.images) - 1

    def _view(self, data: bytes) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.views) - 1

    def _floats(self, values: np.ndarray, kind: str) -> int:
        data = np.asarray(values, "<f4")
        view = self._view(data.tobytes())
        self.accessors.append({"bufferView": view, "componentType": 5126, "count": len(data), "type": kind})
        return len(self.accessors) - 1


def box(low: Any, high: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (24, 3), triangles (12, 3) facing out, uvs in metres."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    vertices: list[np.ndarray] = []
    triangles: list[list[int]] = []
    uvs: list[tuple[float, float]] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            corners = np.zeros((4, 3))
            corners[:, axis] = (low, high)[side][axis]
            corners[:, u] = np.array([low[u], high[u], high[u], low[u]])
            corners[:, v] = np.array([low[v], low[v], high[v], high[v]])
            order = [[0, 1, 2], [0, 2, 3]] if side else [[0, 2, 1], [0, 3, 2]]
            triangles += [[index + len(vertices) for index in triple] for triple in order]
            vertices += list(corners)
            uvs += [(corner[u], corner[v]) for corner in corners]
    return np.array(vertices), np.array(triangles), np.array(uvs)


def sphere(detail: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit sphere: vertices, triangles facing out, normals."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, detail + 1), np.linspace(0, 2 * np.pi, 2 * detail + 1))
    points = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    index = np.arange(points[..., 0].size).reshape(polar.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, d, c], axis=1), np.stack([a, c, b], axis=1)])
    flat = points.reshape(-1, 3)
    corner = flat[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return flat, triangles[area > 1e-9], flat
