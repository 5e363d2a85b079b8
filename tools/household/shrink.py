"""Makes a GLB small without visible harm: quantised vertices, recoded pictures, nothing that is not used.

Positions become 16-bit, normals 8-bit and texture coordinates 16-bit integers (glTF extension KHR_mesh_quantization);
the mesh's node takes the scale and offset that undo it. A picture of one colour becomes a factor of its material.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pygltflib
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float64]

_QUANTIZATION = "KHR_mesh_quantization"
_POSITION_STEPS, _NORMAL_STEPS, _UV_STEPS = 32767, 127, 65535
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_DTYPES: dict[int, type[np.number[Any]]] = {
    pygltflib.BYTE: np.int8,
    pygltflib.UNSIGNED_BYTE: np.uint8,
    pygltflib.SHORT: np.int16,
    pygltflib.UNSIGNED_SHORT: np.uint16,
    pygltflib.UNSIGNED_INT: np.uint32,
    pygltflib.FLOAT: np.float32,
}
_COMPONENT_TYPES = {np.dtype(dtype): component_type for component_type, dtype in _DTYPES.items()}
_UNIFORM_TOLERANCE = 3


def shrink(glb: bytes, *, texture_px: int = 512, detail_px: int = 512, quality: int = 85) -> bytes:
    """The same model in fewer bytes, and the same bytes for the same model.

    Every vertex stays within 1/65000 of its mesh's longest side, every normal within half a degree; the triangles stay
    all. Pictures become JPEG of `quality` with at most `texture_px` pixels a side (those of normals and roughness
    `detail_px`), unless they are see-through or were smaller before. Cameras, animations, tangents, vertex colours and
    whatever no node uses are dropped.
    Raises ValueError for what is no GLB, for sparse accessors and for pictures outside the file.
    """
    if glb[:4] != b"glTF":
        raise ValueError("this is not binary glTF")
    source = pygltflib.GLTF2.load_from_bytes(glb)
    target = _Target()
    document = target.document
    document.asset, document.extensionsUsed = source.asset, list(source.extensionsUsed)
    document.nodes, document.scenes, document.scene = source.nodes, source.scenes, source.scene
    used_meshes = sorted({node.mesh for node in source.nodes if node.mesh is not None})
    boxes = {mesh: _quantise_mesh(source, target, source.meshes[mesh]) for mesh in used_meshes}
    for node in list(document.nodes):
        node.camera = node.skin = None
        if node.mesh is not None:
            _undo_quantisation(document, node, *boxes[node.mesh])
            mesh_node = document.nodes[node.children[-1]] if node.mesh is None and node.children else node
            mesh_node.mesh = used_meshes.index(mesh_node.mesh)
    _Materials(source, target, texture_px, detail_px, quality).copy_used()
    document.extensionsUsed = sorted({*document.extensionsUsed, _QUANTIZATION} & _extensions(document))
    document.extensionsRequired = [_QUANTIZATION]
    document.buffers = [pygltflib.Buffer(byteLength=len(target.blob))]
    document.set_binary_blob(bytes(target.blob))
    return b"".join(document.save_to_bytes())


@dataclass
class _Target:
    """The document that grows, and its binary chunk."""

    document: pygltflib.GLTF2 = field(default_factory=pygltflib.GLTF2)
    blob: bytearray = field(default_factory=bytearray)

    def view(self, data: bytes, target: int | None = None, stride: int | None = None) -> int:
        self.blob.extend(bytes(-len(self.blob) % 4))
        self.document.bufferViews.append(
            pygltflib.BufferView(
                buffer=0, byteOffset=len(self.blob), byteLength=len(data), byteStride=stride, target=target
            )
        )
        self.blob.extend(data)
        self.blob.extend(bytes(-len(self.blob) % 4))
        return len(self.document.bufferViews) - 1

    def attribute(self, values: NDArray[Any], *, normalized: bool, with_bounds: bool = False) -> int:
        """An accessor of one value per vertex, each starting at a multiple of four bytes, as glTF demands."""
        width = values.shape[1] * values.itemsize
        stride = width + -width % 4
        rows = np.zeros((len(values), stride), np.uint8)
        rows[:, :width] = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), width)
        self.document.accessors.append(
            pygltflib.Accessor(
                bufferView=self.view(rows.tobytes(), pygltflib.ARRAY_BUFFER, stride),
                componentType=_COMPONENT_TYPES[values.dtype],
                normalized=normalized,
                count=len(values),
                type=f"VEC{values.shape[1]}",
                min=values.min(axis=0).tolist() if with_bounds else None,
                max=values.max(axis=0).tolist() if with_bounds else None,
            )
        )
        return len(self.document.accessors) - 1

    def indices(self, triangles: NDArray[Any]) -> int:
        dtype = np.uint16 if triangles.max() < 65535 else np.uint32
        self.document.accessors.append(
            pygltflib.Accessor(
                bufferView=self.view(triangles.astype(dtype).tobytes(), pygltflib.ELEMENT_ARRAY_BUFFER),
                componentType=_COMPONENT_TYPES[np.dtype(dtype)],
                count=triangles.size,
                type="SCALAR",
            )
        )
        return len(self.document.accessors) - 1


def _read(source: pygltflib.GLTF2, index: int) -> Floats:
    """An accessor's values, (count, components)."""
    accessor = source.accessors[index]
    if accessor.bufferView is None or accessor.sparse is not None:
        raise ValueError("sparse accessors are not supported")
    view = source.bufferViews[accessor.bufferView]
    dtype = np.dtype(_DTYPES[accessor.componentType])
    width = _COMPONENTS[accessor.type]
    stride = view.byteStride or width * dtype.itemsize
    start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    values = np.ndarray((accessor.count, width), dtype, source.binary_blob(), start, (stride, dtype.itemsize))
    floats = values.astype(np.float64)
    return np.maximum(floats / float(np.iinfo(dtype.name).max), -1.0) if accessor.normalized else floats


def _quantise_mesh(source: pygltflib.GLTF2, target: _Target, mesh: pygltflib.Mesh) -> tuple[Floats, float]:
    """Append the mesh; the centre and scale that bring its vertices back."""
    positions = [_read(source, primitive.attributes.POSITION) for primitive in mesh.primitives]
    everything = np.concatenate(positions)
    low, high = everything.min(axis=0), everything.max(axis=0)
    centre, scale = (low + high) / 2, float(max((high - low).max() / 2, 1e-9))
    primitives = []
    for primitive, position in zip(mesh.primitives, positions, strict=True):
        columns = [_steps((position - centre) / scale, _POSITION_STEPS, np.int16)]
        given = primitive.attributes
        if given.NORMAL is not None:
            columns.append(_steps(_read(source, given.NORMAL), _NORMAL_STEPS, np.int8))
        if given.TEXCOORD_0 is not None:
            columns.append(_texture_coordinates(_read(source, given.TEXCOORD_0)))
        if primitive.indices is None:
            triangles = np.arange(len(position))
        else:
            triangles = _read(source, primitive.indices).ravel().astype(np.int64)
        columns, triangles = _weld(columns, triangles)
        attributes = pygltflib.Attributes(POSITION=target.attribute(columns[0], normalized=True, with_bounds=True))
        if given.NORMAL is not None:
            attributes.NORMAL = target.attribute(columns[1], normalized=True)
        if given.TEXCOORD_0 is not None:
            attributes.TEXCOORD_0 = target.attribute(columns[-1], normalized=columns[-1].dtype != np.float32)
        primitives.append(
            pygltflib.Primitive(attributes=attributes, indices=target.indices(triangles), material=primitive.material)
        )
    target.document.meshes.append(pygltflib.Mesh(name=mesh.name, primitives=primitives))
    return centre, scale


def _steps(values: Floats, steps: int, dtype: type[np.integer[Any]]) -> NDArray[Any]:
    rounded: NDArray[Any] = np.clip(np.rint(values * steps), -steps, steps).astype(dtype)
    return rounded


def _texture_coordinates(uvs: Floats) -> NDArray[Any]:
    """In 16 bits where they fit the picture once; a repeating texture keeps floats, moved close to the origin."""
    if uvs.min() >= -1e-6 and uvs.max() <= 1 + 1e-6:
        steps: NDArray[Any] = np.clip(np.rint(uvs * _UV_STEPS), 0, _UV_STEPS).astype(np.uint16)
        return steps
    moved: NDArray[Any] = (uvs - np.floor(uvs.min(axis=0))).astype(np.float32)
    return moved


def _weld(columns: list[NDArray[Any]], triangles: NDArray[Any]) -> tuple[list[NDArray[Any]], NDArray[Any]]:
    """Vertices that are equal in everything become one, in the order of their first use."""
    rows = np.concatenate(
        [np.ascontiguousarray(column).view(np.uint8).reshape(len(column), -1) for column in columns], axis=1
    )
    corners = rows[triangles]
    _, first, inverse = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return [column[triangles[first[order]]] for column in columns], rank[inverse.ravel()]


def _undo_quantisation(document: pygltflib.GLTF2, node: pygltflib.Node, centre: Floats, scale: float) -> None:
    """Give the node the mesh's scale and offset; its children must not feel them, so a parent's mesh gets a node."""
    if node.children:
        child = pygltflib.Node(name=node.name, mesh=node.mesh, extras=node.extras)
        node.mesh, node.extras = None, {}
        document.nodes.append(child)
        node.children.append(len(document.nodes) - 1)
        node = child
    if node.matrix is not None:
        matrix = np.array(node.matrix, np.float64).reshape(4, 4).T
        matrix = matrix @ np.block([[np.eye(3) * scale, centre[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])
        node.matrix = matrix.T.ravel().tolist()
        return
    node_scale = np.array(node.scale or [1.0, 1.0, 1.0])
    node.translation = (np.array(node.translation or [0.0, 0.0, 0.0]) + _rotate(node, node_scale * centre)).tolist()
    node.scale = (node_scale * scale).tolist()


def _rotate(node: pygltflib.Node, vector: Floats) -> Floats:
    x, y, z, w = node.rotation or [0.0, 0.0, 0.0, 1.0]
    axis = np.array([x, y, z])
    turned: Floats = vector + 2.0 * np.cross(axis, np.cross(axis, vector) + w * vector)
    return turned


@dataclass
class _Materials:
    """Copies the materials that the target's meshes name, and the pictures that these need."""

    source: pygltflib.GLTF2
    target: _Target
    texture_px: int
    detail_px: int
    quality: int
    textures: dict[tuple[int, bool], int] = field(default_factory=dict)

    def copy_used(self) -> None:
        document = self.target.document
        primitives = [primitive for mesh in document.meshes for primitive in mesh.primitives]
        used = sorted({primitive.material for primitive in primitives if primitive.material is not None})
        for primitive in primitives:
            primitive.material = None if primitive.material is None else used.index(primitive.material)
        document.materials = [self._material(self.source.materials[index]) for index in used]
        if document.textures:
            document.samplers = [pygltflib.Sampler(wrapS=pygltflib.REPEAT, wrapT=pygltflib.REPEAT)]

    def _material(self, material: pygltflib.Material) -> pygltflib.Material:
        surface = material.pbrMetallicRoughness
        see_through = material.alphaMode in ("MASK", "BLEND")
        if surface is not None:
            colour = self._uniform(surface.baseColorTexture)
            if colour is not None and not see_through:
                red, green, blue, alpha = surface.baseColorFactor or [1.0, 1.0, 1.0, 1.0]
                linear = _linear(colour)
                surface.baseColorFactor = [red * linear[0], green * linear[1], blue * linear[2], alpha]
                surface.baseColorTexture = None
            rough = self._uniform(surface.metallicRoughnessTexture)
            if rough is not None:
                surface.roughnessFactor = _or_one(surface.roughnessFactor) * float(rough[1])
                surface.metallicFactor = _or_one(surface.metallicFactor) * float(rough[2])
                surface.metallicRoughnessTexture = None
            surface.baseColorTexture = self._texture(surface.baseColorTexture, keeps_alpha=see_through)
            surface.metallicRoughnessTexture = self._texture(surface.metallicRoughnessTexture, is_detail=True)
        if self._uniform(material.normalTexture) is not None:
            material.normalTexture = None
        material.normalTexture = self._texture(material.normalTexture, is_detail=True)
        material.emissiveTexture = self._texture(material.emissiveTexture)
        material.occlusionTexture = None
        return material

    def _picture(self, texture: int) -> bytes:
        image = self.source.images[self.source.textures[texture].source]
        if image.bufferView is None:
            raise ValueError("a picture lies outside the file")
        view = self.source.bufferViews[image.bufferView]
        start = view.byteOffset or 0
        data: bytes = self.source.binary_blob()[start : start + view.byteLength]
        return data

    def _uniform(self, reference: Any) -> Floats | None:
        """The one colour (0..1, RGB) of a texture, None where it has several or there is none."""
        if reference is None:
            return None
        with Image.open(io.BytesIO(self._picture(reference.index))) as image:
            pixels = np.asarray(image.convert("RGB"), np.float64).reshape(-1, 3)
        low, high = np.percentile(pixels, 0.5, axis=0), np.percentile(pixels, 99.5, axis=0)
        return None if (high - low).max() > _UNIFORM_TOLERANCE else np.median(pixels, axis=0) / 255.0

    def _texture(self, reference: Any, *, keeps_alpha: bool = False, is_detail: bool = False) -> Any:
        """The same reference, to the picture's smaller copy."""
        if reference is None:
            return None
        key = (self.source.textures[reference.index].source, keeps_alpha)
        if key not in self.textures:
            most_px = self.detail_px if is_detail else self.texture_px
            data, mime = recode(self._picture(reference.index), most_px, self.quality, keeps_alpha)
            document = self.target.document
            document.images.append(pygltflib.Image(bufferView=self.target.view(data), mimeType=mime))
            document.textures.append(pygltflib.Texture(sampler=0, source=len(document.images) - 1))
            self.textures[key] = len(document.textures) - 1
        reference.index, reference.texCoord = self.textures[key], 0
        return reference


def recode(data: bytes, texture_px: int, quality: int, keeps_alpha: bool = False) -> tuple[bytes, str]:
    """A picture of at most `texture_px` a side, as JPEG or, where `keeps_alpha`, PNG; and its MIME type.

    What is small enough already and would not shrink stays as it is.
    """
    with Image.open(io.BytesIO(data)) as opened:
        kind = opened.format
        image = opened.convert("RGBA" if keeps_alpha else "RGB")
    was_small = max(image.size) <= texture_px
    image.thumbnail((texture_px, texture_px), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    if keeps_alpha:
        image.save(stream, "PNG", optimize=True)
    else:
        image.save(stream, "JPEG", quality=quality, optimize=True)
    recoded, mime = stream.getvalue(), "image/png" if keeps_alpha else "image/jpeg"
    if was_small and kind in ("PNG", "JPEG") and len(data) <= len(recoded):
        return data, f"image/{kind.lower()}"
    return recoded, mime


def _linear(colour: Floats) -> Floats:
    """sRGB (IEC 61966-2-1) to linear."""
    linear: Floats = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    return linear


def _or_one(factor: float | None) -> float:
    return 1.0 if factor is None else factor


def _extensions(document: pygltflib.GLTF2) -> set[str]:
    """The names of the extensions that the materials really use, and the meshes' quantisation."""
    names = {_QUANTIZATION}
    for material in document.materials:
        names |= set(material.extensions or {})
    return names
