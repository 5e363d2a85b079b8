"""Obstacles of a footprint: the scene's triangles between two heights, seen from above."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.slab import project_slab

Floats = npt.NDArray[np.float64]

# Cells of four grids, each pruning what the one before it has left.
CELL_SIZES_M = (0.8, 0.4, 0.2, 0.05)


GRID_LEVEL = 3
GRID_MARGIN_M = 0.5


@dataclass(frozen=True)
class EdgeGrid:
    """The edges that can be the nearest to a point, by cells of `size_m` whose numbers are `floor(x / size_m)`.

    Cells are counted along x first, from the `first` column and row on; `shape` has the numbers of columns and rows.
    Cell `c` has the `numbers` from `starts[c]` to `starts[c + 1]`; the last cell has all, for points elsewhere. They
    are rows of `edges` (E, 5): x, y, x and y along the edge, 1 / length².
    """

    size_m: float
    first: tuple[int, int]
    shape: tuple[int, int]
    starts: npt.NDArray[np.int64]
    numbers: npt.NDArray[np.int32]
    edges: Floats


class ObstacleMap:
    """Exact planar distances to everything of a scene that lies between two heights.

    The triangles are clipped to `z_min_m` ≤ z ≤ `z_max_m` and projected to the floor, which leaves convex polygons.
    Their edges are what a robot meets first. For each cell of a uniform grid the edges that can be nearest to a point
    in it are gathered when it is first entered, so that a query looks at few.
    """

    def __init__(self, scene: SceneGeometry, z_min_m: float, z_max_m: float) -> None:
        corners = scene.vertices[scene.triangles].astype(np.float64)
        self._polygons = project_slab(corners, z_min_m, z_max_m)
        self._boxes = np.concatenate([self._polygons.min(1), self._polygons.max(1)], 1).T.copy()
        edges = _edges(self._polygons)
        self._edges = np.concatenate([edges, np.arange(edges.shape[1])[None]])
        self._cells: dict[tuple[int, int, int], Floats] = {}
        self._gathered = _Gathered()

    def distance_m(self, x: float, y: float) -> float:
        """Return the distance from a point of the map frame to the nearest edge, +inf without any."""
        return float(distances_m(x, y, self._nearest_edges(x, y, len(CELL_SIZES_M))).min(initial=np.inf))

    def distances_m(self, x: Floats, y: Floats) -> Floats:
        """Return `distance_m` of points (N,), to the last bit, in one pass."""
        if not self._edges.size:
            return np.full(len(x), np.inf)
        size_m = CELL_SIZES_M[-1]
        columns, rows = np.floor(x / size_m).astype(np.int64), np.floor(y / size_m).astype(np.int64)
        cells = []
        for key, point in zip(zip(columns.tolist(), rows.tolist(), strict=True), zip(x, y, strict=True), strict=True):
            if key not in self._gathered.numbers:
                self._gathered.add(key, self._nearest_edges(float(point[0]), float(point[1]), len(CELL_SIZES_M)))
            cells.append(self._gathered.numbers[key])
        return self._gathered.least_m(x, y, np.array(cells, np.intp))

    def grid(self) -> EdgeGrid:
        """Return all that `distance_m` looks up, for a few metres around too."""
        size_m = CELL_SIZES_M[GRID_LEVEL - 1]
        if not self._edges.size:
            return EdgeGrid(size_m, (0, 0), (0, 0), np.zeros(2, np.int64), np.zeros(0, np.int32), np.zeros((0, 5)))
        ends = np.concatenate(self.edges())
        (column, row), (last_column, last_row) = (
            np.floor((corner + margin_m) / size_m).astype(np.int64).tolist()
            for corner, margin_m in ((ends.min(0), -GRID_MARGIN_M), (ends.max(0), GRID_MARGIN_M))
        )
        parts = [
            self._nearest_edges((i + 0.5) * size_m, (j + 0.5) * size_m, GRID_LEVEL)[5].astype(np.int32)
            for j in range(row, last_row + 1)
            for i in range(column, last_column + 1)
        ]
        parts.append(np.arange(self._edges.shape[1], dtype=np.int32))
        starts = np.cumsum([0, *map(len, parts)])
        shape = (last_column - column + 1, last_row - row + 1)
        return EdgeGrid(size_m, (column, row), shape, starts, np.concatenate(parts), self._edges[:5].T.copy())

    def nearest_points(self, x: float, y: float) -> tuple[Floats, Floats]:
        """Return the nearest points (N, 2) of edges and their distances (N,), of the edges that may be nearest.

        These are the edges that are nearest to some point within the same 5 cm.
        """
        edges = self._nearest_edges(x, y, len(CELL_SIZES_M))
        fraction = np.clip(((x - edges[0]) * edges[2] + (y - edges[1]) * edges[3]) * edges[4], 0.0, 1.0)
        points = (edges[:2] + fraction * edges[2:4]).T
        distances: Floats = np.hypot(points[:, 0] - x, points[:, 1] - y)
        return points, distances

    def edges(self) -> tuple[Floats, Floats]:
        """Return the starts and the ends (N, 2) of all edges."""
        return self._edges[:2].T, (self._edges[:2] + self._edges[2:4]).T

    def covers(self, x: float, y: float) -> bool:
        """Return whether a surface of an obstacle lies above or below a point of the map frame."""
        low_x, low_y, high_x, high_y = self._boxes
        polygons = self._polygons[(low_x <= x) & (x <= high_x) & (low_y <= y) & (y <= high_y)]
        edge = np.roll(polygons, -1, 1) - polygons
        offset = np.array([x, y]) - polygons
        side = edge[..., 0] * offset[..., 1] - edge[..., 1] * offset[..., 0]
        # The sides sum to twice the area: a polygon seen edge-on has none, and nothing is inside it.
        inside = ((side >= 0).all(1) | (side <= 0).all(1)) & (np.abs(side.sum(1)) > 1e-12)
        return bool(inside.any())

    def _nearest_edges(self, x: float, y: float, level: int) -> Floats:
        """Return the edges (6, E) that can be nearest to a point in the cell of (x, y); level 0 has one cell.

        Their rows are those of `_edges`, and their numbers.
        """
        if level == 0:
            return self._edges
        size_m = CELL_SIZES_M[level - 1]
        column, row = math.floor(x / size_m), math.floor(y / size_m)
        key = (level, column, row)
        if key not in self._cells:
            edges = self._nearest_edges(x, y, level - 1)
            distance_m = distances_m((column + 0.5) * size_m, (row + 0.5) * size_m, edges)
            # By the triangle inequality: no point of the cell is farther than this from its centre.
            radius_m = size_m * math.sqrt(0.5)
            near = distance_m <= distance_m.min(initial=np.inf) + 2 * radius_m
            self._cells[key] = np.ascontiguousarray(edges[:, near])
        return self._cells[key]


class _Gathered:
    """The edges of cells of the finest grid, one cell's after the other's."""

    def __init__(self) -> None:
        self.numbers: dict[tuple[int, int], int] = {}
        self._parts: list[Floats] = []
        self._edges = np.zeros((6, 0))
        self._starts = np.zeros(1, np.intp)

    def add(self, key: tuple[int, int], edges: Floats) -> None:
        """Add the edges (6, E) of a cell, which are some."""
        self.numbers[key] = len(self.numbers)
        self._parts.append(edges)

    def least_m(self, x: Floats, y: Floats, cells: npt.NDArray[np.intp]) -> Floats:
        """Return the distance of each point (N,) to the nearest edge of its cell."""
        if not len(cells):
            return np.zeros(0)
        if self._parts:
            added = np.cumsum([part.shape[1] for part in self._parts])
            self._edges = np.concatenate([self._edges, *self._parts], 1)
            self._starts = np.append(self._starts, self._starts[-1] + added)
            self._parts = []
        counts = self._starts[cells + 1] - self._starts[cells]
        begins = np.cumsum(counts) - counts
        which = np.repeat(self._starts[cells] - begins, counts) + np.arange(counts.sum())
        edges = self._edges[:, which]
        least: Floats = np.minimum.reduceat(distances_m(np.repeat(x, counts), np.repeat(y, counts), edges), begins)
        return least


def _edges(polygons: Floats) -> Floats:
    """Return the distinct edges of polygons (P, N, 2) as rows x, y, x and y along the edge, 1 / length²: (5, E)."""
    ends = np.stack([polygons, np.roll(polygons, -1, 1)], 2).reshape(-1, 2, 2)
    # An edge that is no longer than a nanometre adds nothing to its neighbours.
    ends = ends[np.abs(ends[:, 1] - ends[:, 0]).max(1) > 1e-9]
    # Neighbouring triangles share an edge, in opposite directions.
    backwards = (ends[:, 0, 0] > ends[:, 1, 0]) | ((ends[:, 0, 0] == ends[:, 1, 0]) & (ends[:, 0, 1] > ends[:, 1, 1]))
    ends[backwards] = ends[backwards, ::-1]
    keys = ends.reshape(-1, 4).T
    keys = keys[:, np.lexsort(keys)]
    new = np.ones(keys.shape[1], bool)
    new[1:] = (keys[:, 1:] != keys[:, :-1]).any(0)
    x, y, other_x, other_y = keys[:, new]
    along_x, along_y = other_x - x, other_y - y
    return np.stack([x, y, along_x, along_y, 1.0 / (along_x**2 + along_y**2)])


def distances_m(x: float | Floats, y: float | Floats, edges: Floats) -> Floats:
    """Return the distance (E,) from a point, or from one each (E,), to edges as `_edges` lays them out."""
    start_x, start_y, along_x, along_y, inverse_length2 = edges[:5]
    offset_x, offset_y = x - start_x, y - start_y
    fraction = (offset_x * along_x + offset_y * along_y) * inverse_length2
    np.clip(fraction, 0.0, 1.0, out=fraction)
    offset_x -= fraction * along_x
    offset_y -= fraction * along_y
    distance: Floats = np.sqrt(offset_x * offset_x + offset_y * offset_y)
    return distance
