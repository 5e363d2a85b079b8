"""The cells that store irradiance: small cubes of space, one for each direction that a surface in them faces."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, IntArray, SceneGeometry
from benchbot_sim_taichi.bvh import usable
from benchbot_sim_taichi.tables import triangle_areas

CELL_STRIDE = 26
SAMPLE_STRIDE = 4
DIRECTIONS = 6
# Kinds of points: in a room, before its panes, between surfaces close to each other, behind a wall, within a solid.
OPEN, OUTDOORS, SLOT, BEHIND, BURIED = range(5)
MAX_SAMPLES_PER_CELL = 16
MAX_GRID_ENTRIES = 24_000_000
DEFAULT_CELL_SIZE_M = 0.10
SAMPLES_AT_ONCE = 2**15  # so that all about them stays in a processor's cache


@dataclass(frozen=True)
class SurfaceCells:
    """`grid` (nx * ny * nz * 6,) int32 holds a cell's index or -1, the direction (+x -x +y -y +z -z) varying fastest.

    `keys` are the cells' places in it. `samples` (4 per sample) are points of the surface: triangle, barycentric u
    and v, side (1 front, -1 back), those of cell i being `first[i]` … `first[i + 1]` - 1. `layout` (8,) float32:
    origin, 1 / size, nx, ny, nz, size.
    """

    grid: IntArray
    keys: IntArray
    samples: FloatArray
    first: IntArray
    layout: FloatArray

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.first) - 1


def find(scene: SceneGeometry, cell_size_m: float = DEFAULT_CELL_SIZE_M) -> SurfaceCells:
    """Scatter points over all surfaces that reflect light and sort them into cells."""
    parts = _scatter(scene, cell_size_m)
    if not parts:
        layout = np.array([0, 0, 0, 1, 1, 1, 1, 1], np.float32)
        return SurfaceCells(
            grid=np.full(DIRECTIONS, -1, np.int32),
            keys=np.zeros(0, np.int32),
            samples=np.zeros(SAMPLE_STRIDE, np.float32),
            first=np.zeros(1, np.int32),
            layout=layout,
        )
    low = np.min([points.min(axis=1) for points, _, _ in parts], axis=0)
    high = np.max([points.max(axis=1) for points, _, _ in parts], axis=0)
    volume = float(np.prod(high - low + 2 * cell_size_m))
    size = max(cell_size_m, (volume * DIRECTIONS / MAX_GRID_ENTRIES) ** (1 / 3))
    # Floors and walls tend to lie on round coordinates; cell borders should not.
    origin = low - 0.37 * size
    shape = np.floor((high - origin) / size).astype(np.int64) + 1
    keyed = []
    for points, direction, _ in parts:
        i, j, k = np.clip(((points - origin[:, None]) / size).astype(np.int64), 0, shape[:, None] - 1)
        keyed.append(((i * shape[1] + j) * shape[2] + k) * DIRECTIONS + direction)
    key, samples = np.concatenate(keyed), np.concatenate([records for _, _, records in parts])
    order = _sorted(key)
    ordered = key[order]
    start = np.flatnonzero(np.diff(ordered, prepend=-1))
    keys, count = ordered[start], np.diff(start, append=len(ordered))
    grid = np.full(int(np.prod(shape)) * DIRECTIONS, -1, np.int32)
    grid[keys] = np.arange(len(keys))
    kept = np.minimum(count, MAX_SAMPLES_PER_CELL)
    first = np.concatenate([[0], np.cumsum(kept)])
    rank = np.arange(int(first[-1])) - np.repeat(first[:-1], kept)
    chosen = order[np.repeat(start, kept) + rank * np.repeat(count, kept) // np.repeat(kept, kept)]
    layout = np.array([*origin, 1 / size, *shape, size], np.float32)
    return SurfaceCells(grid, keys.astype(np.int32), samples[chosen].ravel(), first.astype(np.int32), layout)


def _sorted(keys: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the stable order of keys, 0 to 2**32 - 1: numpy sorts numbers of 16 bits without comparing any."""
    low = np.argsort((keys & 0xFFFF).astype(np.uint16), kind="stable")
    order: npt.NDArray[np.int64] = low[np.argsort((keys >> 16).astype(np.uint16)[low], kind="stable")]
    return order


def split(cells: SurfaceCells, kinds: IntArray) -> tuple[SurfaceCells, IntArray, IntArray]:
    """Give samples of each kind in a cell a cell of their own; `kinds` are the samples', 0 and up.

    The lowest kind keeps the cell's number, the others follow after all cells. Returns the kind of each cell, and the
    next one in the same place, -1 if there is none.
    """
    place = np.repeat(np.arange(cells.count), np.diff(cells.first))
    highest = int(kinds.max()) + 1
    found, part = np.unique(place * highest + kinds, return_inverse=True)
    place_of, kind_of = np.divmod(found, highest)
    is_further = np.diff(place_of, prepend=-1) == 0
    number = np.where(is_further, cells.count + np.cumsum(is_further) - 1, place_of)
    following, kind = np.full(len(found), -1, np.int32), np.empty(len(found), np.int32)
    following[number[:-1]] = np.where(is_further[1:], number[1:], -1)
    kind[number] = kind_of
    owner = number[part]
    samples = cells.samples.reshape(-1, SAMPLE_STRIDE)[np.argsort(owner, kind="stable")].ravel()
    first = np.concatenate([[0], np.cumsum(np.bincount(owner))]).astype(np.int32)
    keys = np.concatenate([cells.keys, cells.keys[place_of[is_further]]])
    return replace(cells, keys=keys, samples=samples, first=first), kind, following


def without(cells: SurfaceCells, dropped: npt.NDArray[np.bool_]) -> SurfaceCells:
    """Leave samples out, and cells that have no others."""
    place = np.repeat(np.arange(cells.count), np.diff(cells.first))[~dropped]
    size = np.bincount(place, minlength=cells.count)
    grid = cells.grid.copy()
    grid[cells.keys] = np.where(size > 0, np.cumsum(size > 0) - 1, -1)
    samples = cells.samples.reshape(-1, SAMPLE_STRIDE)[~dropped].ravel()
    first = np.concatenate([[0], np.cumsum(size[size > 0])]).astype(np.int32)
    return replace(cells, grid=grid, keys=cells.keys[size > 0], samples=samples, first=first)


def places(cells: SurfaceCells, scene: SceneGeometry) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """A point of each cell, and the normal of its triangle on that side, (N, 3) both."""
    triangle, u, v, side = cells.samples.reshape(-1, SAMPLE_STRIDE)[cells.first[:-1]].T
    corner = scene.vertices[scene.triangles[triangle.astype(np.int64)]].astype(np.float64)
    across, down = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    normal = np.cross(across, down) * side[:, None]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return corner[:, 0] + across * u[:, None] + down * v[:, None], normal


def _scatter(
    scene: SceneGeometry, cell_size_m: float
) -> list[tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], FloatArray]]:
    """Points (3, N), directions (N,) that they face and sample records (N, 4), part by part.

    They lie evenly by area, but at least one on each triangle and on each of its sides that is seen.
    """
    reflects = np.array([not m.is_glass for m in scene.materials], bool)[scene.triangle_material]
    areas = triangle_areas(scene.vertices, scene.triangles)
    eligible = np.flatnonzero(reflects & usable(scene.vertices[scene.triangles]) & (areas > 1e-12))
    per_area = MAX_SAMPLES_PER_CELL / cell_size_m**2
    count = np.minimum(np.ceil(areas[eligible] * per_area * 1.5), 2_000_000).astype(np.int64)
    triangle = np.repeat(eligible, count)
    two_sided = np.array([m.double_sided for m in scene.materials], bool)[scene.triangle_material[triangle]]
    values = tuple(np.ascontiguousarray(each.T) for each in (scene.vertices, scene.normals))
    parts = []
    for side, numbers in ((1.0, np.arange(len(triangle))), (-1.0, np.flatnonzero(two_sided))):
        for first in range(0, len(numbers), SAMPLES_AT_ONCE):
            some = numbers[first : first + SAMPLES_AT_ONCE]
            parts.append(_on_triangles(values, scene.triangles, triangle[some], some, side))
    return [part for part in parts if len(part[1])]


def _on_triangles(
    values: tuple[FloatArray, ...],
    triangles: IntArray,
    triangle: npt.NDArray[np.int64],
    number: npt.NDArray[np.int64],
    side: float,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], FloatArray]:
    """Return a part of `_scatter`: a point on each triangle, `number` (N,) being its place in the sequence.

    `values` are the scene's vertices and normals (3, V).
    """
    u, v = _low_discrepancy(number + 1)
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    one, two, three = np.ascontiguousarray(triangles[triangle].T)
    # `take` leaves coordinates in rows, which an index would not.
    points, normals = (
        each.take(one, axis=1) * (1 - u - v) + each.take(two, axis=1) * u + each.take(three, axis=1) * v
        for each in values
    )
    normals = normals * side
    kept = np.flatnonzero(np.isfinite(normals).all(axis=0) & (np.linalg.norm(normals, axis=0) > 1e-6))
    axis = np.abs(normals).argmax(axis=0)
    direction = 2 * axis + (np.take_along_axis(normals, axis[None], 0)[0] < 0)
    samples = np.stack([triangle, u, v, np.full(len(u), side)], axis=1).astype(np.float32)
    return points.take(kept, axis=1), direction[kept], samples[kept]


def _low_discrepancy(index: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The R2 sequence (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018)."""
    plastic = 1.32471795724474602596
    return (0.5 + index / plastic) % 1.0, (0.5 + index / plastic**2) % 1.0
