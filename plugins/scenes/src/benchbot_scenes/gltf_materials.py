"""Materials of glTF 2.0 as this package has them."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import Material

# An older file's diffuse colour and gloss, and how a texture lies on a surface.
_GLOSS = "KHR_materials_pbrSpecularGlossiness"
_TRANSFORM = "KHR_texture_transform"
_WEBP = "EXT_texture_webp"
CLEAR_BELOW_ALPHA = 0.5
"""Of blended materials without texture: those are panes, and the others as good as opaque."""


def material(document: dict[str, Any], entry: dict[str, Any]) -> Material:
    """The material that an entry of the document's materials describes; blending becomes glass or a cut-out."""
    extensions = entry.get("extensions", {})
    surface = _surface(entry)
    strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    red, green, blue, alpha = surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    emission = [float(channel) * float(strength) for channel in entry.get("emissiveFactor", (0.0, 0.0, 0.0))]
    mode = entry.get("alphaMode", "OPAQUE")
    has_cut_out = mode == "MASK" or (mode == "BLEND" and "baseColorTexture" in surface and alpha >= CLEAR_BELOW_ALPHA)
    is_pane = mode == "BLEND" and alpha < CLEAR_BELOW_ALPHA
    transmission = extensions.get("KHR_materials_transmission", {}).get("transmissionFactor", 1.0 if is_pane else 0.0)
    return Material(
        name=str(entry.get("name", "")),
        base_color=(float(red), float(green), float(blue)),
        base_color_image=_image(document, surface.get("baseColorTexture")),
        metallic=float(surface.get("metallicFactor", 1.0)),
        roughness=float(surface.get("roughnessFactor", 1.0)),
        metallic_roughness_image=_image(document, surface.get("metallicRoughnessTexture")),
        normal_image=_image(document, entry.get("normalTexture")),
        normal_scale=float(entry.get("normalTexture", {}).get("scale", 1.0)),
        emission=(emission[0], emission[1], emission[2]),
        emission_image=_image(document, entry.get("emissiveTexture")),
        transmission=float(transmission),
        refractive_index=float(extensions.get("KHR_materials_ior", {}).get("ior", 1.5)),
        is_solid=float(extensions.get("KHR_materials_volume", {}).get("thicknessFactor", 0.0)) > 0.0,
        alpha_cutoff=float(entry.get("alphaCutoff", 0.5)) if has_cut_out else None,
        double_sided=bool(entry.get("doubleSided", False)),
    )


def texture_coordinates(entry: dict[str, Any]) -> tuple[str, npt.NDArray[np.float64] | None]:
    """Return the vertex attribute with a material's texture coordinates, and their (2, 3) transform or None."""
    reference = _surface(entry).get("baseColorTexture") or entry.get("normalTexture") or {}
    transform = reference.get("extensions", {}).get(_TRANSFORM)
    attribute = f"TEXCOORD_{int((transform or {}).get('texCoord', reference.get('texCoord', 0)))}"
    if transform is None:
        return attribute, None
    (x, y), (scale_x, scale_y) = transform.get("offset", (0.0, 0.0)), transform.get("scale", (1.0, 1.0))
    angle = float(transform.get("rotation", 0.0))
    cos, sin = math.cos(angle), math.sin(angle)
    return attribute, np.array([[cos * scale_x, sin * scale_y, x], [-sin * scale_x, cos * scale_y, y]], np.float64)


def _surface(entry: dict[str, Any]) -> dict[str, Any]:
    """Return the metallic-roughness part, or its substitute."""
    extensions = entry.get("extensions", {})
    if _GLOSS in extensions and "pbrMetallicRoughness" not in entry:
        gloss = extensions[_GLOSS]
        surface = {
            "baseColorFactor": gloss.get("diffuseFactor", (1.0, 1.0, 1.0, 1.0)),
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0 - float(gloss.get("glossinessFactor", 1.0)),
        }
        return surface | ({"baseColorTexture": gloss["diffuseTexture"]} if "diffuseTexture" in gloss else {})
    surface = dict(entry.get("pbrMetallicRoughness", {}))
    return surface | ({"metallicFactor": 0.0} if "KHR_materials_unlit" in extensions else {})


def _image(document: dict[str, Any], reference: dict[str, Any] | None) -> int | None:
    if reference is None:
        return None
    texture = document["textures"][reference["index"]]
    source = texture.get("extensions", {}).get(_WEBP, {}).get("source", texture.get("source"))
    return None if source is None else int(source)
