"""Write scene objects as binary glTF 2.0 (Khronos, 3D Formats/glTF 2.0 Specification), deterministically."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from benchbot_scenes.glb_writer import INDICES, VERTICES, GlbWriter
from tools.household.model import Material, Mesh, SceneObject, Texture, compact

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

_COLOR_QUALITY, _NORMAL_QUALITY = 82, 76
_LINEAR, _LINEAR_MIPMAP_LINEAR, _REPEAT = 9729, 9987, 10497


def write_glb(path: Path, objects: Sequence[SceneObject], generator: str = "benchbot-assets-household") -> None:
    """Write one node per object; the map frame (x, y, z) becomes glTF's (x, z, -y)."""
    writer = ObjectWriter(generator)
    for item in objects:
        writer.add(item)
    path.write_bytes(writer.to_bytes())


class ObjectWriter:
    """A growing GLB of objects; a material, and a picture of equal bytes, is written once."""

    def __init__(self, generator: str) -> None:
        self._glb = GlbWriter(generator, deduplicates=False)
        sampler = {"magFilter": _LINEAR, "minFilter": _LINEAR_MIPMAP_LINEAR, "wrapS": _REPEAT, "wrapT": _REPEAT}
        self._glb.append("samplers", sampler)
        # By identity; the material is kept so that its number stays its own.
        self._materials: dict[int, tuple[int, Material]] = {}
        self._textures: dict[bytes, int] = {}

    def to_bytes(self) -> bytes:
        """The finished file."""
        return self._glb.to_bytes()

    def add(self, item: SceneObject) -> None:
        """Append an object's node and mesh."""
        primitives = [self._primitive(part.mesh, part.material) for part in compact(item.model)]
        tag = {
            **({} if item.category is None else {"class": item.category}),
            "instance": item.instance,
            "group": item.is_group,
            **({"mounted": True} if item.on_wall else {}),
        }
        mesh = self._glb.append("meshes", {"primitives": primitives, "name": item.instance})
        self._glb.node(item.instance, mesh, tag)

    def material(self, material: Material, extras: Mapping[str, Any] | None = None) -> int:
        """Append a material unless it was appended before; returns its index."""
        if id(material) not in self._materials:
            entry = material_entry(
                material.name,
                material.base_color,
                material.metallic,
                material.roughness,
                emissive=material.emissive,
                emissive_strength=None if material.emissive_strength == 1.0 else material.emissive_strength,
                transmission=material.transmission,
                double_sided=material.double_sided,
                normal_scale=material.normal_scale,
                baseColorTexture=self._texture(material.base_color_texture),
                metallicRoughnessTexture=self._texture(material.metallic_roughness_texture),
                normalTexture=self._texture(material.normal_texture, _NORMAL_QUALITY),
                emissiveTexture=self._texture(material.emissive_texture),
            )
            number = self._glb.material(({"extras": dict(extras)} if extras else {}) | entry)
            self._materials[id(material)] = number, material
        return self._materials[id(material)][0]

    def _primitive(self, mesh: Mesh, material: Material) -> dict[str, Any]:
        vertices, normals = (array[:, [0, 2, 1]] * [1.0, 1.0, -1.0] for array in (mesh.vertices, mesh.normals))
        attributes = {
            "POSITION": self._glb.accessor(vertices.astype("<f4"), VERTICES, has_bounds=True),
            "NORMAL": self._glb.accessor(normals.astype("<f4"), VERTICES),
        }
        texture = _any_texture(material)
        if texture is not None:
            uvs = mesh.uvs / [texture.width_m, texture.height_m]
            uvs = uvs - np.floor(uvs.min(axis=0))
            uvs[:, 1] = np.ceil(uvs[:, 1].max()) - uvs[:, 1]
            attributes["TEXCOORD_0"] = self._glb.accessor(uvs.astype("<f4"), VERTICES)
        index_type = "<u2" if len(vertices) < 65535 else "<u4"
        indices = self._glb.accessor(mesh.triangles.reshape(-1).astype(index_type), INDICES)
        return {"attributes": attributes, "indices": indices, "mode": 4, "material": self.material(material)}

    def _texture(self, texture: Texture | None, quality: int = _COLOR_QUALITY) -> int | None:
        if texture is None:
            return None
        stream = io.BytesIO()
        image = Image.fromarray(texture.image)
        if image.mode == "RGBA":
            image.save(stream, "PNG", optimize=True)
            mime = "image/png"
        else:
            image.save(stream, "JPEG", quality=quality, subsampling=0, optimize=True)
            mime = "image/jpeg"
        data = stream.getvalue()
        if data not in self._textures:
            picture = self._glb.append("images", {"mimeType": mime, "bufferView": self._glb.view(data)})
            self._textures[data] = self._glb.append("textures", {"sampler": 0, "source": picture})
        return self._textures[data]


def material_entry(
    name: str,
    base_color: Sequence[float],
    metallic: float,
    roughness: float,
    *,
    emissive: Sequence[float],
    emissive_strength: float | None,
    transmission: float,
    double_sided: bool,
    normal_scale: float | None = None,
    **textures: int | None,
) -> dict[str, Any]:
    """Return the glTF entry of a material; `textures` are indices by glTF's names, such as `baseColorTexture`."""
    extensions: dict[str, Any] = {}
    if transmission > 0:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": transmission}
    if emissive_strength is not None:
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": emissive_strength}
    given = {role: {"index": index, "texCoord": 0} for role, index in textures.items() if index is not None}
    surface: dict[str, Any] = {
        "baseColorFactor": [*base_color, 1.0],
        "metallicFactor": metallic,
        "roughnessFactor": roughness,
    }
    surface |= {role: given.pop(role) for role in ("baseColorTexture", "metallicRoughnessTexture") if role in given}
    entry: dict[str, Any] = {"extensions": extensions} if extensions else {}
    entry["pbrMetallicRoughness"] = surface
    if "normalTexture" in given:
        scale = {} if normal_scale is None else {"scale": normal_scale}
        entry["normalTexture"] = {"index": given.pop("normalTexture")["index"], **scale}
    return entry | {"emissiveFactor": list(emissive), **given, "doubleSided": double_sided, "name": name}


def _any_texture(material: Material) -> Texture | None:
    return (
        material.base_color_texture
        or material.normal_texture
        or material.metallic_roughness_texture
        or material.emissive_texture
    )
