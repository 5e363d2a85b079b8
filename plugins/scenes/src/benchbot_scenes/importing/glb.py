"""Writes a scene as binary glTF 2.0 (Khronos glTF 2.0 specification), one node for each object."""

import io
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.gltf_file import join_glb
from benchbot_scenes.scene import ImageArray, Instance, Material, SceneGeometry

_FLOAT, _UNSIGNED_INT = 5126, 5125
_ARRAY, _INDICES = 34962, 34963
JPEG_QUALITY = 92
SMALL_IMAGE_PIXELS = 256 * 256


def to_glb(geometry: SceneGeometry) -> bytes:
    """The file's bytes; the same scene gives the same bytes. Objects without triangles are not in it."""
    return _Writer(geometry).file()


class _Writer:
    def __init__(self, geometry: SceneGeometry) -> None:
        self._geometry = geometry
        self._blob = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []

    def file(self) -> bytes:
        meshes: list[dict[str, Any]] = []
        nodes: list[dict[str, Any]] = []
        for instance, triangles in _by_instance(self._geometry):
            nodes.append({"name": instance.name, "mesh": len(meshes), "extras": {"benchbot": _tag(instance)}})
            meshes.append({"name": instance.name, "primitives": self._primitives(triangles)})
        data_images = _data_images(self._geometry.materials)
        images = [self._image(image, i in data_images) for i, image in enumerate(self._geometry.images)]
        document = {
            "asset": {"version": "2.0", "generator": "benchbot-scenes"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(nodes)))}],
            "nodes": nodes,
            "meshes": meshes,
            "materials": [_material(material) for material in self._geometry.materials],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._blob)}],
            "extensionsUsed": [
                "KHR_materials_emissive_strength",
                "KHR_materials_ior",
                "KHR_materials_transmission",
                "KHR_materials_volume",
            ],
        }
        if images:
            document |= {"images": images, "textures": [{"source": i} for i in range(len(images))]}
        return join_glb(document, self._blob)

    def _primitives(self, triangles: npt.NDArray[np.int64]) -> list[dict[str, Any]]:
        """One for each material."""
        materials = self._geometry.triangle_material[triangles]
        return [
            self._primitive(self._geometry.triangles[triangles[materials == material]], int(material))
            for material in np.unique(materials)
        ]

    def _primitive(self, triangles: npt.NDArray[np.int32], material: int) -> dict[str, Any]:
        used, indices = _compact(triangles, len(self._geometry.vertices))
        geometry, to_y_up = self._geometry, Y_UP_TO_Z_UP.astype(np.float32)
        attributes = {
            "POSITION": self._accessor(geometry.vertices[used] @ to_y_up, "VEC3", bounds=True),
            "NORMAL": self._accessor(geometry.normals[used] @ to_y_up, "VEC3"),
        }
        if _is_textured(geometry.materials[material]):
            attributes["TEXCOORD_0"] = self._accessor(geometry.uvs[used], "VEC2")
        order = self._accessor(indices.reshape(-1, 1), "SCALAR", kind=_UNSIGNED_INT, target=_INDICES)
        return {"attributes": attributes, "indices": order, "material": material}

    def _view(self, data: bytes, target: int | None = None) -> int:
        self._blob.extend(bytes(-len(self._blob) % 4))
        view = {"buffer": 0, "byteOffset": len(self._blob), "byteLength": len(data)}
        self._views.append(view if target is None else view | {"target": target})
        self._blob.extend(data)
        return len(self._views) - 1

    def _accessor(
        self, values: npt.NDArray[Any], shape: str, kind: int = _FLOAT, target: int = _ARRAY, bounds: bool = False
    ) -> int:
        entry = {
            "bufferView": self._view(np.ascontiguousarray(values).tobytes(), target),
            "componentType": kind,
            "count": len(values),
            "type": shape,
        }
        if bounds:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self._accessors.append(entry)
        return len(self._accessors) - 1

    def _image(self, image: ImageArray, is_data: bool) -> dict[str, Any]:
        """JPEG for pictures of some size, PNG for numbers and for what is partly clear."""
        stream = io.BytesIO()
        if is_data or (image[..., 3] < 255).any() or image.shape[0] * image.shape[1] <= SMALL_IMAGE_PIXELS:
            Image.fromarray(image if (image[..., 3] < 255).any() else image[..., :3]).save(
                stream, "PNG", compress_level=3
            )
            return {"bufferView": self._view(stream.getvalue()), "mimeType": "image/png"}
        Image.fromarray(image[..., :3]).save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)
        return {"bufferView": self._view(stream.getvalue()), "mimeType": "image/jpeg"}


def _compact(triangles: npt.NDArray[np.int32], count: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint32]]:
    """Which of `count` vertices are used, and the triangles' corners as places among these."""
    if triangles.size * 8 < count:
        used, places = np.unique(triangles, return_inverse=True)
        return used.astype(np.int64), places.astype(np.uint32)
    is_used = np.zeros(count, bool)
    is_used[triangles] = True
    new = np.cumsum(is_used, dtype=np.uint32) - np.uint32(1)
    return np.flatnonzero(is_used), new[triangles]


def _by_instance(geometry: SceneGeometry) -> list[tuple[Instance, npt.NDArray[np.int64]]]:
    order = np.argsort(geometry.triangle_instance, kind="stable")
    numbers, first = np.unique(geometry.triangle_instance[order], return_index=True)
    by_number = dict(zip(numbers.tolist(), np.split(order, first[1:]), strict=True))
    return [(found, by_number[found.index]) for found in geometry.instances if found.index in by_number]


def _tag(instance: Instance) -> dict[str, Any]:
    return {"class": instance.class_name, "instance": instance.name, "group": instance.is_group}


def _is_textured(material: Material) -> bool:
    images = (
        material.base_color_image,
        material.metallic_roughness_image,
        material.normal_image,
        material.emission_image,
    )
    return any(image is not None for image in images)


def _data_images(materials: tuple[Material, ...]) -> set[int]:
    """Images of which each number counts: no loss is good for normals, and texels of painted triangles stand alone."""
    data = {image for m in materials for image in (m.metallic_roughness_image, m.normal_image) if image is not None}
    painted = {m.base_color_image for m in materials if m.name.endswith("painted") and m.base_color_image is not None}
    return data | painted


def _material(material: Material) -> dict[str, Any]:
    surface: dict[str, Any] = {
        "baseColorFactor": [*material.base_color, 1.0],
        "metallicFactor": material.metallic,
        "roughnessFactor": material.roughness,
    }
    surface |= _texture("baseColorTexture", material.base_color_image)
    surface |= _texture("metallicRoughnessTexture", material.metallic_roughness_image)
    strength = max(*material.emission, 1.0)
    entry: dict[str, Any] = {
        "name": material.name,
        "pbrMetallicRoughness": surface,
        "emissiveFactor": [channel / strength for channel in material.emission],
        "doubleSided": material.double_sided,
    }
    entry |= _texture("emissiveTexture", material.emission_image)
    if material.normal_image is not None:
        entry["normalTexture"] = {"index": material.normal_image, "scale": material.normal_scale}
    if material.alpha_cutoff is not None:
        entry |= {"alphaMode": "MASK", "alphaCutoff": material.alpha_cutoff}
    extensions: dict[str, Any] = {}
    if strength > 1.0:
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
    if material.transmission > 0.0:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": material.transmission}
    if material.refractive_index != 1.5:
        extensions["KHR_materials_ior"] = {"ior": material.refractive_index}
    if material.is_solid:
        extensions["KHR_materials_volume"] = {"thicknessFactor": 0.01}
    return entry | ({"extensions": extensions} if extensions else {})


def _texture(key: str, image: int | None) -> dict[str, Any]:
    return {} if image is None else {key: {"index": image}}
