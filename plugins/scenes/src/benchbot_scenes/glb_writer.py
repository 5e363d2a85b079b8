"""Writing glTF 2.0 binary files (Khronos glTF 2.0 specification) from meshes and from parts of other such files."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes import gltf
from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.gltf_file import UnsupportedError, join_glb
from benchbot_scenes.gltf_splats import is_splats
from benchbot_scenes.mesh import Mesh

Matrix = npt.NDArray[np.float64]
Entry = dict[str, Any]

Change = Callable[[int, Entry, Callable[[Entry], Entry]], Entry | None]
"""Makes another material of one of a file being taken over: of its number, its entry, and a function that takes over
the textures that an entry refers to. None leaves it as it is.
"""

VERTICES, INDICES = 34962, 34963
"""Targets of buffer views (glTF: ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER)."""
_COMPONENT_TYPES = {"<f4": 5126, "<i2": 5122, "<u2": 5123, "<u4": 5125}
_TO_FILE = np.eye(4)
_TO_FILE[:3, :3] = Y_UP_TO_Z_UP.T


@dataclass(frozen=True)
class MeshNode:
    """A node of an included file: its mesh in the file being written, its world matrix (y up), its own entry, and the
    names that lead to it.
    """

    mesh: int
    matrix: Matrix
    entry: Entry
    path: tuple[str, ...]

    @property
    def tag(self) -> Entry:
        """The tag of the node's object, in its extras."""
        return dict((self.entry.get("extras") or {}).get("benchbot") or {})

    @property
    def name(self) -> str:
        """The instance's name, or else the node's own."""
        return str(self.tag.get("instance") or self.entry.get("name") or "")


class GlbWriter:
    """A growing glTF document and its binary chunk.

    With `deduplicates`, equal materials, images and accessors are written once, whichever file they come from.
    """

    def __init__(self, generator: str = "benchbot-scenes", *, deduplicates: bool = True) -> None:
        self._generator = generator
        self._deduplicates = deduplicates
        self._lists: dict[str, list[Entry]] = {}
        self._binary = bytearray()
        self._known: dict[tuple[str, str | None], int] = {}
        self._used: dict[str, None] = {}
        self._required: dict[str, None] = {}

    def material(self, entry: Entry) -> int:
        """Add a material whose textures are those of this document; returns its index."""
        self._used |= dict.fromkeys(entry.get("extensions", ()))
        return self.append("materials", entry)

    def mesh(self, parts: Sequence[tuple[Mesh, int]]) -> int:
        """Add a mesh in the map frame, of one primitive per material; returns its index."""
        return self.append("meshes", {"primitives": [self._primitive(mesh, material) for mesh, material in parts]})

    def node(self, name: str, mesh: int, tag: Mapping[str, Any], matrix: Matrix | None = None) -> None:
        """Add a node; `matrix` (4, 4) is in the file's frame (y up), see `to_file_frame`. `tag` goes to its extras."""
        entry: Entry = {"extras": {"benchbot": dict(tag)}} if tag else {}
        entry |= {"mesh": mesh, "name": name}
        if matrix is not None and not np.array_equal(matrix, np.eye(4)):
            entry["matrix"] = [float(value) for value in matrix.T.ravel()]
        self.append("nodes", entry)

    def use(self, extension: str) -> None:
        """List an extension among those that the file uses."""
        self._used[extension] = None

    def include(self, document: Entry, binary: bytes) -> list[MeshNode]:
        """Add the meshes of another file with all that they need, but not its nodes; returns those that show a mesh.

        Raises what `gltf_file.BROKEN` lists when the file is damaged, UnsupportedError for what cannot be taken over.
        """
        return self.inclusion(document, binary).nodes()

    def inclusion(self, document: Entry, binary: bytes) -> "Inclusion":
        """Another file to take over several times, with other materials each time."""
        self._used |= dict.fromkeys(document.get("extensionsUsed", ()))
        self._required |= dict.fromkeys(document.get("extensionsRequired", ()))
        return Inclusion(self, document, binary)

    def included_material(self, document: Entry, binary: bytes, index: int) -> Entry:
        """A material of another file, its textures taken over, to change and hand to `material`."""
        return Inclusion(self, document, binary).material(index)

    def to_bytes(self) -> bytes:
        """The finished file, its keys sorted."""
        nodes = list(range(len(self._lists.get("nodes", ()))))
        self._binary.extend(bytes(-len(self._binary) % 4))
        document: Entry = {
            "asset": {"generator": self._generator, "version": "2.0"},
            "scene": 0,
            "buffers": [{"byteLength": len(self._binary)}],
            **self._lists,
            **({"scenes": [{"nodes": nodes}]} if nodes else {}),
            **({"extensionsUsed": list(self._used)} if self._used else {}),
            **({"extensionsRequired": list(self._required)} if self._required else {}),
        }
        return join_glb(dict(sorted(document.items())), self._binary)

    def view(self, data: bytes, properties: Mapping[str, Any] = MappingProxyType({})) -> int:
        """Add a buffer view of these bytes; returns its index."""
        key = hashlib.sha256(data).hexdigest() + repr(sorted(properties.items())) if self._deduplicates else None
        if ("bufferViews", key) in self._known:
            return self._known["bufferViews", key]
        self._binary.extend(bytes(-len(self._binary) % 4))
        entry = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(data), **properties}
        self._binary.extend(data)
        return self._add("bufferViews", entry, key)

    def append(self, name: str, entry: Entry) -> int:
        """Add an entry to a list of the document, such as `textures`; returns its index."""
        may_share = self._deduplicates and name not in ("meshes", "nodes")
        key = json.dumps(entry, sort_keys=True) if may_share else None
        return self._known[name, key] if (name, key) in self._known else self._add(name, entry, key)

    def accessor(
        self,
        values: npt.NDArray[Any],
        target: int | None = None,
        *,
        has_bounds: bool = False,
        is_normalized: bool = False,
    ) -> int:
        """Add numbers (N, 2 … 4) or (N,), float32 or integers, which are shares if `is_normalized`.

        Returns their accessor's index.
        """
        entry: Entry = {
            "bufferView": self.view(values.tobytes(), {"target": target} if target else {}),
            "byteOffset": 0,
            "componentType": _COMPONENT_TYPES[values.dtype.str],
            "normalized": is_normalized,
            "count": len(values),
            "type": "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}",
        }
        if has_bounds:
            entry |= {"max": values.max(axis=0).tolist(), "min": values.min(axis=0).tolist()}
        return self.append("accessors", entry)

    def _add(self, name: str, entry: Entry, key: str | None) -> int:
        entries = self._lists.setdefault(name, [])
        entries.append(entry)
        if key is not None:
            self._known[name, key] = len(entries) - 1
        return len(entries) - 1

    def _primitive(self, mesh: Mesh, material: int) -> Entry:
        attributes = {
            "POSITION": self.accessor((mesh.vertices @ Y_UP_TO_Z_UP).astype("<f4"), has_bounds=True),
            "NORMAL": self.accessor((mesh.normals @ Y_UP_TO_Z_UP).astype("<f4")),
            "TEXCOORD_0": self.accessor(mesh.uvs.astype("<f4")),
        }
        indices = self.accessor(mesh.triangles.astype("<u4").ravel())
        return {"attributes": attributes, "indices": indices, "material": material}


def to_file_frame(matrix: Matrix) -> Matrix:
    """A transform (4, 4) of the map frame (z up) as one of the file's frame (y up)."""
    turned: Matrix = _TO_FILE @ matrix @ _TO_FILE.T
    return turned


class Inclusion:
    """One file on its way into a writer; what was taken over before is not read again."""

    def __init__(self, writer: GlbWriter, document: Entry, binary: bytes) -> None:
        self._writer = writer
        self._document = document
        self._binary = binary
        self._geometry: dict[tuple[int, int], Entry] = {}
        self._materials: dict[int, Entry] = {}

    def nodes(self, change: Change | None = None) -> list[MeshNode]:
        """The nodes that show a mesh, with the file's materials, or with what `change` makes of them."""
        meshes: dict[int, int] = {}
        return [
            MeshNode(self._mesh(entry["mesh"], meshes, change), matrix, entry, path)
            for entry, matrix, path in gltf.nodes(self._document)
            if "mesh" in entry
        ]

    def material(self, index: int) -> Entry:
        """A material with its textures taken over."""
        if index not in self._materials:
            self._materials[index] = self._with_textures(self._document["materials"][index])
        return self._materials[index]

    def _mesh(self, index: int, meshes: dict[int, int], change: Change | None) -> int:
        if index not in meshes:
            primitives = []
            for number, entry in enumerate(self._document["meshes"][index]["primitives"]):
                if (index, number) not in self._geometry:
                    self._geometry[index, number] = self._primitive(entry)
                taken = dict(self._geometry[index, number])
                if "material" in entry:
                    material = entry["material"]
                    changed = change and change(material, self._document["materials"][material], self._with_textures)
                    taken["material"] = self._writer.material(changed or self.material(material))
                primitives.append(taken)
            meshes[index] = self._writer.append("meshes", {"primitives": primitives})
        return meshes[index]

    def _primitive(self, entry: Entry) -> Entry:
        attributes = {name: self._accessor(index) for name, index in entry["attributes"].items()}
        taken: Entry = {"attributes": attributes, "mode": entry.get("mode", 4)}
        if "indices" in entry:
            taken["indices"] = self._accessor(entry["indices"])
        if is_splats(entry):  # splats, which hold no reference but attributes
            taken["extensions"] = entry["extensions"]
        return taken

    def _accessor(self, index: int) -> int:
        entry = dict(self._document["accessors"][index])
        if "sparse" in entry:
            raise UnsupportedError("It has sparse accessors, which cannot be taken over.")
        if "bufferView" in entry:
            entry["bufferView"] = self._view(entry["bufferView"])
        return self._writer.append("accessors", entry)

    def _view(self, index: int) -> int:
        entry = self._document["bufferViews"][index]
        if self._document["buffers"][entry["buffer"]].get("uri") is not None:
            raise UnsupportedError("Its data is not within the file itself.")
        start = entry.get("byteOffset", 0)
        data = self._binary[start : start + entry["byteLength"]]
        if len(data) < entry["byteLength"]:
            raise ValueError("a buffer view reaches past the end of the file")
        properties = {name: entry[name] for name in ("byteStride", "target") if name in entry}
        return self._writer.view(data, properties)

    def _with_textures(self, value: Any, name: str = "") -> Any:
        """A material's entry with every reference to a texture as the writer counts them."""
        if isinstance(value, dict):
            taken = {key: self._with_textures(part, key) for key, part in value.items()}
            return {**taken, "index": self._texture(value["index"])} if name.endswith("Texture") else taken
        return value

    def _texture(self, index: int) -> int:
        entry = dict(self._document["textures"][index])
        if "source" in entry:
            entry["source"] = self._image(entry["source"])
        if "extensions" in entry:  # an image in another coding, as EXT_texture_webp has it
            entry["extensions"] = {
                name: {**extension, "source": self._image(extension["source"])} if "source" in extension else extension
                for name, extension in entry["extensions"].items()
            }
        if "sampler" in entry:
            entry["sampler"] = self._writer.append("samplers", self._document["samplers"][entry["sampler"]])
        return self._writer.append("textures", entry)

    def _image(self, index: int) -> int:
        entry = self._document["images"][index]
        if "bufferView" not in entry:
            raise UnsupportedError("Its images are not within the file itself.")
        return self._writer.append("images", {**entry, "bufferView": self._view(entry["bufferView"])})
