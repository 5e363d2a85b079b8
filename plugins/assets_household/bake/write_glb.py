"""Write baked parts as a binary glTF 2.0 with one node."""

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pygltflib
from PIL import Image

from plugins.assets_household.bake.parts import Floats, Part, Picture, Surface


def write_glb(name: str, parts: list[Part]) -> bytes:
    """One node `name`; the model frame (x, y, z) becomes glTF's (x, z, -y)."""
    document, blob = pygltflib.GLTF2(asset=pygltflib.Asset(version="2.0"), scene=0), bytearray()
    document.samplers = [pygltflib.Sampler()]

    def view(data: bytes) -> int:
        document.bufferViews.append(pygltflib.BufferView(buffer=0, byteOffset=len(blob), byteLength=len(data)))
        blob.extend(data + bytes(-len(data) % 4))
        return len(document.bufferViews) - 1

    def accessor(values: Floats) -> int:
        floats = np.ascontiguousarray(values, "<f4")
        document.accessors.append(
            pygltflib.Accessor(
                bufferView=view(floats.tobytes()),
                componentType=pygltflib.FLOAT,
                count=len(floats),
                type=f"VEC{floats.shape[1]}",
                min=floats.min(axis=0).tolist(),
                max=floats.max(axis=0).tolist(),
            )
        )
        return len(document.accessors) - 1

    def texture(pixels: Picture | None) -> int | None:
        if pixels is None:
            return None
        stream = io.BytesIO()
        Image.fromarray(pixels).save(stream, "PNG")
        document.images.append(pygltflib.Image(bufferView=view(stream.getvalue()), mimeType="image/png"))
        document.textures.append(pygltflib.Texture(sampler=0, source=len(document.images) - 1))
        return len(document.textures) - 1

    primitives = []
    for part in parts:
        attributes = pygltflib.Attributes(
            POSITION=accessor(part.positions[:, [0, 2, 1]] * [1, 1, -1]),
            NORMAL=accessor(part.normals[:, [0, 2, 1]] * [1, 1, -1]),
        )
        if part.surface.images:
            attributes.TEXCOORD_0 = accessor(part.uvs * [1, -1] + [0, 1])
        document.materials.append(_material(part.surface, texture))
        primitives.append(pygltflib.Primitive(attributes=attributes, material=len(document.materials) - 1))
    document.extensionsUsed = sorted({key for material in document.materials for key in material.extensions})
    document.meshes = [pygltflib.Mesh(name=name, primitives=primitives)]
    document.nodes = [pygltflib.Node(name=name, mesh=0)]
    document.scenes = [pygltflib.Scene(nodes=[0])]
    document.buffers = [pygltflib.Buffer(byteLength=len(blob))]
    document.set_binary_blob(bytes(blob))
    return b"".join(document.save_to_bytes())


def _material(surface: Surface, texture: Callable[[Picture | None], int | None]) -> pygltflib.Material:
    base = texture(surface.images.get("base_color"))
    rough = texture(surface.images.get("metallic_roughness"))
    normal = texture(surface.images.get("normal"))
    extensions: dict[str, Any] = {}
    if surface.transmission:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": surface.transmission}
    if max(surface.emission) > 0:
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": max(surface.emission)}
    return pygltflib.Material(
        name=surface.name,
        pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
            baseColorFactor=[*surface.base_color, 1.0],
            metallicFactor=surface.metallic,
            roughnessFactor=surface.roughness,
            baseColorTexture=None if base is None else pygltflib.TextureInfo(index=base),
            metallicRoughnessTexture=None if rough is None else pygltflib.TextureInfo(index=rough),
        ),
        normalTexture=None if normal is None else pygltflib.NormalMaterialTexture(index=normal),
        emissiveFactor=[channel / max(*surface.emission, 1e-9) for channel in surface.emission],
        alphaMode=None,
        alphaCutoff=None,
        doubleSided=True,
        extensions=extensions,
    )
