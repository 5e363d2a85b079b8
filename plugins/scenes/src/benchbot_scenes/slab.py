"""Projection of the triangles between two heights: clipped to a slab and dropped to the floor."""

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


def project_slab(triangles: Floats, z_min_m: float, z_max_m: float) -> Floats:
    """Clip triangles (T, 3, 3) to a range of heights and drop z: convex polygons (P, 5, 2), the last corner repeated.

    Clipping after Sutherland and Hodgman, "Reentrant polygon clipping" (1974).
    """
    finite = np.isfinite(triangles).all((1, 2))
    heights = triangles[..., 2]
    with np.errstate(invalid="ignore"):
        reaches = (heights.max(1, initial=-np.inf) >= z_min_m) & (heights.min(1, initial=np.inf) <= z_max_m)
    polygons = triangles[finite & reaches]
    polygons = _clip(polygons, polygons[..., 2] - z_min_m)
    polygons = _clip(polygons, z_max_m - polygons[..., 2])
    return np.ascontiguousarray(polygons[..., :2])


def _clip(polygons: Floats, inside_by: Floats) -> Floats:
    """Keep the part of convex polygons (P, N, 3) where the linear `inside_by` (P, N) is ≥ 0: (P', N + 1, 3)."""
    kept = inside_by >= 0
    touched = kept.any(1)
    polygons, inside_by, kept = polygons[touched], inside_by[touched], kept[touched]
    clipped = np.concatenate([polygons, polygons[:, -1:]], 1)
    cut = ~kept.all(1)
    clipped[cut] = _cut(polygons[cut], inside_by[cut], kept[cut])
    return clipped


def _cut(polygons: Floats, inside_by: Floats, kept: Bools) -> Floats:
    following, following_by = np.roll(polygons, -1, 1), np.roll(inside_by, -1, 1)
    crosses = kept != (following_by >= 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        fraction = np.where(crosses, inside_by / (inside_by - following_by), 0.0)[..., None]
    crossings = polygons + fraction * (following - polygons)
    count, corners, _ = polygons.shape
    # Each corner gives itself if it is inside, then the crossing on the edge that leaves it if there is one.
    outline = np.stack([polygons, crossings], 2).reshape(count, 2 * corners, 3)
    valid = np.stack([kept, crosses], 2).reshape(count, 2 * corners)
    order = np.argsort(~valid, axis=1, kind="stable")
    size = valid.sum(1)
    # A plane cuts at most one corner off a convex polygon and leaves two: one corner more. Repeat the last to fill up.
    columns = np.minimum(np.arange(corners + 1), np.maximum(size, 1)[:, None] - 1)
    cut: Floats = np.take_along_axis(outline, np.take_along_axis(order, columns, 1)[..., None], 1)
    return cut


def rasterise(polygons: Floats, low_m: tuple[float, float], shape: tuple[int, int], cell_m: float) -> Bools:
    """Return which cells (columns along x, rows along y) of a grid from corner `low_m` convex polygons (P, N, 2) touch.

    Those that points half a cell apart on the outline are in, and those whose middle is inside; but for single ones in
    what is less than two cells across.
    """
    touched = np.zeros(shape, bool)
    cells = (polygons - np.asarray(low_m)) / cell_m
    width_cells = np.ptp(cells, axis=1).max(1, initial=0.0) if len(cells) else np.zeros(0)
    for small in _batches(cells[width_cells <= 1.0]):
        _mark(touched, small.reshape(-1, 2))
    large = cells[width_cells > 1.0]
    for some in _batches(large, 2_000):
        _mark(touched, _outlines(some))
    # Outlines are drawn; what is thin has nothing else to fill.
    for polygon in large[_inradius_bound(large) > 1.0] if len(large) else large:
        _fill(touched, polygon)
    return touched


def _fill(touched: Bools, polygon: Floats) -> None:
    """Mark the cells whose middle lies in a convex polygon."""
    first = np.maximum(np.floor(polygon.min(0)).astype(int), 0)
    last = np.minimum(np.ceil(polygon.max(0)).astype(int), touched.shape)
    if (last <= first).any():
        return
    part = touched[first[0] : last[0], first[1] : last[1]]
    if part.all():
        return
    x = np.arange(first[0], last[0])[:, None] + 0.5
    y = np.arange(first[1], last[1])[None, :] + 0.5
    left, right = np.ones(part.shape, bool), np.ones(part.shape, bool)
    corners = polygon.tolist()
    for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        # A corner that is repeated has no side.
        if (x0, y0) != (x1, y1):
            side = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
            left &= side >= 0
            right &= side <= 0
    part |= left | right


def _batches(cells: Floats, size: int = 20_000) -> list[Floats]:
    return [cells[first : first + size] for first in range(0, len(cells), size)]


def _mark(touched: Bools, points: Floats) -> None:
    columns, rows = np.floor(points).astype(np.int64).T
    inside = (columns >= 0) & (columns < touched.shape[0]) & (rows >= 0) & (rows < touched.shape[1])
    touched[columns[inside], rows[inside]] = True


def _outlines(polygons: Floats) -> Floats:
    """Points along the outlines of polygons, half a cell apart."""
    starts, ends = polygons.reshape(-1, 2), np.roll(polygons, -1, 1).reshape(-1, 2)
    ways = ends - starts
    counts = np.ceil(2 * np.abs(ways).max(1)).astype(np.int64) + 1
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    points: Floats = np.repeat(ways, counts, axis=0)
    points *= (step / np.repeat(np.maximum(counts - 1, 1), counts))[:, None]
    points += np.repeat(starts, counts, axis=0)
    return points


def _inradius_bound(polygons: Floats) -> Floats:
    """Twice area over perimeter: no less than the radius of a circle within; slivers have nothing to fill."""
    following = np.roll(polygons, -1, 1)
    area2 = np.abs((polygons[..., 0] * following[..., 1] - polygons[..., 1] * following[..., 0]).sum(1))
    perimeter = np.linalg.norm(following - polygons, axis=2).sum(1)
    bound: Floats = area2 / np.maximum(perimeter, 1e-12)
    return bound
