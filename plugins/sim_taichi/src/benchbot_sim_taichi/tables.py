"""The scene as flat arrays that kernels read: triangle records, material records, texels, tree and lights."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, IntArray, Material, SceneGeometry

TRIANGLE_STRIDE = 24
MATERIAL_STRIDE = 20
CAMERA_STRIDE = 25


def triangle_records(scene: SceneGeometry, ids: npt.NDArray[np.int64] | slice = slice(None)) -> FloatArray:
    """(T * 24,): three normals, three uvs, geometric normal, material, instance, texture density, tangent.

    Texture density is the square root of uv area over area (per metre), negative where the uvs are mirrored; the
    tangent is dP/du, unit. All triangles, or those of some `ids`.
    """
    triangles = scene.triangles[ids]
    corner = scene.vertices[triangles].astype(np.float64)
    uv = scene.uvs[triangles].astype(np.float64)
    edge1, edge2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    duv1, duv2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    cross = np.cross(edge1, edge2)
    doubled_area = np.linalg.norm(cross, axis=1)
    doubled_uv_area = duv1[:, 0] * duv2[:, 1] - duv1[:, 1] * duv2[:, 0]
    tangent = edge1 * duv2[:, 1:] - edge2 * duv1[:, 1:]
    tangent *= np.sign(doubled_uv_area)[:, None]
    record = np.zeros((len(corner), TRIANGLE_STRIDE), np.float32)
    record[:, 0:9] = scene.normals[triangles].reshape(-1, 9)
    record[:, 9:15] = uv.reshape(-1, 6)
    record[:, 15:18] = _unit(cross)
    record[:, 18] = scene.triangle_material[ids]
    record[:, 19] = scene.triangle_instance[ids]
    density = np.sqrt(np.abs(doubled_uv_area) / np.maximum(doubled_area, 1e-12))
    record[:, 20] = np.where(doubled_uv_area > 0, -density, density)  # v runs down, so mirrored uvs turn left
    record[:, 21:24] = _unit(tangent)
    return np.nan_to_num(record, copy=False, nan=0.0, posinf=0.0, neginf=0.0).ravel()


def material_records(materials: tuple[Material, ...]) -> FloatArray:
    """(M * 20,): base colour, emission, metallic, roughness, three image indices (-1 none), normal scale, flags.

    After the flags (glass, alpha cut-off, double-sided): emission's image, reflectance of a dielectric head-on
    (KHR_materials_ior), and the refractive index of solid glass (0 for all else).
    """
    record = np.zeros((len(materials), MATERIAL_STRIDE), np.float32)
    for row, material in zip(record, materials, strict=True):
        row[0:3] = material.base_color
        row[3:6] = material.emission
        row[6] = material.metallic
        row[7] = material.roughness
        row[8] = _image(material.base_color_image)
        row[9] = _image(material.metallic_roughness_image)
        row[10] = _image(material.normal_image)
        row[11] = material.normal_scale
        row[12] = material.is_glass
        row[13] = -1.0 if material.alpha_cutoff is None else material.alpha_cutoff
        row[14] = material.double_sided
        row[15] = _image(material.emission_image)
        row[16] = ((material.refractive_index - 1.0) / (material.refractive_index + 1.0)) ** 2
        row[17] = material.refractive_index if material.is_glass and material.is_solid else 0.0
    return record.ravel()


def color_images(materials: tuple[Material, ...]) -> set[int]:
    """Images that hold sRGB colour, as opposed to data."""
    colored = (image for m in materials for image in (m.base_color_image, m.emission_image))
    return {image for image in colored if image is not None}


@dataclass(frozen=True)
class TriangleGroups:
    """Triangle ids by how light meets them: `solid` stops it, `sheer` (glass, cut-outs) may let it pass."""

    solid: npt.NDArray[np.int64]
    sheer: npt.NDArray[np.int64]


def group_triangles(scene: SceneGeometry) -> TriangleGroups:
    """Sort triangles by the material that they carry."""
    sheer = is_sheer(scene)
    return TriangleGroups(np.flatnonzero(~sheer), np.flatnonzero(sheer))


def is_sheer(scene: SceneGeometry) -> npt.NDArray[np.bool_]:
    """Say of each triangle (T,) whether light may pass through it."""
    materials = np.array([m.is_glass or m.alpha_cutoff is not None for m in scene.materials], bool)
    sheer: npt.NDArray[np.bool_] = materials[scene.triangle_material]
    return sheer


def triangle_areas(vertices: FloatArray, triangles: IntArray) -> npt.NDArray[np.float64]:
    """(T,) areas in square metres."""
    corner = vertices[triangles].astype(np.float64)
    areas: npt.NDArray[np.float64] = 0.5 * np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    return areas


def _image(index: int | None) -> float:
    return -1.0 if index is None else float(index)


def _unit(vectors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: npt.NDArray[np.float64] = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return unit


@dataclass(frozen=True)
class DeviceScene:
    """A scene's arrays, in the order in which kernels take them.

    `tree`: nodes, leaves; `surfaces`: triangle records, material records, texels, image table; `lights`: environment,
    light records, number of portals, number of lamps; `light_of` is each triangle's light record, -1 none.
    `sheer_root` is -1 when no triangle is sheer.
    """

    tree: tuple[Any, Any]
    sheer_root: int
    surfaces: tuple[Any, Any, Any, Any]
    lights: tuple[Any, Any, int, int]
    light_of: Any
