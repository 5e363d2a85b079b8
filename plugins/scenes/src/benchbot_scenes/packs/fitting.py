"""Models of Sweet Home 3D made into assets: turned, sized, in the map frame, with materials of this renderer."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot_scenes.importing import obj
from benchbot_scenes.importing.model import Model
from benchbot_scenes.importing.sanity import sound
from benchbot_scenes.packs.sh3f import Furniture
from benchbot_scenes.scene import ImageArray, Instance, Material, SceneGeometry, only, unit_vectors
from benchbot_scenes.vertex_colors import srgb_to_linear

MAX_TEXTURE_PIXELS = 512
SMOOTHEST = 0.25
"""Ambient light alone lit these models where they were made for; with less roughness than this, paint would mirror."""

CLEAR = (0.97, 0.97, 0.97)

_TO_MAP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""From y up, facing +z, to z up, facing +x."""


def fitted(path: Path, furniture: Furniture, instance: Instance, parts: Sequence[str], scale: float) -> SceneGeometry:
    """Read an OBJ file as one object in an asset's frame (see `AssetModel`), of the size that its catalogue says.

    `parts` keeps only objects of the file whose names begin so, at their size within the whole. Raises BenchbotError
    for a file that cannot be read, and for parts that are not there.
    """
    model = sound(obj.read(path), path)
    turned = model.geometry.vertices.astype(np.float64) @ furniture.rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    # What is flat in a direction has no size to be fitted there.
    stretch = np.divide(furniture.size_m, high - low, out=np.ones(3), where=high - low > 1e-9) * scale
    geometry = replace(model.geometry, vertices=(turned * stretch @ _TO_MAP.T).astype(np.float32))
    normals = model.geometry.normals @ furniture.rotation.T / stretch @ _TO_MAP.T
    geometry = replace(geometry, normals=unit_vectors(normals))
    if parts:
        geometry = only(geometry, _is_part(model, parts))
    low, high = geometry.vertices.min(axis=0), geometry.vertices.max(axis=0)
    origin = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]], np.float32)
    geometry = replace(
        geometry,
        vertices=geometry.vertices - origin,
        instances=(instance,),
        triangle_instance=np.full(len(geometry.triangles), instance.index, np.int32),
    )
    return _with_usable_materials(_with_needed_materials(geometry))


def _is_part(model: Model, parts: Sequence[str]) -> npt.NDArray[np.bool_]:
    wanted = [
        instance.index
        for instance, path in zip(model.geometry.instances, model.paths, strict=True)
        if any(name.startswith(tuple(parts)) for name in path)
    ]
    is_part: npt.NDArray[np.bool_] = np.isin(model.geometry.triangle_instance, wanted)
    if not is_part.any():
        raise ValueError(f"it has no object whose name begins with {' or '.join(parts)}")
    return is_part


def _with_needed_materials(geometry: SceneGeometry) -> SceneGeometry:
    """Drop materials that no triangle has, and images that no material has left."""
    used, triangle_material = np.unique(geometry.triangle_material, return_inverse=True)
    materials = [geometry.materials[number] for number in used]
    needed = sorted({material.base_color_image for material in materials if material.base_color_image is not None})
    numbers = {old: new for new, old in enumerate(needed)}
    materials = [
        replace(
            material,
            base_color_image=None if material.base_color_image is None else numbers[material.base_color_image],
            normal_image=None,
        )
        for material in materials
    ]
    return replace(
        geometry,
        materials=tuple(materials),
        triangle_material=triangle_material.astype(np.int32),
        images=tuple(_shrunk(geometry.images[number]) for number in needed),
    )


def _with_usable_materials(geometry: SceneGeometry) -> SceneGeometry:
    is_cut_out = [bool((image[..., 3] < 128).mean() > 0.01) for image in geometry.images]
    return replace(geometry, materials=tuple(_usable(material, is_cut_out) for material in geometry.materials))


def _usable(material: Material, is_cut_out: Sequence[bool]) -> Material:
    """The colours of these files are as a screen shows them; holes are in the alpha of textures, unannounced."""
    if material.is_glass:
        # What a screen blends in is no tint: many a glass here is black with little opacity.
        return replace(material, base_color=CLEAR, base_color_image=None)
    red, green, blue = (float(channel) for channel in srgb_to_linear(np.clip(np.array(material.base_color), 0.0, 1.0)))
    picture = material.base_color_image
    return replace(
        material,
        base_color=(red, green, blue),
        roughness=max(material.roughness, SMOOTHEST),
        alpha_cutoff=0.5 if picture is not None and is_cut_out[picture] else None,
        emission=(0.0, 0.0, 0.0),
        double_sided=True,
    )


def _shrunk(image: ImageArray) -> ImageArray:
    longest = max(image.shape[:2])
    if longest <= MAX_TEXTURE_PIXELS:
        return image
    factor = MAX_TEXTURE_PIXELS / longest
    size = (max(1, round(image.shape[1] * factor)), max(1, round(image.shape[0] * factor)))
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.LANCZOS))
