"""The content of a file before guesses: triangles in its own unit and axes, and the names of its objects."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from benchbot_scenes import vertex_colors
from benchbot_scenes.scene import FloatArray, ImageArray, Instance, Material, SceneGeometry, unit_vectors
from benchbot_scenes.splats import Splats, transformed

UpAxis = Literal["y", "z"]
FAR_WIDTHS = 30.0
SMOOTH_BELOW_DEG = 40.0
"""Faces that meet at less than this are parts of one curved surface, where the file gives no normals."""


@dataclass(frozen=True)
class Model:
    """A file's content.

    `paths` has of each instance the names that lead to it, from the root; `unit_m` and `up` are what the file says
    about itself, None where it does not. `notes` tell a person what was left out. `origin` is the point of the file
    that has become (0, 0, 0).
    """

    geometry: SceneGeometry
    paths: tuple[tuple[str, ...], ...]
    unit_m: float | None = None
    up: UpAxis | None = None
    notes: tuple[str, ...] = ()
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Part:
    """Triangles of one object and one material; what is None is worked out or left away.

    `vertices` (V, 3), `triangles` (T, 3); `normals` (V, 3), `uvs` (V, 2) with row 0 of images at v = 0; `colors` linear
    sRGB of vertices (V, 3) or of corners (T, 3, 3).
    """

    path: tuple[str, ...]
    vertices: npt.NDArray[np.floating]
    triangles: npt.NDArray[np.integer]
    material: int
    normals: npt.NDArray[np.floating] | None = None
    uvs: npt.NDArray[np.floating] | None = None
    colors: npt.NDArray[np.floating] | None = None


@dataclass
class _Soup:
    """Arrays of a scene under construction."""

    vertices: list[FloatArray] = field(default_factory=list)
    normals: list[FloatArray] = field(default_factory=list)
    uvs: list[FloatArray] = field(default_factory=list)
    triangles: list[npt.NDArray[np.int64]] = field(default_factory=list)
    colors: list[FloatArray] = field(default_factory=list)
    vertex_count: int = 0
    origin: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))


def assemble(
    parts: Sequence[Part],
    materials: Sequence[Material],
    images: Sequence[ImageArray],
    *,
    unit_m: float | None = None,
    up: UpAxis | None = None,
    notes: Sequence[str] = (),
) -> Model:
    """One instance for each path, in the order of `parts`, which must have a triangle between them.

    What lies far from the origin, as surveyed places do, is brought there before its places are rounded to 32 bits.
    """
    numbers: dict[tuple[str, ...], int] = {}
    soup = _Soup(origin=_origin(parts))
    for part in parts:
        numbers.setdefault(part.path, len(numbers) + 1)
        _add(soup, part)
    counts = [len(part.triangles) for part in parts]
    geometry = SceneGeometry(
        vertices=np.concatenate(soup.vertices),
        triangles=np.concatenate(soup.triangles).astype(np.int32),
        triangle_instance=np.repeat(np.array([numbers[part.path] for part in parts], np.int32), counts),
        triangle_material=np.repeat(np.array([part.material for part in parts], np.int32), counts),
        normals=np.concatenate(soup.normals),
        uvs=np.concatenate(soup.uvs),
        materials=tuple(materials),
        instances=tuple(Instance(number, path[-1] if path else "", None) for path, number in numbers.items()),
        images=tuple(images),
    )
    is_colored = np.repeat(np.array([part.colors is not None for part in parts]), counts)
    if is_colored.any():
        geometry = vertex_colors.bake(geometry, np.concatenate(soup.colors), is_colored)
    if soup.origin.any():
        x, y, z = soup.origin
        notes = (*notes, f"It lies far from its origin and was moved by ({-x:.12g}, {-y:.12g}, {-z:.12g}).")
    x, y, z = soup.origin.tolist()
    return Model(geometry, tuple(numbers), unit_m, up, tuple(notes), (x, y, z))


def _origin(parts: Sequence[Part]) -> npt.NDArray[np.float64]:
    """The middle of all points, rounded, where it is farther from the origin than all of them are wide; else 0."""
    usable = [part.vertices[np.isfinite(part.vertices).all(axis=1)] for part in parts]
    boxes = [(points.min(axis=0), points.max(axis=0)) for points in usable if len(points)]
    if not boxes:
        return np.zeros(3)
    low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
    middle, width = (low + high) / 2, float((high - low).max())
    return np.round(middle) if np.abs(middle).max() > FAR_WIDTHS * width else np.zeros(3)


def _add(soup: _Soup, part: Part) -> None:
    triangles = np.asarray(part.triangles, np.int64)
    vertices = (np.asarray(part.vertices, np.float64) - soup.origin).astype(np.float32)
    uvs = np.zeros((len(vertices), 2), np.float32) if part.uvs is None else np.asarray(part.uvs, np.float32)
    soup.colors.append(_corner_colors(part, triangles))
    if part.normals is None:
        with np.errstate(invalid="ignore", over="ignore"):  # what is no place is left out later
            normals = _corner_normals(vertices, triangles)
        vertices, uvs = vertices[triangles.ravel()], uvs[triangles.ravel()]
        triangles = np.arange(len(vertices)).reshape(-1, 3)
    else:
        normals = unit_vectors(np.asarray(part.normals, np.float64))
    soup.vertices.append(vertices)
    soup.normals.append(normals)
    soup.uvs.append(uvs)
    soup.triangles.append(triangles + soup.vertex_count)
    soup.vertex_count += len(vertices)


def _corner_colors(part: Part, triangles: npt.NDArray[np.int64]) -> FloatArray:
    if part.colors is None:
        return np.zeros((len(triangles), 3, 3), np.float32)
    colors = np.asarray(part.colors, np.float32)
    return colors[triangles] if colors.ndim == 2 else colors


def _corner_normals(vertices: FloatArray, triangles: npt.NDArray[np.int64]) -> FloatArray:
    """(3 T, 3): the area-weighted mean around a vertex where the surface is smooth, else the triangle's own."""
    corners = vertices[triangles].astype(np.float64)
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    summed = np.zeros((len(vertices), 3))
    for axis in range(3):
        summed[:, axis] = np.bincount(triangles.ravel(), np.repeat(weighted[:, axis], 3), minlength=len(vertices))
    smooth, flat = unit_vectors(summed)[triangles], unit_vectors(weighted)[:, None, :]
    is_smooth = (smooth * flat).sum(axis=2, keepdims=True) > np.cos(np.radians(SMOOTH_BELOW_DEG))
    normals: FloatArray = np.where(is_smooth, smooth, flat).reshape(-1, 3).astype(np.float32)
    return normals


def with_splats(model: Model, splats: Splats) -> Model:
    """The model with splats that are in the file's own frame, before its origin was moved."""
    moved = transformed(splats, offset=tuple(-value for value in model.origin))
    return replace(model, geometry=replace(model.geometry, splats=moved))


def renamed(model: Model, name: str) -> Model:
    """Call what the file gives no name `name`."""
    paths = tuple(tuple(step for step in path if step) or (name,) for path in model.paths)
    return replace(model, paths=paths)


def turned(geometry: SceneGeometry, rotation: npt.NDArray[np.floating]) -> SceneGeometry:
    """The scene after a rotation (3, 3) about the origin."""
    return replace(
        geometry,
        vertices=(geometry.vertices @ rotation.T.astype(np.float32)).astype(np.float32),
        normals=(geometry.normals @ rotation.T.astype(np.float32)).astype(np.float32),
        splats=geometry.splats and transformed(geometry.splats, rotation),
    )
