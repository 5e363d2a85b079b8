"""The parts of a model: meshes with materials, in metres, z up, with texture coordinates in metres."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int32]
Color: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Texture:
    """A tileable image and the size of the real thing that it shows.

    `image` is (H, W, 3) or (H, W, 4) uint8, row 0 at the top; base colours in sRGB, normals in the glTF
    convention (+y up).
    """

    image: NDArray[np.uint8]
    width_m: float
    height_m: float


@dataclass(frozen=True, eq=False)
class Material:
    """A metallic-roughness surface, as glTF 2.0 defines it. Colours are linear sRGB factors.

    A texture's colour is multiplied by `base_color`. All textures of a material cover the same metres.
    """

    name: str
    base_color: Color = (1.0, 1.0, 1.0)
    base_color_texture: Texture | None = None
    roughness: float = 0.6
    metallic: float = 0.0
    metallic_roughness_texture: Texture | None = None
    normal_texture: Texture | None = None
    normal_scale: float = 1.0
    emissive: Color = (0.0, 0.0, 0.0)
    emissive_strength: float = 1.0
    emissive_texture: Texture | None = None
    transmission: float = 0.0
    double_sided: bool = False


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: `vertices` (N, 3) metres, `triangles` (M, 3) counter-clockwise from outside, unit
    `normals` (N, 3), `uvs` (N, 2) in metres with u to the right and v up.
    """

    vertices: Floats
    triangles: Ints
    normals: Floats
    uvs: Floats


@dataclass(frozen=True, eq=False)
class Part:
    """A mesh of one material."""

    mesh: Mesh
    material: Material


Model: TypeAlias = tuple[Part, ...]


@dataclass(frozen=True, eq=False)
class SceneObject:
    """One node of the scene: `category` is the ground-truth class, or None for structure and decoration.

    `on_wall` marks what is fixed to a wall or the ceiling and so need not stand on anything.
    """

    instance: str
    model: Model
    category: str | None = None
    is_group: bool = False
    on_wall: bool = False


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """Join meshes into one."""
    parts = list(meshes)
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in parts[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in parts]),
        np.concatenate([mesh.triangles + offset for mesh, offset in zip(parts, offsets, strict=True)], dtype=np.int32),
        np.concatenate([mesh.normals for mesh in parts]),
        np.concatenate([mesh.uvs for mesh in parts]),
    )


def compact(model: Model) -> Model:
    """Join the parts that share a material (by identity), in order of first use."""
    groups: dict[int, list[Part]] = {}
    for part in model:
        groups.setdefault(id(part.material), []).append(part)
    return tuple(Part(merge(part.mesh for part in parts), parts[0].material) for parts in groups.values())


def affine(mesh: Mesh, matrix: Floats, translation: Sequence[float] | Floats = (0.0, 0.0, 0.0)) -> Mesh:
    """Apply a 3x3 matrix, then a translation; a mirroring matrix turns the triangles' winding back."""
    normals = mesh.normals @ np.linalg.inv(matrix)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    triangles = mesh.triangles if np.linalg.det(matrix) > 0 else mesh.triangles[:, ::-1].copy()
    return replace(
        mesh,
        vertices=mesh.vertices @ matrix.T + np.asarray(translation, float),
        triangles=triangles,
        normals=normals,
    )


def rotation(axis: str, angle_deg: float) -> Floats:
    """The 3x3 rotation about `axis` ("x", "y" or "z"), counter-clockwise."""
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[first, first] = matrix[second, second] = cosine
    matrix[first, second], matrix[second, first] = -sine, sine
    return matrix


def moved(mesh: Mesh, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Mesh:
    """Translate a mesh."""
    return replace(mesh, vertices=mesh.vertices + np.array([x, y, z]))


def rotated(mesh: Mesh, axis: str, angle_deg: float) -> Mesh:
    """Rotate a mesh about an axis through the origin."""
    return affine(mesh, rotation(axis, angle_deg))


def transformed(model: Model, matrix: Floats, translation: Sequence[float] | Floats = (0.0, 0.0, 0.0)) -> Model:
    """Apply `affine` to every part."""
    return tuple(Part(affine(part.mesh, matrix, translation), part.material) for part in model)


def placed(model: Model, position: Sequence[float], yaw_deg: float = 0.0) -> Model:
    """Turn a model about z, then move it."""
    return transformed(model, rotation("z", yaw_deg), position)


def bounds(model: Iterable[Part]) -> tuple[Floats, Floats]:
    """The axis-aligned bounding box of all vertices: (minimum, maximum)."""
    vertices = np.concatenate([part.mesh.vertices for part in model])
    return vertices.min(axis=0), vertices.max(axis=0)


def fit_to_box(
    model: Model, extent: Sequence[float], centroid: Sequence[float] = (0.0, 0.0, 0.0), may_turn: bool = True
) -> Model:
    """Scale a model so that its axis-aligned box has exactly this extent and centroid.

    With `may_turn` it is first turned by 90 degrees about z when that needs less stretching.
    """
    low, high = bounds(model)
    size, wanted = high - low, np.asarray(extent, float)
    if may_turn and (size[0] > size[1]) != (wanted[0] > wanted[1]):
        return fit_to_box(transformed(model, rotation("z", 90.0)), extent, centroid, may_turn=False)
    matrix = np.diag(wanted / size)
    return transformed(model, matrix, np.asarray(centroid, float) - matrix @ ((low + high) / 2))


def triangle_count(model: Model) -> int:
    """The number of triangles of a model."""
    return sum(len(part.mesh.triangles) for part in model)
