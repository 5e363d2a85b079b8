"""Write scene objects as binary glTF 2.0 (Khronos, 3D Formats/glTF 2.0 Specification), deterministically."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
import pygltflib
from PIL import Image

from tools.household.model import Material, Mesh, SceneObject, Texture, compact

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

_COLOR_QUALITY, _NORMAL_QUALITY = 82, 76


def write_glb(path: Path, objects: Sequence[SceneObject], generator: str = "benchbot-assets-household") -> None:
    """Write one node per object; the map frame (x, y, z) becomes glTF's (x, z, -y)."""
    writer = _Writer(generator)
    for item in objects:
        writer.add(item)
    writer.document.set_binary_blob(bytes(writer.blob))
    writer.document.buffers = [pygltflib.Buffer(byteLength=len(writer.blob))]
    writer.document.scenes = [pygltflib.Scene(nodes=list(range(len(writer.document.nodes))))]
    path.write_bytes(b"".join(writer.document.save_to_bytes()))


class _Writer:
    """The growing document, its binary blob, and what has been written already."""

    def __init__(self, generator: str) -> None:
        self.document = pygltflib.GLTF2(
            asset=pygltflib.Asset(version="2.0", generator=generator), scene=0, scenes=[], buffers=[]
        )
        self.document.samplers = [
            pygltflib.Sampler(
                magFilter=pygltflib.LINEAR,
                minFilter=pygltflib.LINEAR_MIPMAP_LINEAR,
                wrapS=pygltflib.REPEAT,
                wrapT=pygltflib.REPEAT,
            )
        ]
        self.blob = bytearray()
        self.materials: dict[int, int] = {}
        self.textures: dict[bytes, int] = {}
        self.kept: list[Material] = []

    def add(self, item: SceneObject) -> None:
        """Append an object's node and mesh."""
        document = self.document
        primitives = [self._primitive(part.mesh, part.material) for part in compact(item.model)]
        document.meshes.append(pygltflib.Mesh(name=item.instance, primitives=primitives))
        tag: dict[str, Any] = {"class": item.category, "instance": item.instance, "group": item.is_group}
        if item.on_wall:
            tag["mounted"] = True
        document.nodes.append(
            pygltflib.Node(name=item.instance, mesh=len(document.meshes) - 1, extras={"benchbot": tag})
        )

    def _primitive(self, mesh: Mesh, material: Material) -> Any:
        vertices, normals = (array[:, [0, 2, 1]] * [1.0, 1.0, -1.0] for array in (mesh.vertices, mesh.normals))
        index_type = np.uint16 if len(vertices) < 65535 else np.uint32
        attributes = pygltflib.Attributes(
            POSITION=self._accessor(vertices.astype(np.float32), pygltflib.VEC3, with_bounds=True),
            NORMAL=self._accessor(normals.astype(np.float32), pygltflib.VEC3),
        )
        texture = _any_texture(material)
        if texture is not None:
            uvs = mesh.uvs / [texture.width_m, texture.height_m]
            uvs = uvs - np.floor(uvs.min(axis=0))
            uvs[:, 1] = np.ceil(uvs[:, 1].max()) - uvs[:, 1]
            attributes.TEXCOORD_0 = self._accessor(uvs.astype(np.float32), pygltflib.VEC2)
        indices = self._accessor(mesh.triangles.reshape(-1).astype(index_type), pygltflib.SCALAR, indices=True)
        return pygltflib.Primitive(attributes=attributes, indices=indices, material=self._material(material))

    def _view(self, data: bytes, target: int | None = None) -> int:
        self.blob.extend(bytes(-len(self.blob) % 4))
        self.document.bufferViews.append(
            pygltflib.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=len(data), target=target)
        )
        self.blob.extend(data)
        return len(self.document.bufferViews) - 1

    def _accessor(self, array: NDArray[Any], kind: str, with_bounds: bool = False, indices: bool = False) -> int:
        components = {"float32": pygltflib.FLOAT, "uint16": pygltflib.UNSIGNED_SHORT, "uint32": pygltflib.UNSIGNED_INT}
        view = self._view(array.tobytes(), pygltflib.ELEMENT_ARRAY_BUFFER if indices else pygltflib.ARRAY_BUFFER)
        self.document.accessors.append(
            pygltflib.Accessor(
                bufferView=view,
                componentType=components[array.dtype.name],
                count=len(array),
                type=kind,
                min=array.min(axis=0).tolist() if with_bounds else None,
                max=array.max(axis=0).tolist() if with_bounds else None,
            )
        )
        return len(self.document.accessors) - 1

    def _texture(self, texture: Texture | None, quality: int = _COLOR_QUALITY) -> Any:
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
        if data not in self.textures:
            self.document.images.append(pygltflib.Image(bufferView=self._view(data), mimeType=mime))
            self.document.textures.append(pygltflib.Texture(sampler=0, source=len(self.document.images) - 1))
            self.textures[data] = len(self.document.textures) - 1
        return self.textures[data]

    def _material(self, material: Material) -> int:
        if id(material) in self.materials:
            return self.materials[id(material)]
        self.kept.append(material)
        base = self._texture(material.base_color_texture)
        rough = self._texture(material.metallic_roughness_texture)
        normal = self._texture(material.normal_texture, _NORMAL_QUALITY)
        glow = self._texture(material.emissive_texture)
        extensions: dict[str, Any] = {}
        if material.transmission > 0:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": material.transmission}
        if material.emissive_strength != 1.0:
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": material.emissive_strength}
        for name in extensions:
            if name not in self.document.extensionsUsed:
                self.document.extensionsUsed.append(name)
        self.document.materials.append(
            pygltflib.Material(
                name=material.name,
                pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
                    baseColorFactor=[*material.base_color, 1.0],
                    baseColorTexture=None if base is None else pygltflib.TextureInfo(index=base),
                    metallicFactor=material.metallic,
                    roughnessFactor=material.roughness,
                    metallicRoughnessTexture=None if rough is None else pygltflib.TextureInfo(index=rough),
                ),
                normalTexture=None
                if normal is None
                else pygltflib.NormalMaterialTexture(index=normal, scale=material.normal_scale),
                emissiveFactor=list(material.emissive),
                emissiveTexture=None if glow is None else pygltflib.TextureInfo(index=glow),
                doubleSided=material.double_sided,
                alphaMode=None,
                alphaCutoff=None,
                extensions=extensions,
            )
        )
        self.materials[id(material)] = len(self.document.materials) - 1
        return self.materials[id(material)]


def _any_texture(material: Material) -> Texture | None:
    return (
        material.base_color_texture
        or material.normal_texture
        or material.metallic_roughness_texture
        or material.emissive_texture
    )
