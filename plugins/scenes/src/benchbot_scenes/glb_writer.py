"""Writes glTF 2.0 binary files (Khronos glTF 2.0 specification), from meshes and from parts of other such files."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes import gltf
from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.gltf_file import UnsupportedError, join_glb
from benchbot_scenes.mesh import Mesh

Matrix = npt.NDArray[np.float64]
Entry = dict[str, Any]

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
        """What the node's extras say of the object that it belongs to."""
        return dict((self.entry.get("extras") or {}).get("benchbot") or {})

    @property
    def name(self) -> str:
        """The instance's name, or else the node's own."""
        return str(self.tag.get("instance") or self.entry.get("name") or "")


class GlbWriter:
    """A growing document; what occurs twice, in whichever included file, is written once."""

    def __init__(self) -> None:
        self._lists: dict[str, list[Entry]] = {
            name: [] for name in ("nodes", "meshes", "materials", "textures", "samplers", "images", "accessors")
        }
        self._views: list[Entry] = []
        self._binary = bytearray()
        self._known: dict[tuple[str, str], int] = {}
        self._used: set[str] = set()
        self._required: set[str] = set()

    def material(self, entry: Entry) -> int:
        """Add a material whose textures are those of this document; returns its index."""
        self._used |= set(entry.get("extensions", ()))
        return self._once("materials", entry)

    def mesh(self, parts: Sequence[tuple[Mesh, int]]) -> int:
        """Add a mesh in the map frame, of one primitive per material; returns its index."""
        return self._append("meshes", {"primitives": [self._primitive(mesh, material) for mesh, material in parts]})

    def node(self, name: str, mesh: int, tag: Mapping[str, Any], matrix: Matrix | None = None) -> None:
        """Add a node; `matrix` (4, 4) is in the file's frame (y up), see `to_file_frame`. `tag` goes to its extras."""
        entry: Entry = {"name": name, "mesh": mesh}
        if tag:
            entry["extras"] = {"benchbot": dict(tag)}
        if matrix is not None and not np.array_equal(matrix, np.eye(4)):
            entry["matrix"] = [float(value) for value in matrix.T.ravel()]
        self._append("nodes", entry)

    def include(self, document: Entry, binary: bytes) -> list[MeshNode]:
        """Add the meshes of another file with all that they need, but not its nodes; returns those that show a mesh.

        Raises what `gltf_file.BROKEN` lists when the file is damaged, UnsupportedError for what cannot be taken over.
        """
        self._used |= set(document.get("extensionsUsed", ()))
        self._required |= set(document.get("extensionsRequired", ()))
        return _Inclusion(self, document, binary).nodes()

    def included_material(self, document: Entry, binary: bytes, index: int) -> Entry:
        """A material of another file, its textures taken over, to change and hand to `material`."""
        return _Inclusion(self, document, binary).material(index)

    def to_bytes(self) -> bytes:
        """The finished file."""
        nodes = list(range(len(self._lists["nodes"])))
        document: Entry = {
            "asset": {"version": "2.0", "generator": "benchbot-scenes"},
            "scene": 0,
            "scenes": [{"nodes": nodes}],
            **{name: entries for name, entries in self._lists.items() if entries},
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._binary)}],
        }
        for key, names in (("extensionsUsed", self._used), ("extensionsRequired", self._required)):
            if names:
                document[key] = sorted(names)
        return join_glb(document, self._binary)

    def view(self, data: bytes, properties: Entry) -> int:
        """Add a buffer view of these bytes; returns its index."""
        key = ("bufferViews", hashlib.sha256(data).hexdigest() + repr(sorted(properties.items())))
        if key not in self._known:
            self._binary.extend(bytes(-len(self._binary) % 4))
            self._views.append({"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(data), **properties})
            self._binary.extend(data)
            self._known[key] = len(self._views) - 1
        return self._known[key]

    def _once(self, name: str, entry: Entry) -> int:
        key = (name, json.dumps(entry, sort_keys=True))
        if key not in self._known:
            self._known[key] = self._append(name, entry)
        return self._known[key]

    def _append(self, name: str, entry: Entry) -> int:
        self._lists[name].append(entry)
        return len(self._lists[name]) - 1

    def _primitive(self, mesh: Mesh, material: int) -> Entry:
        positions = (mesh.vertices @ Y_UP_TO_Z_UP).astype("<f4")
        bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
        normals = (mesh.normals @ Y_UP_TO_Z_UP).astype("<f4")
        attributes = {"POSITION": self._floats(positions, "VEC3", bounds), "NORMAL": self._floats(normals, "VEC3", {})}
        attributes["TEXCOORD_0"] = self._floats(mesh.uvs.astype("<f4"), "VEC2", {})
        view = self.view(mesh.triangles.astype("<u4").tobytes(), {})
        accessor = {"bufferView": view, "componentType": 5125, "count": mesh.triangles.size, "type": "SCALAR"}
        return {"attributes": attributes, "indices": self._once("accessors", accessor), "material": material}

    def _floats(self, values: npt.NDArray[np.float32], kind: str, bounds: Entry) -> int:
        view = self.view(values.tobytes(), {})
        accessor = {"bufferView": view, "componentType": 5126, "count": len(values), "type": kind, **bounds}
        return self._once("accessors", accessor)


def to_file_frame(matrix: Matrix) -> Matrix:
    """A transform (4, 4) of the map frame (z up) as one of the file's frame (y up)."""
    turned: Matrix = _TO_FILE @ matrix @ _TO_FILE.T
    return turned


class _Inclusion:
    """One file on its way into a writer."""

    def __init__(self, writer: GlbWriter, document: Entry, binary: bytes) -> None:
        self._writer = writer
        self._document = document
        self._binary = binary
        self._meshes: dict[int, int] = {}

    def nodes(self) -> list[MeshNode]:
        return [
            MeshNode(self._mesh(entry["mesh"]), matrix, entry, path)
            for entry, matrix, path in gltf.nodes(self._document)
            if "mesh" in entry
        ]

    def material(self, index: int) -> Entry:
        taken: Entry = self._with_textures(self._document["materials"][index])
        return taken

    def _mesh(self, index: int) -> int:
        if index not in self._meshes:
            primitives = [self._primitive(entry) for entry in self._document["meshes"][index]["primitives"]]
            self._meshes[index] = self._writer._append("meshes", {"primitives": primitives})
        return self._meshes[index]

    def _primitive(self, entry: Entry) -> Entry:
        attributes = {name: self._accessor(index) for name, index in entry["attributes"].items()}
        taken: Entry = {"attributes": attributes, "mode": entry.get("mode", 4)}
        if "indices" in entry:
            taken["indices"] = self._accessor(entry["indices"])
        if "material" in entry:
            taken["material"] = self._writer.material(self.material(entry["material"]))
        return taken

    def _accessor(self, index: int) -> int:
        entry = dict(self._document["accessors"][index])
        if "sparse" in entry:
            raise UnsupportedError("It has sparse accessors, which cannot be taken over.")
        if "bufferView" in entry:
            entry["bufferView"] = self._view(entry["bufferView"])
        return self._writer._once("accessors", entry)

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
            entry["sampler"] = self._writer._once("samplers", self._document["samplers"][entry["sampler"]])
        return self._writer._once("textures", entry)

    def _image(self, index: int) -> int:
        entry = self._document["images"][index]
        if "bufferView" not in entry:
            raise UnsupportedError("Its images are not within the file itself.")
        return self._writer._once("images", {**entry, "bufferView": self._view(entry["bufferView"])})
