"""Where on surfaces light is kept: nodes, and the way from a place on a triangle to those around it.

Flat surfaces of some size have charts, lattices of nodes `NODE_M` apart in which all their triangles lie. Every other
triangle has a lattice of its own, whose points share the nodes of what lies close by and faces the same way.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, IntArray, SceneGeometry
from benchbot_sim_taichi import _ti, parting
from benchbot_sim_taichi.bvh import usable
from benchbot_sim_taichi.lights import is_sheet

NODE_M = 0.025
LOOSE_M = 0.0375
LOOSE_INSET_M = 0.005
STRIP_M = 0.10
LONGEST_LOOSE_EDGE_M = 0.06
SMALLEST_CHART_M2 = 0.004
AREA_POINTS = 4  # of each node, to find how much of the surface it stands for
FLAT = np.cos(np.radians(1.0))
NODE_STRIDE = 5
PLACE_STRIDE = 8
SAMPLE_STRIDE = 4

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Charts:
    """`samples` (N * 4) are the nodes' places on the surface: triangle, barycentric u and v, side (1 or -1: the back).

    `places` (T * 2 * 8) is where both sides of each triangle find their nodes: the first entry of a lattice in `index`
    (-1: not lit) and its width, then x and y in it for u = v = 0 and their slopes over u and v. `index` holds the node
    of each lattice point, -1 beyond the surface. `nodes` (N * 5): a chart's node has its entry in `index`, x, y, width
    and height; any other has -1, and as neighbours `links[first_link[i]]` to `links[first_link[i + 1] - 1]`. `area_m2`
    (N) is how much of the surface each stands for.
    """

    samples: FloatArray
    area_m2: FloatArray
    places: FloatArray
    index: IntArray
    nodes: IntArray
    first_link: IntArray
    links: IntArray

    @property
    def count(self) -> int:
        """Number of nodes."""
        return len(self.nodes) // NODE_STRIDE

    def places_in(self, scene: SceneGeometry) -> tuple[FloatArray, FloatArray]:
        """Return where the nodes are in a scene, and the normals of their faces, (N, 3) both."""
        triangle, u, v, side = self.samples.reshape(-1, SAMPLE_STRIDE).T
        corner = scene.vertices[scene.triangles[triangle.astype(np.int64)]]
        along, beside = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        normal = np.cross(along, beside) * side[:, None]
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
        return corner[:, 0] + along * u[:, None] + beside * v[:, None], normal.astype(np.float32)


@dataclass
class _Parts:
    """Nodes and lattices found so far."""

    places: FloatArray
    samples: list[FloatArray]
    area_m2: list[FloatArray]
    nodes: list[IntArray]
    index: list[IntArray]
    entries: int = 0
    count: int = 0


def find(scene: SceneGeometry) -> Charts:
    """Find the nodes of all surfaces that reflect light."""
    if not len(scene.triangles):
        nothing, one = np.zeros(0, np.float32), np.zeros(1, np.int32)
        return Charts(nothing, nothing, nothing, one - 1, one[:0], one, one)
    corner = scene.vertices[scene.triangles].astype(np.float64)
    edge = corner[:, [1, 2, 0]] - corner
    length_m = np.sqrt(np.einsum("tcx,tcx->tc", edge, edge))
    oriented_area = 0.5 * np.cross(edge[:, 0], -edge[:, 2])
    area_m2 = np.sqrt(np.einsum("tx,tx->t", oriented_area, oriented_area))
    face = oriented_area / np.maximum(area_m2, 1e-20)[:, None]
    reflects = np.array([not m.is_glass for m in scene.materials], bool)[scene.triangle_material]
    lit = reflects & usable(scene.vertices[scene.triangles]) & (area_m2 > 5e-13)
    has_back = np.array([m.double_sided for m in scene.materials], bool)[scene.triangle_material]
    has_back |= is_sheet(scene, np.arange(len(corner)), oriented_area)

    flat = (np.einsum("tcx,tx->tc", scene.normals[scene.triangles], face) > FLAT).all(axis=1)
    large = np.flatnonzero(lit & flat & (length_m.max(axis=1) > LONGEST_LOOSE_EDGE_M))
    surface = _surfaces(scene, large, corner, face)
    of_chart = np.bincount(surface, area_m2[large])[surface] > SMALLEST_CHART_M2 if len(large) else np.zeros(0, bool)
    charted = large[of_chart]
    parts = _Parts(np.zeros((len(corner), 2, PLACE_STRIDE), np.float32), [], [], [], [])
    parts.places[:, :, 0] = -1.0
    if len(charted):
        _lay_out_charts(parts, charted, surface[of_chart], corner, face, length_m, area_m2, has_back)
    is_loose = lit.copy()
    is_loose[charted] = False
    loose = np.flatnonzero(is_loose)
    first_link, links = np.zeros(parts.count + 1, np.int32), np.zeros(1, np.int32)
    if len(loose):
        pairs = _lay_out_loose(
            parts, scene, np.concatenate([loose, loose[has_back[loose]]]), len(loose), length_m, area_m2
        )
        first_link = np.searchsorted(pairs[:, 0], np.arange(parts.count + 1)).astype(np.int32)
        links = pairs[:, 1].astype(np.int32) if len(pairs) else links
    # The back of a closed surface is seen where its mesh is not quite closed.
    parts.places[~has_back, 1] = parts.places[~has_back, 0]
    no_samples, no_nodes = np.zeros((0, SAMPLE_STRIDE), np.float32), np.zeros((0, NODE_STRIDE), np.int32)
    return Charts(
        np.concatenate(parts.samples or [no_samples]).ravel(),
        np.concatenate(parts.area_m2 or [np.zeros(0, np.float32)]),
        parts.places.ravel(),
        np.concatenate(parts.index) if parts.index else np.full(1, -1, np.int32),
        np.concatenate(parts.nodes or [no_nodes]).ravel(),
        first_link,
        links,
    )


def _surfaces(scene: SceneGeometry, large: Ints, corner: Floats, face: Floats) -> Ints:
    """Return a number for each large triangle, that of the connected flat surface it is part of."""
    if not len(large):
        return large
    # Of scenes whose light is kept no charts are made, and scipy takes as long to import as all of these modules.
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    offset = np.einsum("tx,tx->t", face[large], corner[large, 0])
    part = np.column_stack([scene.triangle_instance, parting.sides(scene)])[large]
    key = np.column_stack([part, np.rint(face[large] * 200), np.rint(offset * 500)])
    plane = np.unique(_packed(key), return_inverse=True)[1]
    points = np.rint(corner[large].reshape(-1, 3) * 2000)
    joint = np.unique(_packed(np.column_stack([np.repeat(plane, 3), points])), return_inverse=True)[1]
    triangle = np.repeat(np.arange(len(large)), 3)
    size = len(large) + int(joint.max()) + 1
    shared = coo_array((np.ones(len(joint), bool), (triangle, len(large) + joint)), shape=(size, size))
    component = connected_components(shared, directed=False)[1]
    surface: Ints = np.unique(component[: len(large)], return_inverse=True)[1]
    return surface


def _packed(key: npt.NDArray[np.floating]) -> Ints:
    """Return one integer for each row of whole numbers, different where rows are."""
    low = key.min(axis=0)
    packed = np.zeros(len(key), np.int64)
    for column, span in enumerate((key.max(axis=0) - low + 1).astype(np.int64)):
        packed = packed * span + (key[:, column] - low[column]).astype(np.int64)
    return packed


def _lay_out_charts(
    parts: _Parts,
    charted: Ints,
    surface: Ints,
    corner: Floats,
    face: Floats,
    length_m: Floats,
    area_m2: Floats,
    has_back: npt.NDArray[np.bool_],
) -> None:
    """Lay a lattice over each flat surface, along the longest edge of its outline."""
    from benchbot_sim_taichi.kernels import charts as kernels

    order = np.argsort(surface, kind="stable")
    charted, chart = charted[order], np.unique(surface[order], return_inverse=True)[1]
    first = np.searchsorted(chart, np.arange(chart[-1] + 2))
    outline_m = length_m[charted] * _outline(chart, corner[charted])
    longest = np.lexsort((np.arange(len(chart)), -outline_m.max(axis=1), chart))[first[:-1]]
    side = outline_m[longest].argmax(axis=1)
    start = corner[charted[longest], side]
    across = corner[charted[longest], (side + 1) % 3] - start
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    down = np.cross(face[charted[longest]], across)
    from_start = corner[charted] - start[chart][:, None]
    flat = np.stack([np.einsum("tcx,tx->tc", from_start, way[chart]) for way in (across, down)], axis=-1)
    low = np.minimum.reduceat(flat.min(axis=1), first[:-1])
    extent_m = np.maximum.reduceat(flat.max(axis=1), first[:-1]) - low
    spacing_m = np.where(extent_m.min(axis=1) < NODE_M, STRIP_M, NODE_M)
    size = np.maximum(np.ceil(extent_m / spacing_m[:, None]).astype(np.int64) + 1, 2)
    local = (flat - low[chart][:, None]) * ((size - 1) / np.maximum(extent_m, 1e-6))[chart][:, None]

    points = size.prod(axis=1)
    chart_of = np.repeat(np.arange(len(size)), points)
    y, x = np.divmod(np.arange(len(chart_of)) - np.repeat(np.cumsum(points) - points, points), size[chart_of, 0])
    lattice = np.column_stack([x, y, size[chart_of]]).astype(np.int32)
    found = np.zeros((len(chart_of), SAMPLE_STRIDE), np.float32)
    samples = _ti.upload(found.ravel())
    kernels.place(
        *(_ti.upload(values.ravel().astype(np.int32)) for values in (lattice, chart_of, first, charted)),
        _ti.upload(local.ravel().astype(np.float32)),
        samples,
        len(found),
    )
    found = _ti.download(samples).reshape(found.shape)
    begins = (np.cumsum(points) - points)[chart]
    stands_for_m2 = _areas(local, begins, size[chart, 0], area_m2[charted], len(found))
    slopes = np.concatenate([local[:, 0], local[:, 1] - local[:, 0], local[:, 2] - local[:, 0]], axis=1)
    for back, of_side in enumerate((np.ones(len(charted), bool), has_back[charted])):
        wanted = np.zeros(len(size), bool)
        wanted[chart[of_side]] = True
        points_here = np.where(wanted, points, 0)
        entry = parts.entries + np.cumsum(points_here) - points_here
        parts.places[charted[of_side], back] = np.column_stack(
            [entry[chart[of_side]], size[chart[of_side], 0], slopes[of_side]]
        )
        here = wanted[chart_of]
        is_node = here & (found[:, 0] >= 0)
        index = np.where(is_node, parts.count + np.cumsum(is_node) - 1, -1)[here]
        of_nodes = found[is_node].copy()
        of_nodes[:, 3] = 1 - 2 * back
        parts.samples.append(of_nodes)
        parts.area_m2.append(stands_for_m2[is_node].astype(np.float32))
        parts.nodes.append(
            np.column_stack([parts.entries + np.cumsum(here)[is_node] - 1, lattice[is_node]]).astype(np.int32)
        )
        parts.index.append(index.astype(np.int32))
        parts.entries += len(index)
        parts.count += len(of_nodes)


def _outline(chart: Ints, corner: Floats) -> Floats:
    """Return (T, 3) 1 for the edges of triangles that no other of their chart shares, and next to nothing for others.

    Those within are the diagonals of rectangles, and longer than their sides.
    """
    middle = np.rint((corner + corner[:, [1, 2, 0]]).reshape(-1, 3) * 1000)
    edge = _packed(np.column_stack([np.repeat(chart, 3), middle]))
    _, place, times = np.unique(edge, return_inverse=True, return_counts=True)
    outline: Floats = np.where(times[place] == 1, 1.0, 1e-3).reshape(-1, 3)
    return outline


def _areas(local: Floats, first: Ints, width: Ints, area_m2: Floats, count: int) -> Floats:
    """Return the area nearest to each of `count` lattice points; `local` (T, 3, 2) are triangles in their lattices."""
    times = np.ceil(AREA_POINTS * area_m2 / NODE_M**2).astype(np.int64)
    triangle = np.repeat(np.arange(len(times)), times)
    number = np.arange(len(triangle)) - np.repeat(np.cumsum(times) - times, times)
    # Well spread over the unit square: Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
    u, v = (0.5 + np.outer([0.7548776662466927, 0.5698402909980532], number)) % 1.0
    is_beyond = u + v > 1.0
    u, v = np.where(is_beyond, 1.0 - u, u), np.where(is_beyond, 1.0 - v, v)
    corner = local[triangle]
    at = corner[:, 0] + u[:, None] * (corner[:, 1] - corner[:, 0]) + v[:, None] * (corner[:, 2] - corner[:, 0])
    nearest = np.rint(at).astype(np.int64)
    entry = first[triangle] + nearest[:, 1] * width[triangle] + nearest[:, 0]
    areas: Floats = np.bincount(entry, (area_m2 / times)[triangle], minlength=count).astype(np.float64)
    return areas


def _lay_out_loose(
    parts: _Parts, scene: SceneGeometry, triangle: Ints, fronts: int, length_m: Floats, area_m2: Floats
) -> Ints:
    """Lay a lattice over each triangle; the first `fronts` show their front.

    Returns pairs of neighbours, in order."""
    from benchbot_sim_taichi.kernels import charts as kernels

    side = np.where(np.arange(len(triangle)) < fronts, 1, -1)
    # From the corner opposite the longest edge, so that slivers need few points.
    base = (length_m[triangle].argmax(axis=1) + 2) % 3
    edges = np.column_stack([length_m[triangle, base], length_m[triangle, (base + 2) % 3]])
    size = np.maximum(np.ceil(edges / LOOSE_M).astype(np.int64), 1) + 1
    points = size.prod(axis=1)
    first = np.cumsum(points) - points
    total = int(points.sum())
    ids = np.column_stack([triangle, base, side, size, first]).astype(np.int32)
    keys, uv, alike = (np.zeros(2 * total, np.int32), np.zeros(2 * total, np.float32), np.zeros(total, np.int32))
    on_device = [_ti.upload(values) for values in (keys, uv, alike)]
    kernels.spread(
        _ti.upload(ids.ravel()),
        _ti.upload(scene.triangle_instance[triangle].astype(np.int32)),
        _ti.upload(scene.vertices[scene.triangles[triangle]].ravel()),
        _ti.upload(scene.normals[scene.triangles[triangle]].ravel()),
        *on_device,
        len(triangle),
    )
    keys, uv, alike = (_ti.download(values) for values in on_device)
    _, chosen, cluster = np.unique(keys.view(np.int64), return_index=True, return_inverse=True)
    owner = np.searchsorted(first, chosen, side="right") - 1
    back = (1 - side) // 2
    weights = np.array([[1.0, -1.0, -1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # of corners, by 1, u and v
    for axis in range(2):
        slopes = weights[(base + 1 + axis) % 3] * (size[:, axis, None] - 1)
        parts.places[triangle, back, 2 + axis] = slopes[:, 0]
        parts.places[triangle, back, 4 + axis] = slopes[:, 1]
        parts.places[triangle, back, 6 + axis] = slopes[:, 2]
    parts.places[triangle, back, 0] = parts.entries + first
    parts.places[triangle, back, 1] = size[:, 0]
    parts.index.append((parts.count + cluster).astype(np.int32))
    inset = np.minimum(0.1, LOOSE_INSET_M / length_m[triangle[owner]].max(axis=1))[:, None]
    inside = (1.0 - inset) * uv.reshape(-1, 2)[chosen] + inset / 3
    parts.samples.append(np.column_stack([triangle[owner], inside, side[owner]]).astype(np.float32))
    parts.area_m2.append(np.bincount(cluster, np.repeat(area_m2[triangle] / points, points)).astype(np.float32))
    nodes = np.zeros((len(chosen), NODE_STRIDE), np.int32)
    nodes[:, 0] = -1
    parts.nodes.append(nodes)
    pairs = []
    for bit, step in ((1, np.ones(total, np.int64)), (2, np.repeat(size[:, 0], points))):
        here = np.flatnonzero(alike & bit)
        pair = np.column_stack([cluster[here], cluster[here + step[here]]])
        pairs.append(pair[pair[:, 0] != pair[:, 1]])
    one, other = np.concatenate([pairs[0], pairs[0][:, ::-1], pairs[1], pairs[1][:, ::-1]]).T
    packed = np.sort(one.astype(np.int64) * len(chosen) + other)
    packed = packed[np.diff(packed, prepend=-1) > 0]
    linked: Ints = np.column_stack(np.divmod(packed, len(chosen))) + parts.count
    parts.entries += total
    parts.count += len(chosen)
    return linked
