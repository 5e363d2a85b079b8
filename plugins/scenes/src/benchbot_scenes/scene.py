"""A scene in memory: triangles in the map frame, materials, images and object instances."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from benchbot_scenes.splats import Splats

__all__ = ["API_VERSION", "FloatArray", "ImageArray", "Instance", "IntArray", "Material", "SceneGeometry", "Splats"]

API_VERSION = (1, 1)
"""(major, minor) of what this module promises to other distributions: a minor version only adds, with defaults."""

FloatArray = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.int32]
ImageArray = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Instance:
    """One object of the scene; `index` (≥ 1) is its id in instance images, 0 is "nothing hit"."""

    index: int
    name: str
    class_name: str | None
    is_group: bool = False


@dataclass(frozen=True)
class Material:
    """A glTF 2.0 metallic-roughness material; colours linear sRGB, images as indices into `SceneGeometry.images`."""

    name: str = ""
    base_color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    base_color_image: int | None = None
    metallic: float = 0.0
    roughness: float = 1.0
    metallic_roughness_image: int | None = None
    normal_image: int | None = None
    normal_scale: float = 1.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission_image: int | None = None
    transmission: float = 0.0
    refractive_index: float = 1.5
    is_solid: bool = False
    alpha_cutoff: float | None = None
    double_sided: bool = False

    @property
    def is_glass(self) -> bool:
        """True if light passes (KHR_materials_transmission): straight through, or refracted where `is_solid`."""
        return self.transmission > 0.5

    @property
    def is_emissive(self) -> bool:
        """True if its triangles are area lights."""
        return max(self.emission) > 0.0


@dataclass(frozen=True)
class SceneGeometry:
    """Triangles of a scene in the map frame (REP-103/105: metres, z up).

    `vertices` (V, 3), `normals` (V, 3) unit and `uvs` (V, 2) are float32; `triangles` (T, 3), `triangle_instance`
    (T,) (an `Instance.index`) and `triangle_material` (T,) are int32; `images` are (H, W, 4) uint8, row 0 at v = 0.
    Where there are `splats`, they are what the place looks like, and triangles all else that it is.
    """

    vertices: FloatArray
    triangles: IntArray
    triangle_instance: IntArray
    triangle_material: IntArray
    normals: FloatArray
    uvs: FloatArray
    materials: tuple[Material, ...]
    instances: tuple[Instance, ...]
    images: tuple[ImageArray, ...] = field(default=())
    splats: Splats | None = None

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 of everything that can change a picture of its triangles, in hex."""
        digest = hashlib.sha256()
        for array in (*self._arrays(), *self.images):
            digest.update(f"{array.shape}{array.dtype}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        digest.update(repr((self.materials, self.instances)).encode())
        return digest.hexdigest()

    def _arrays(self) -> Iterable[npt.NDArray[np.generic]]:
        return (
            self.vertices,
            self.triangles,
            self.triangle_instance,
            self.triangle_material,
            self.normals,
            self.uvs,
        )


def only(geometry: SceneGeometry, is_kept: npt.NDArray[np.bool_]) -> SceneGeometry:
    """The scene with some of its triangles, and the vertices that these need."""
    triangles = geometry.triangles[is_kept]
    is_used = np.zeros(len(geometry.vertices), bool)
    is_used[triangles] = True
    new = np.cumsum(is_used, dtype=np.int32) - 1
    return replace(
        geometry,
        vertices=geometry.vertices[is_used],
        normals=geometry.normals[is_used],
        uvs=geometry.uvs[is_used],
        triangles=new[triangles].astype(np.int32),
        triangle_instance=geometry.triangle_instance[is_kept],
        triangle_material=geometry.triangle_material[is_kept],
    )


def unit_vectors(vectors: npt.NDArray[np.floating]) -> FloatArray:
    """The vectors (..., 3) with length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: FloatArray = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0).astype(np.float32)
    return unit
