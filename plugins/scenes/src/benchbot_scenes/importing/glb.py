"""Writing a scene as binary glTF 2.0, one node for each object."""

import io
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot_scenes.glb_writer import INDICES, VERTICES, GlbWriter
from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.gltf_splats import EXTENSION, POINTS
from benchbot_scenes.scene import ImageArray, Instance, Material, SceneGeometry
from benchbot_scenes.splats import Splats, harmonics_of_colors, transformed

JPEG_QUALITY = 92
SMALL_IMAGE_PIXELS = 256 * 256
SPLATS = "splats"
_SHORT = 32767


def to_glb(geometry: SceneGeometry) -> bytes:
    """The file's bytes; the same scene gives the same bytes. Objects without triangles are not in it."""
    writer = GlbWriter(deduplicates=False)
    for instance, triangles in _by_instance(geometry):
        primitives = _primitives(writer, geometry, triangles)
        tag = {"class": instance.class_name, "instance": instance.name, "group": instance.is_group}
        writer.node(instance.name, writer.append("meshes", {"name": instance.name, "primitives": primitives}), tag)
    if geometry.splats is not None:
        _add_splats(writer, geometry.splats)
    data_images = _data_images(geometry.materials)
    for index, image in enumerate(geometry.images):
        data, mime = _encoded(image, index in data_images)
        writer.append("images", {"bufferView": writer.view(data), "mimeType": mime})
        writer.append("textures", {"source": index})
    for material in geometry.materials:
        writer.material(_material(material))
    return writer.to_bytes()


def _primitives(writer: GlbWriter, geometry: SceneGeometry, triangles: npt.NDArray[np.int64]) -> list[dict[str, Any]]:
    """One for each material."""
    materials = geometry.triangle_material[triangles]
    to_y_up = Y_UP_TO_Z_UP.astype(np.float32)
    primitives = []
    for material in np.unique(materials):
        used, indices = _compact(geometry.triangles[triangles[materials == material]], len(geometry.vertices))
        attributes = {
            "POSITION": writer.accessor(geometry.vertices[used] @ to_y_up, VERTICES, has_bounds=True),
            "NORMAL": writer.accessor(geometry.normals[used] @ to_y_up, VERTICES),
        }
        if _is_textured(geometry.materials[material]):
            attributes["TEXCOORD_0"] = writer.accessor(geometry.uvs[used], VERTICES)
        order = writer.accessor(indices.ravel(), INDICES)
        primitives.append({"attributes": attributes, "indices": order, "material": int(material)})
    return primitives


def _add_splats(writer: GlbWriter, splats: Splats) -> None:
    """Add a node of all splats: 84 bytes each, or 48 where none changes its colour with the view."""
    turned = transformed(splats, Y_UP_TO_Z_UP.T)
    constant, linear = harmonics_of_colors(turned)
    quaternions = np.round(turned.rotations * _SHORT).astype("<i2")
    attributes = {
        "POSITION": writer.accessor(turned.positions_m, VERTICES, has_bounds=True),
        f"{EXTENSION}:ROTATION": writer.accessor(quaternions, VERTICES, is_normalized=True),
        f"{EXTENSION}:SCALE": writer.accessor(turned.scales_m, VERTICES),
        f"{EXTENSION}:OPACITY": writer.accessor(turned.opacities, VERTICES),
        f"{EXTENSION}:SH_DEGREE_0_COEF_0": writer.accessor(constant, VERTICES),
    }
    for order in range(3 if linear.any() else 0):
        values = np.ascontiguousarray(linear[:, order])
        attributes[f"{EXTENSION}:SH_DEGREE_1_COEF_{order}"] = writer.accessor(values, VERTICES)
    extension = {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}
    primitive = {"attributes": attributes, "mode": POINTS, "extensions": {EXTENSION: extension}}
    writer.use(EXTENSION)
    writer.node(SPLATS, writer.append("meshes", {"name": SPLATS, "primitives": [primitive]}), {})


def _encoded(image: ImageArray, is_data: bool) -> tuple[bytes, str]:
    """Encode as JPEG, or as PNG what is small, data or partly clear; returns the bytes and their MIME type."""
    stream = io.BytesIO()
    is_clear = bool((image[..., 3] < 255).any())
    if is_data or is_clear or image.shape[0] * image.shape[1] <= SMALL_IMAGE_PIXELS:
        Image.fromarray(image if is_clear else image[..., :3]).save(stream, "PNG", compress_level=3)
        return stream.getvalue(), "image/png"
    Image.fromarray(image[..., :3]).save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    return stream.getvalue(), "image/jpeg"


def _compact(triangles: npt.NDArray[np.int32], count: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint32]]:
    """Return the indices of the used ones of `count` vertices, and the triangles' corners as indices into these."""
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
