"""Reads glTF 2.0 binary files (Khronos glTF 2.0 specification) into `SceneGeometry`."""

import base64
import binascii
import io
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from benchbot.core.errors import BenchbotError
from benchbot_sim_taichi.scene import FloatArray, ImageArray, Instance, IntArray, Material, SceneGeometry

Y_UP_TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])

_COMPONENT_TYPES: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_TRIANGLES = 4
_SUPPORTED_EXTENSIONS = {
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
}


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
        return _Reader(*_split(data)).scene()
    except _UnsupportedError as error:
        raise BenchbotError(
            f"The scene file {path} cannot be used", str(error), "Export it again without that feature."
        ) from error
    except _BROKEN as error:
        raise BenchbotError(
            f"The scene file {path} is not a valid GLB (glTF 2.0 binary)",
            f"{type(error).__name__}: {error}",
            "Export it again as binary glTF 2.0, or fetch the file again if it was cut short.",
        ) from error


class _UnsupportedError(Exception):
    """The file is sound but asks for something this reader does not do."""


_BROKEN = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    struct.error,
    RecursionError,
    OSError,
    UnidentifiedImageError,
    Image.DecompressionBombError,
)


def _split(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON document and the binary chunk of a GLB container."""
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != b"glTF" or version != 2:
        raise ValueError("the file does not start like binary glTF 2.0")
    if length > len(data):
        raise ValueError(f"the file should have {length} bytes but ends after {len(data)}")
    document, binary = None, b""
    position = 12
    while position + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, position)
        chunk = data[position + 8 : position + 8 + size]
        if kind == b"JSON":
            document = json.loads(chunk)
        elif kind == b"BIN\0":
            binary = chunk
        position += 8 + size
    if not isinstance(document, dict):
        raise ValueError("the file has no JSON chunk")  # noqa: TRY004 - a broken file, not a programming error
    return document, binary


@dataclass
class _Soup:
    """Pieces of the scene while it is being put together."""

    vertices: list[FloatArray] = field(default_factory=list)
    normals: list[FloatArray] = field(default_factory=list)
    uvs: list[FloatArray] = field(default_factory=list)
    triangles: list[IntArray] = field(default_factory=list)
    instance: list[IntArray] = field(default_factory=list)
    material: list[IntArray] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    vertex_count: int = 0


class _Reader:
    def __init__(self, document: dict[str, Any], binary: bytes) -> None:
        self.document = document
        self.binary = binary
        for extension in document.get("extensionsRequired", []):
            if extension not in _SUPPORTED_EXTENSIONS:
                raise _UnsupportedError(f"It requires the glTF extension {extension}, which is not supported.")

    def scene(self) -> SceneGeometry:
        soup = _Soup()
        for node, matrix in self._nodes():
            if "mesh" in node:
                self._add_object(soup, node, matrix)
        if not soup.triangles:
            raise _UnsupportedError("It holds no triangles.")
        materials = tuple(self._material(entry) for entry in self.document.get("materials", []))
        return SceneGeometry(
            vertices=np.concatenate(soup.vertices),
            triangles=np.concatenate(soup.triangles),
            triangle_instance=np.concatenate(soup.instance),
            triangle_material=np.concatenate(soup.material),
            normals=np.concatenate(soup.normals),
            uvs=np.concatenate(soup.uvs),
            materials=(*materials, Material(name="default")),
            instances=tuple(soup.instances),
            images=tuple(self._image(entry) for entry in self.document.get("images", [])),
        )

    def _nodes(self) -> Iterator[tuple[dict[str, Any], npt.NDArray[np.float64]]]:
        """Nodes of the default scene with their world matrices, depth first."""
        nodes = self.document.get("nodes", [])
        scenes = self.document.get("scenes")
        roots = scenes[self.document.get("scene", 0)].get("nodes", []) if scenes else range(len(nodes))
        pending = [(index, np.eye(4)) for index in reversed(list(roots))]
        visited = 0
        while pending:
            index, parent = pending.pop()
            visited += 1
            if visited > len(nodes):
                raise ValueError("its nodes do not form a tree")
            matrix = parent @ _local_matrix(nodes[index])
            yield nodes[index], matrix
            pending += [(child, matrix) for child in reversed(nodes[index].get("children", []))]

    def _add_object(self, soup: _Soup, node: dict[str, Any], matrix: npt.NDArray[np.float64]) -> None:
        index = len(soup.instances) + 1
        mesh = self.document["meshes"][node["mesh"]]
        extras = (node.get("extras") or {}).get("benchbot") or {}
        name = str(extras.get("instance") or node.get("name") or mesh.get("name") or f"object {index}")
        class_name = extras.get("class")
        soup.instances.append(
            Instance(index, name, None if class_name is None else str(class_name), bool(extras.get("group", False)))
        )
        linear = Y_UP_TO_Z_UP @ matrix[:3, :3]
        offset = Y_UP_TO_Z_UP @ matrix[:3, 3]
        mirrored = np.linalg.det(linear) < 0
        for primitive in mesh["primitives"]:
            if primitive.get("mode", _TRIANGLES) != _TRIANGLES:
                continue
            attributes = primitive["attributes"]
            position = self._accessor(attributes["POSITION"]).astype(np.float64)
            vertices = (position @ linear.T + offset).astype(np.float32)
            triangles = self._triangles(primitive, len(vertices))
            if mirrored:
                triangles = triangles[:, ::-1]
            uvs = self._uvs(attributes, len(vertices))
            if "NORMAL" in attributes:
                normals = _transform_normals(self._accessor(attributes["NORMAL"]).astype(np.float64), linear)
            else:  # glTF asks for flat shading then: one vertex per corner
                vertices, uvs = vertices[triangles.ravel()], uvs[triangles.ravel()]
                normals = _flat_normals(vertices)
                triangles = np.arange(len(vertices)).reshape(-1, 3)
            material = primitive.get("material", len(self.document.get("materials", [])))
            soup.vertices.append(vertices)
            soup.normals.append(normals)
            soup.uvs.append(uvs)
            soup.triangles.append((triangles + soup.vertex_count).astype(np.int32))
            soup.instance.append(np.full(len(triangles), index, np.int32))
            soup.material.append(np.full(len(triangles), material, np.int32))
            soup.vertex_count += len(vertices)

    def _triangles(self, primitive: dict[str, Any], vertices: int) -> npt.NDArray[np.int64]:
        if "indices" in primitive:
            indices = self._accessor(primitive["indices"]).astype(np.int64).reshape(-1, 3)
        else:
            indices = np.arange(vertices - vertices % 3, dtype=np.int64).reshape(-1, 3)
        if len(indices) and indices.max() >= vertices:
            raise ValueError("a triangle names a vertex that is not there")
        return indices

    def _uvs(self, attributes: dict[str, Any], vertices: int) -> FloatArray:
        if "TEXCOORD_0" not in attributes:
            return np.zeros((vertices, 2), np.float32)
        return self._accessor(attributes["TEXCOORD_0"]).astype(np.float32)

    def _accessor(self, index: int) -> npt.NDArray[Any]:
        accessor = self.document["accessors"][index]
        if "sparse" in accessor:
            raise _UnsupportedError("It has sparse accessors, which are not supported.")
        dtype = _COMPONENT_TYPES[accessor["componentType"]]
        components = _COMPONENTS[accessor["type"]]
        count = int(accessor["count"])
        if "bufferView" not in accessor:
            return np.zeros((count, components), dtype)
        view = self.document["bufferViews"][accessor["bufferView"]]
        stride = view.get("byteStride", 0) or dtype.itemsize * components
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        values = np.ndarray((count, components), dtype, self._buffer(view["buffer"]), start, (stride, dtype.itemsize))
        if accessor.get("normalized"):
            scaled: FloatArray = np.maximum(values.astype(np.float32) / np.float32(np.iinfo(dtype).max), -1.0)
            return scaled
        return values

    def _buffer(self, index: int) -> bytes:
        uri = self.document["buffers"][index].get("uri")
        return self.binary if uri is None else _data_uri(uri)

    def _image(self, entry: dict[str, Any]) -> ImageArray:
        if "bufferView" in entry:
            view = self.document["bufferViews"][entry["bufferView"]]
            start = view.get("byteOffset", 0)
            encoded = self._buffer(view["buffer"])[start : start + view["byteLength"]]
        else:
            encoded = _data_uri(entry["uri"])
        with Image.open(io.BytesIO(encoded)) as image:
            return np.asarray(image.convert("RGBA"))

    def _material(self, entry: dict[str, Any]) -> Material:
        surface = entry.get("pbrMetallicRoughness", {})
        extensions = entry.get("extensions", {})
        strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        red, green, blue, _ = surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        emission = [float(channel) * float(strength) for channel in entry.get("emissiveFactor", (0.0, 0.0, 0.0))]
        return Material(
            name=str(entry.get("name", "")),
            base_color=(float(red), float(green), float(blue)),
            base_color_image=self._texture(surface.get("baseColorTexture")),
            metallic=float(surface.get("metallicFactor", 1.0)),
            roughness=float(surface.get("roughnessFactor", 1.0)),
            metallic_roughness_image=self._texture(surface.get("metallicRoughnessTexture")),
            normal_image=self._texture(entry.get("normalTexture")),
            normal_scale=float(entry.get("normalTexture", {}).get("scale", 1.0)),
            emission=(emission[0], emission[1], emission[2]),
            emission_image=self._texture(entry.get("emissiveTexture")),
            transmission=float(extensions.get("KHR_materials_transmission", {}).get("transmissionFactor", 0.0)),
            refractive_index=float(extensions.get("KHR_materials_ior", {}).get("ior", 1.5)),
            is_solid=float(extensions.get("KHR_materials_volume", {}).get("thicknessFactor", 0.0)) > 0.0,
            alpha_cutoff=float(entry.get("alphaCutoff", 0.5)) if entry.get("alphaMode") == "MASK" else None,
            double_sided=bool(entry.get("doubleSided", False)),
        )

    def _texture(self, reference: dict[str, Any] | None) -> int | None:
        if reference is None:
            return None
        source = self.document["textures"][reference["index"]].get("source")
        return None if source is None else int(source)


def _data_uri(uri: str) -> bytes:
    if not uri.startswith("data:"):
        raise _UnsupportedError(f"It refers to another file ({uri}); a scene must hold everything itself.")
    try:
        return base64.b64decode(uri.partition(",")[2], validate=True)
    except binascii.Error as error:
        raise ValueError("a data URI is not base64") from error


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
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    unit: FloatArray = np.divide(turned, length, out=np.zeros_like(turned), where=length > 0).astype(np.float32)
    return unit


def _flat_normals(corners: FloatArray) -> FloatArray:
    """One normal per corner, that of its triangle; `corners` (3 T, 3)."""
    shape = corners.reshape(-1, 3, 3).astype(np.float64)
    normal = np.cross(shape[:, 1] - shape[:, 0], shape[:, 2] - shape[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    return np.repeat(normal, 3, axis=0).astype(np.float32)
