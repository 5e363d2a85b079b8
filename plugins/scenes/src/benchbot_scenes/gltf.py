"""Reads glTF 2.0 files (Khronos glTF 2.0 specification) into `SceneGeometry`."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes import gltf_materials, gltf_splats, vertex_colors
from benchbot_scenes.gltf_file import BROKEN, GltfFile, UnsupportedError, split_glb
from benchbot_scenes.scene import FloatArray, Instance, IntArray, Material, SceneGeometry, unit_vectors
from benchbot_scenes.splats import Splats, joined

Y_UP_TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])

_TRIANGLES, _TRIANGLE_STRIP, _TRIANGLE_FAN = 4, 5, 6


def load_scene(path: Path) -> SceneGeometry:
    """Read a GLB file (glTF 2.0 binary, y up) into the map frame (z up).

    Raises `BenchbotError` when the file is missing, damaged, empty or needs what is not supported.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise BenchbotError(
            f"There is no scene file {path}",
            "The environment's map_path names it, relative to the environment's YAML file.",
            "Correct map_path, or install the add-on that holds the file.",
        ) from error
    except OSError as error:
        raise BenchbotError(f"The scene file {path} cannot be read", str(error), "Make it a readable file.") from error
    try:
        return geometry_of(GltfFile(*split_glb(data)))[0]
    except UnsupportedError as error:
        raise BenchbotError(
            f"The scene file {path} cannot be used", str(error), "Export it again without that feature."
        ) from error
    except BROKEN as error:
        raise BenchbotError(
            f"The scene file {path} is not a valid GLB (glTF 2.0 binary)",
            f"{type(error).__name__}: {error}",
            "Export it again as binary glTF 2.0, or fetch the file again if it was cut short.",
        ) from error


def geometry_of(file: GltfFile) -> tuple[SceneGeometry, tuple[tuple[str, ...], ...]]:
    """The default scene in the map frame, and of each instance the names from its root node to its mesh.

    Raises UnsupportedError, and what `BROKEN` lists for damaged files.
    """
    return _Reader(file).scene()


def nodes(document: dict[str, Any]) -> Iterator[tuple[dict[str, Any], npt.NDArray[np.float64], tuple[str, ...]]]:
    """Nodes of the default scene with their world matrices and the names that lead to them, depth first."""
    entries = document.get("nodes", [])
    scenes = document.get("scenes")
    roots = scenes[document.get("scene", 0)].get("nodes", []) if scenes else range(len(entries))
    pending: list[tuple[int, npt.NDArray[np.float64], tuple[str, ...]]] = [
        (index, np.eye(4), ()) for index in reversed(list(roots))
    ]
    visited = 0
    while pending:
        index, parent, path = pending.pop()
        visited += 1
        if visited > len(entries):
            raise ValueError("its nodes do not form a tree")
        node = entries[index]
        matrix = parent @ _local_matrix(node)
        path = (*path, str(node["name"])) if node.get("name") else path
        yield node, matrix, path
        pending += [(child, matrix, path) for child in reversed(node.get("children", []))]


@dataclass
class _Soup:
    """Pieces of the scene while it is being put together; `colors` are those of corners, None where there are none."""

    vertices: list[FloatArray] = field(default_factory=list)
    normals: list[FloatArray] = field(default_factory=list)
    uvs: list[FloatArray] = field(default_factory=list)
    triangles: list[IntArray] = field(default_factory=list)
    instance: list[IntArray] = field(default_factory=list)
    material: list[IntArray] = field(default_factory=list)
    colors: list[FloatArray | None] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    paths: list[tuple[str, ...]] = field(default_factory=list)
    tagged: dict[str, int] = field(default_factory=dict)
    splats: list[Splats] = field(default_factory=list)
    vertex_count: int = 0


class _Reader:
    def __init__(self, file: GltfFile) -> None:
        self.file = file
        self.document = file.document
        self.materials = self.document.get("materials", [])

    def scene(self) -> tuple[SceneGeometry, tuple[tuple[str, ...], ...]]:
        soup = _Soup()
        for node, matrix, path in nodes(self.document):
            if "mesh" in node and not self._add_splats(soup, node, matrix):
                self._add_object(soup, node, matrix, path)
        if not soup.triangles:
            raise UnsupportedError("It holds no triangles.")
        materials = (gltf_materials.material(self.document, entry) for entry in self.materials)
        geometry = SceneGeometry(
            vertices=np.concatenate(soup.vertices),
            triangles=np.concatenate(soup.triangles),
            triangle_instance=np.concatenate(soup.instance),
            triangle_material=np.concatenate(soup.material),
            normals=np.concatenate(soup.normals),
            uvs=np.concatenate(soup.uvs),
            materials=(*materials, Material(name="default")),
            instances=tuple(soup.instances),
            images=tuple(self.file.image(entry) for entry in self.document.get("images", [])),
            splats=joined(soup.splats),
        )
        return _painted(geometry, soup), tuple(soup.paths)

    def _add_splats(self, soup: _Soup, node: dict[str, Any], matrix: npt.NDArray[np.float64]) -> bool:
        """Add the splats of a node; return whether it has nothing else, and so is no object."""
        to_map = np.eye(4)
        to_map[:3, :3] = Y_UP_TO_Z_UP
        is_of_splats = [gltf_splats.is_splats(primitive) for primitive in self._primitives(node)]
        for primitive, is_one in zip(self._primitives(node), is_of_splats, strict=True):
            if is_one:
                soup.splats.append(gltf_splats.read(self.file, primitive, to_map @ matrix))
        return bool(is_of_splats) and all(is_of_splats)

    def _primitives(self, node: dict[str, Any]) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.document["meshes"][node["mesh"]]["primitives"]
        return found

    def _add_object(
        self, soup: _Soup, node: dict[str, Any], matrix: npt.NDArray[np.float64], path: tuple[str, ...]
    ) -> None:
        mesh = self.document["meshes"][node["mesh"]]
        index = _instance(soup, node, mesh, path)
        linear = Y_UP_TO_Z_UP @ matrix[:3, :3]
        offset = Y_UP_TO_Z_UP @ matrix[:3, 3]
        mirrored = np.linalg.det(linear) < 0
        for primitive in mesh["primitives"]:
            if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _TRIANGLE_STRIP, _TRIANGLE_FAN):
                continue
            attributes = primitive["attributes"]
            position = self.file.accessor(attributes["POSITION"]).astype(np.float64)
            vertices = (position @ linear.T + offset).astype(np.float32)
            triangles = self._triangles(primitive, len(vertices))
            if mirrored:
                triangles = triangles[:, ::-1]
            uvs, is_textured = self._uvs(primitive, len(vertices))
            colors = None if is_textured else self._colors(attributes, triangles)
            if "NORMAL" in attributes:
                normals = _transform_normals(self.file.accessor(attributes["NORMAL"]).astype(np.float64), linear)
            else:  # glTF asks for flat shading then: one vertex per corner
                vertices, uvs = vertices[triangles.ravel()], uvs[triangles.ravel()]
                normals = flat_normals(vertices)
                triangles = np.arange(len(vertices)).reshape(-1, 3)
            material = primitive.get("material", len(self.materials))
            soup.vertices.append(vertices)
            soup.normals.append(normals)
            soup.uvs.append(uvs)
            soup.triangles.append((triangles + soup.vertex_count).astype(np.int32))
            soup.instance.append(np.full(len(triangles), index, np.int32))
            soup.material.append(np.full(len(triangles), material, np.int32))
            soup.colors.append(colors)
            soup.vertex_count += len(vertices)

    def _triangles(self, primitive: dict[str, Any], vertices: int) -> npt.NDArray[np.int64]:
        if "indices" in primitive:
            corners = self.file.accessor(primitive["indices"]).astype(np.int64).ravel()
        else:
            corners = np.arange(vertices, dtype=np.int64)
        mode = primitive.get("mode", _TRIANGLES)
        if mode == _TRIANGLES:
            indices = corners[: len(corners) - len(corners) % 3].reshape(-1, 3)
        else:
            later = np.stack([corners[1:-1], corners[2:]], axis=1)
            if mode == _TRIANGLE_STRIP:
                indices = np.column_stack([corners[:-2], later])
                indices[1::2, 1:] = indices[1::2, :0:-1]
            else:
                indices = np.column_stack([np.full(len(later), corners[0]), later])
        if len(indices) and (indices.min() < 0 or indices.max() >= vertices):
            raise ValueError("a triangle names a vertex that is not there")
        return indices

    def _uvs(self, primitive: dict[str, Any], vertices: int) -> tuple[FloatArray, bool]:
        """Texture coordinates, and whether a picture is looked up with them."""
        entry = self.materials[primitive["material"]] if "material" in primitive else {}
        attribute, matrix = gltf_materials.texture_coordinates(entry)
        if attribute not in primitive["attributes"]:
            return np.zeros((vertices, 2), np.float32), False
        uvs = self.file.accessor(primitive["attributes"][attribute]).astype(np.float32)
        if matrix is not None:
            uvs = (uvs @ matrix[:, :2].T + matrix[:, 2]).astype(np.float32)
        return uvs, gltf_materials.material(self.document, entry).base_color_image is not None

    def _colors(self, attributes: dict[str, Any], triangles: npt.NDArray[np.int64]) -> FloatArray | None:
        """Linear colours (T, 3, 3) of corners, where the file gives any but white."""
        if "COLOR_0" not in attributes:
            return None
        colors = self.file.accessor(attributes["COLOR_0"])[:, :3].astype(np.float32)
        return None if (colors == 1.0).all() else colors[triangles]


def _painted(geometry: SceneGeometry, soup: _Soup) -> SceneGeometry:
    if all(colors is None for colors in soup.colors):
        return geometry
    is_colored = np.concatenate(
        [np.full(len(part), colors is not None) for part, colors in zip(soup.triangles, soup.colors, strict=True)]
    )
    colors = [
        np.ones((len(part), 3, 3), np.float32) if colors is None else colors
        for part, colors in zip(soup.triangles, soup.colors, strict=True)
    ]
    return vertex_colors.bake(geometry, np.concatenate(colors), is_colored)


def _instance(soup: _Soup, node: dict[str, Any], mesh: dict[str, Any], path: tuple[str, ...]) -> int:
    """The index of the object that a node belongs to; nodes whose extras name the same instance are one object."""
    extras = (node.get("extras") or {}).get("benchbot") or {}
    index = len(soup.instances) + 1
    if extras.get("instance"):
        known = soup.tagged.setdefault(str(extras["instance"]), index)
        if known != index:
            return known
    name = str(extras.get("instance") or node.get("name") or mesh.get("name") or f"object {index}")
    class_name = extras.get("class")
    soup.instances.append(
        Instance(index, name, None if class_name is None else str(class_name), bool(extras.get("group", False)))
    )
    soup.paths.append((*path, str(mesh["name"])) if mesh.get("name") else path)
    return index


def _local_matrix(node: dict[str, Any]) -> npt.NDArray[np.float64]:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.asarray(node.get("scale", (1.0, 1.0, 1.0)), np.float64)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _transform_normals(normals: npt.NDArray[np.float64], linear: npt.NDArray[np.float64]) -> FloatArray:
    """Normals turn with the inverse transpose; the cofactor matrix is that up to scale, and exists for any matrix."""
    cofactor = np.stack(
        [
            np.cross(linear[1], linear[2]),
            np.cross(linear[2], linear[0]),
            np.cross(linear[0], linear[1]),
        ]
    )
    turned = normals @ (cofactor * (np.sign(np.linalg.det(linear)) or 1.0)).T
    return unit_vectors(turned)


def flat_normals(corners: FloatArray) -> FloatArray:
    """One normal per corner, that of its triangle; `corners` (3 T, 3)."""
    shape = corners.reshape(-1, 3, 3).astype(np.float64)
    normal = np.cross(shape[:, 1] - shape[:, 0], shape[:, 2] - shape[:, 0])
    return np.repeat(unit_vectors(normal), 3, axis=0)
