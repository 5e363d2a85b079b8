"""Colours that a file gives for each vertex, brought into a texture that any renderer can look up."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, ImageArray, IntArray, Material, SceneGeometry, only

TRIANGLES_PER_IMAGE = 2**20
MORTON_BITS = 10


def bake(geometry: SceneGeometry, colors: FloatArray, is_colored: npt.NDArray[np.bool_]) -> SceneGeometry:
    """Paint triangles with the colours of their corners.

    `colors` (T, 3, 3) are linear sRGB in 0 … 1; triangles that are not `is_colored` (T,) stay as they are. Each of the
    others gets 2 x 2 texels of its own, between which bilinear look-up blends linearly. Neighbours in space are
    neighbours in the image (both in Morton order), so that its smaller mip levels mean something.
    """
    chosen = np.flatnonzero(is_colored)
    if len(chosen) == 0:
        return geometry
    corners = geometry.triangles[chosen].astype(np.int64)
    chosen = chosen[np.argsort(_morton_3d(geometry.vertices[corners].mean(axis=1)), kind="stable")]
    images, materials = list(geometry.images), list(geometry.materials)
    triangles, triangle_material = geometry.triangles.copy(), geometry.triangle_material.copy()
    vertices, normals, uvs = [geometry.vertices], [geometry.normals], [geometry.uvs]
    count = len(geometry.vertices)
    for first in range(0, len(chosen), TRIANGLES_PER_IMAGE):
        page = chosen[first : first + TRIANGLES_PER_IMAGE]
        image, page_uvs = _paint(colors[page])
        old = geometry.triangles[page].ravel()
        vertices.append(geometry.vertices[old])
        normals.append(geometry.normals[old])
        uvs.append(page_uvs.reshape(-1, 2))
        triangles[page] = (count + np.arange(len(old))).reshape(-1, 3)
        count += len(old)
        for material in np.unique(geometry.triangle_material[page]):
            painted = page[geometry.triangle_material[page] == material]
            triangle_material[painted] = len(materials)
            materials.append(_painted(geometry.materials[material], len(images)))
        images.append(image)
    painted_geometry = replace(
        geometry,
        vertices=np.concatenate(vertices),
        normals=np.concatenate(normals),
        uvs=np.concatenate(uvs),
        triangles=triangles,
        triangle_material=triangle_material,
        materials=tuple(materials),
        images=tuple(images),
    )
    return only(painted_geometry, np.ones(len(triangles), bool))


def srgb_to_linear(values: npt.NDArray[np.floating]) -> FloatArray:
    """Inverse of the sRGB transfer function (IEC 61966-2-1) on values in 0 … 1."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)


def linear_to_srgb(values: npt.NDArray[np.floating]) -> FloatArray:
    """The sRGB transfer function on values in 0 … 1."""
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055).astype(np.float32)


def _paint(colors: FloatArray) -> tuple[ImageArray, FloatArray]:
    """The image of triangles with corner colours (N, 3, 3), and their corners' places in it (N, 3, 2)."""
    column, row = _morton_2d(np.arange(len(colors)))
    first, second, third = (colors[:, corner] for corner in range(3))
    width, height = 2 * (int(column.max()) + 1), 2 * (int(row.max()) + 1)
    image: ImageArray = np.zeros((height, width, 4), np.uint8)
    image[..., 3] = 255
    for right, down, texel in ((0, 0, first), (1, 0, second), (0, 1, third), (1, 1, second + third - first)):
        image[2 * row + down, 2 * column + right, :3] = linear_to_srgb(np.clip(texel, 0.0, 1.0)) * 255.0 + 0.5
    centers = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]])
    uvs = (2.0 * np.stack([column, row], axis=1)[:, None] + centers) / [width, height]
    return image, uvs.astype(np.float32)


def _painted(material: Material, image: int) -> Material:
    return replace(
        material,
        name=f"{material.name} painted".strip(),
        base_color_image=image,
        metallic_roughness_image=None,
        normal_image=None,
        emission_image=None,
    )


def _morton_3d(points: npt.NDArray[np.floating]) -> npt.NDArray[np.uint64]:
    """Order along a curve that fills space (G. M. Morton, 1966)."""
    low, high = points.min(axis=0), points.max(axis=0)
    scaled = (points - low) / np.maximum(high - low, 1e-9) * (2**MORTON_BITS - 1)
    code = np.zeros(len(points), np.uint64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= ((scaled[:, axis].astype(np.uint64) >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return code


def _morton_2d(index: IntArray | npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    column, row = np.zeros(len(index), np.int64), np.zeros(len(index), np.int64)
    for bit in range(16):
        column |= ((index >> (2 * bit)) & 1) << bit
        row |= ((index >> (2 * bit + 1)) & 1) << bit
    return column, row
