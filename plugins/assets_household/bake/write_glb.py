"""Write baked parts as a binary glTF 2.0 with one node."""

import io

import numpy as np
from PIL import Image

from benchbot_scenes.glb_writer import GlbWriter
from plugins.assets_household.bake.parts import Part, Picture
from tools.household.gltf import material_entry


def write_glb(name: str, parts: list[Part]) -> bytes:
    """One node `name`; the model frame (x, y, z) becomes glTF's (x, z, -y)."""
    writer = GlbWriter("pygltflib@v1.16.5", deduplicates=False)
    writer.append("samplers", {})
    primitives = []
    for part in parts:
        positions, normals = (array[:, [0, 2, 1]] * [1, 1, -1] for array in (part.positions, part.normals))
        attributes = {
            "POSITION": writer.accessor(positions.astype("<f4"), has_bounds=True),
            "NORMAL": writer.accessor(normals.astype("<f4")),
        }
        if part.surface.images:
            attributes["TEXCOORD_0"] = writer.accessor((part.uvs * [1, -1] + [0, 1]).astype("<f4"))
        primitives.append({"attributes": attributes, "material": _material(writer, part)})
    writer.node(name, writer.append("meshes", {"primitives": primitives, "name": name}), {})
    return writer.to_bytes()


def _material(writer: GlbWriter, part: Part) -> int:
    surface = part.surface
    strength = max(surface.emission)
    entry = material_entry(
        surface.name,
        surface.base_color,
        surface.metallic,
        surface.roughness,
        emissive=np.divide(surface.emission, max(strength, 1e-9)).tolist(),
        emissive_strength=strength if strength > 0 else None,
        transmission=surface.transmission,
        double_sided=True,
        baseColorTexture=_texture(writer, surface.images.get("base_color")),
        metallicRoughnessTexture=_texture(writer, surface.images.get("metallic_roughness")),
        normalTexture=_texture(writer, surface.images.get("normal")),
    )
    return writer.material(entry)


def _texture(writer: GlbWriter, pixels: Picture | None) -> int | None:
    if pixels is None:
        return None
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    picture = writer.append("images", {"mimeType": "image/png", "bufferView": writer.view(stream.getvalue())})
    return writer.append("textures", {"sampler": 0, "source": picture})
