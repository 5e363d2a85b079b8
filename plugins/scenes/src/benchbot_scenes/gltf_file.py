"""Parts of a glTF 2.0 file: its JSON document, buffers, accessors and images (Khronos glTF 2.0 specification)."""

import base64
import binascii
import io
import json
import struct
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from benchbot_scenes.scene import FloatArray, ImageArray

_COMPONENT_TYPES: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_SUPPORTED_EXTENSIONS = {
    "EXT_texture_webp",
    "KHR_gaussian_splatting",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
}
_COMPRESSION = {
    "KHR_draco_mesh_compression": "Draco compression",
    "EXT_meshopt_compression": "meshopt compression",
    "KHR_meshopt_compression": "meshopt compression",
    "KHR_texture_basisu": "Basis Universal (KTX 2) textures",
}


class UnsupportedError(Exception):
    """An error of a valid file that needs an unsupported feature."""


BROKEN = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    OverflowError,
    struct.error,
    RecursionError,
    OSError,
    UnidentifiedImageError,
    Image.DecompressionBombError,
)
"""The exceptions that reading a damaged file may raise."""


def split_glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON document and the binary chunk of a GLB container."""
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != b"glTF" or version != 2:
        raise ValueError("the file does not start like binary glTF 2.0")
    if length > len(data):
        raise ValueError(f"the file should have {length} bytes but ends after {len(data)}")
    document, binary = None, b""
    position = 12
    while position + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, position)
        chunk = data[position + 8 : position + 8 + size]
        if kind == b"JSON":
            document = json.loads(chunk)
        elif kind == b"BIN\0":
            binary = chunk
        position += 8 + size
    if not isinstance(document, dict):
        raise ValueError("the file has no JSON chunk")  # noqa: TRY004 - a broken file, not a programming error
    return document, binary


def join_glb(document: Mapping[str, Any], binary: bytes | bytearray) -> bytes:
    """A GLB container of a JSON document and a binary chunk, each padded to four bytes."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    padding = bytes(-len(binary) % 4)
    size = len(binary) + len(padding)
    header = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + size)
    return b"".join(
        (header, struct.pack("<I4s", len(text), b"JSON"), text, struct.pack("<I4s", size, b"BIN\0"), binary, padding)
    )


def refuse_other_files(uri: str) -> bytes:
    """Refuse to read another file: a scene must hold everything itself."""
    raise UnsupportedError(f"It refers to another file ({uri}); a scene must hold everything itself.")


class GltfFile:
    """A document with its binary chunk; `read_beside` gives the bytes of the other files that it refers to."""

    def __init__(
        self, document: dict[str, Any], binary: bytes, read_beside: Callable[[str], bytes] = refuse_other_files
    ) -> None:
        self.document = document
        self._binary = binary
        self._read_beside = read_beside
        self._buffers: dict[int, bytes] = {}
        for extension in document.get("extensionsRequired", []):
            if extension in _COMPRESSION:
                raise UnsupportedError(
                    f"It has {_COMPRESSION[extension]} ({extension}). Export it without compression, "
                    "or undo it: gltf-transform copy IN.glb OUT.glb"
                )
            if extension not in _SUPPORTED_EXTENSIONS:
                raise UnsupportedError(f"It requires the glTF extension {extension}, which is not supported.")

    def accessor(self, index: int) -> npt.NDArray[Any]:
        """(count, components) numbers; normalised integers as float32 in [-1, 1] or [0, 1]."""
        accessor = self.document["accessors"][index]
        dtype = _COMPONENT_TYPES[accessor["componentType"]]
        components = _COMPONENTS[accessor["type"]]
        count = int(accessor["count"])
        if "bufferView" in accessor:
            values = self._values(accessor, dtype, count, components)
        else:
            values = np.zeros((count, components), dtype)
        if "sparse" in accessor:
            values = self._with_exceptions(values, accessor["sparse"], dtype)
        if accessor.get("normalized"):
            scaled: FloatArray = np.maximum(values.astype(np.float32) / np.float32(np.iinfo(dtype).max), -1.0)
            return scaled
        return values

    def _values(self, place: dict[str, Any], dtype: np.dtype[Any], count: int, components: int) -> npt.NDArray[Any]:
        view = self.document["bufferViews"][place["bufferView"]]
        stride = view.get("byteStride", 0) or dtype.itemsize * components
        start = view.get("byteOffset", 0) + place.get("byteOffset", 0)
        return np.ndarray((count, components), dtype, self._buffer(view["buffer"]), start, (stride, dtype.itemsize))

    def _with_exceptions(
        self, values: npt.NDArray[Any], sparse: dict[str, Any], dtype: np.dtype[Any]
    ) -> npt.NDArray[Any]:
        count = int(sparse["count"])
        where = self._values(sparse["indices"], _COMPONENT_TYPES[sparse["indices"]["componentType"]], count, 1)
        changed = values.copy()
        changed[where[:, 0]] = self._values(sparse["values"], dtype, count, values.shape[1])
        return changed

    def _buffer(self, index: int) -> bytes:
        uri = self.document["buffers"][index].get("uri")
        if uri is None:
            return self._binary
        if index not in self._buffers:
            self._buffers[index] = self._of_uri(uri)
        return self._buffers[index]

    def image(self, entry: dict[str, Any]) -> ImageArray:
        """(H, W, 4) uint8 of an entry of the document's images."""
        if "bufferView" in entry:
            view = self.document["bufferViews"][entry["bufferView"]]
            start = view.get("byteOffset", 0)
            encoded = self._buffer(view["buffer"])[start : start + view["byteLength"]]
        else:
            encoded = self._of_uri(entry["uri"])
        with Image.open(io.BytesIO(encoded)) as image:
            return np.asarray(image.convert("RGBA"))

    def _of_uri(self, uri: str) -> bytes:
        if not uri.startswith("data:"):
            return self._read_beside(uri)
        try:
            return base64.b64decode(uri.partition(",")[2], validate=True)
        except binascii.Error as error:
            raise ValueError("a data URI is not base64") from error
