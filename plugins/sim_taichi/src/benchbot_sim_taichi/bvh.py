"""Bounding volume hierarchy: binned SAH built level by level in numpy, collapsed to wide nodes.

Split heuristic: Wald, "On fast construction of SAH-based bounding volume hierarchies", RT 2007.
Collapse: Wald, Benthin, Boulos, "Getting rid of packets", RT 2008 (open the child of largest area first).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float32]
IndexArray = npt.NDArray[np.int64]

WIDTH = 8
LEAF_SIZE = 4
NODE_STRIDE = 8 * WIDTH
LEAF_STRIDE = 40
STACK_SIZE = 64
EMPTY_CHILD = np.int32(2**31 - 1)
MEDIAN_DEPTH = 48


@dataclass(frozen=True)
class Bvh:
    """Traversal data, both arrays flat float32 with integers stored by their bits.

    A node is 64 values: low x, y, z and high x, y, z of eight children, then eight child references (≥ 0 node, < 0
    bitwise complement of a leaf, `EMPTY_CHILD` none) and padding; half as many of each where nodes are four wide. A
    leaf is 40: corner, first edge and second edge of four triangles, each as x, y, z lanes, then four triangle ids (-1
    none). `roots` holds one root node per group of triangles.
    """

    nodes: FloatArray
    leaves: FloatArray
    roots: tuple[int, ...]


@dataclass(frozen=True)
class _BinaryTree:
    low: FloatArray
    high: FloatArray
    left: IndexArray  # -1 for leaves; the right child is left + 1
    start: IndexArray
    count: IndexArray
    order: IndexArray

    def area(self) -> FloatArray:
        return _half_area(self.low, self.high)


def build(
    vertices: FloatArray, triangles: npt.NDArray[np.int32], groups: tuple[IndexArray, ...], width: int = WIDTH
) -> Bvh:
    """Build one tree per group of triangle ids, of nodes with up to `width` children.

    Triangles that are not finite or have no area are left out.
    """
    nodes, leaves, roots = [], [], []
    node_base = leaf_base = 0
    for group in groups:
        corners = vertices[triangles[group]].reshape(-1, 3, 3)
        is_usable = usable(corners)
        tree_nodes, tree_leaves = _build_tree(corners[is_usable], group[is_usable], node_base, leaf_base, width)
        nodes.append(tree_nodes)
        leaves.append(tree_leaves)
        roots.append(node_base)
        node_base += len(tree_nodes)
        leaf_base += len(tree_leaves)
    return Bvh(np.concatenate(nodes).ravel(), np.concatenate(leaves).ravel(), tuple(roots))


def usable(corners: FloatArray) -> npt.NDArray[np.bool_]:
    """Say which triangles (N, 3, 3) rays can hit: finite ones with an area, none farther than 1000 km.

    The bound keeps squares of coordinates inside float32.
    """
    bounded = np.all(np.abs(np.where(np.isfinite(corners), corners, 1e30)) < 1e6, axis=(1, 2))
    safe = np.where(bounded[:, None, None], corners, 0.0).astype(np.float64)
    doubled_area = np.linalg.norm(np.cross(safe[:, 1] - safe[:, 0], safe[:, 2] - safe[:, 0]), axis=1)
    hittable: npt.NDArray[np.bool_] = bounded & (doubled_area > 1e-14)
    return hittable


def _build_tree(
    corners: FloatArray, ids: IndexArray, node_base: int, leaf_base: int, width: int
) -> tuple[FloatArray, FloatArray]:
    if len(ids) == 0:
        return _empty_nodes(1, width), np.zeros((1, LEAF_STRIDE), np.float32)
    low, high = corners.min(axis=1), corners.max(axis=1)
    tree = _binary_tree(low, high)
    children = _collapse(tree, width)
    return _pack(tree, children, corners, ids, node_base, leaf_base)


def _half_area(low: FloatArray, high: FloatArray) -> FloatArray:
    size = np.maximum(high - low, 0)
    area: FloatArray = size[..., 0] * size[..., 1] + size[..., 1] * size[..., 2] + size[..., 2] * size[..., 0]
    return area


def _binary_tree(low: FloatArray, high: FloatArray) -> _BinaryTree:
    """Split all nodes of one level at once until none holds more than `LEAF_SIZE` triangles."""
    total = len(low)
    order = np.arange(total)
    center = (low + high) * np.float32(0.5)
    lefts, starts, counts = [np.full(1, -1)], [np.zeros(1, np.int64)], [np.full(1, total)]
    lows, highs = [low.min(axis=0)[None]], [high.max(axis=0)[None]]
    node_total = 1
    depth = 0
    while True:
        open_nodes = np.flatnonzero(counts[-1] > LEAF_SIZE)
        if len(open_nodes) == 0:
            break
        start, count = starts[-1][open_nodes], counts[-1][open_nodes]
        left_count = _partition(order, start, count, low, high, center, depth >= MEDIAN_DEPTH)
        lefts[-1][open_nodes] = node_total + 2 * np.arange(len(open_nodes))
        child_start = np.stack([start, start + left_count], axis=1).ravel()
        child_count = np.stack([left_count, count - left_count], axis=1).ravel()
        slots = _ranges(child_start, child_count)
        offsets = np.concatenate([[0], np.cumsum(child_count)[:-1]])
        lows.append(np.minimum.reduceat(low[order[slots]], offsets, axis=0))
        highs.append(np.maximum.reduceat(high[order[slots]], offsets, axis=0))
        lefts.append(np.full(len(child_start), -1))
        starts.append(child_start)
        counts.append(child_count)
        node_total += len(child_start)
        depth += 1
    return _BinaryTree(
        np.concatenate(lows),
        np.concatenate(highs),
        np.concatenate(lefts),
        np.concatenate(starts),
        np.concatenate(counts),
        order,
    )


def _ranges(start: IndexArray, count: IndexArray) -> IndexArray:
    """Concatenation of `arange(start, start + count)` of each row."""
    offsets = np.concatenate([[0], np.cumsum(count)[:-1]])
    ranges: IndexArray = np.arange(int(count.sum())) + np.repeat(start - offsets, count)
    return ranges


def _partition(
    order: IndexArray,
    start: IndexArray,
    count: IndexArray,
    low: FloatArray,
    high: FloatArray,
    center: FloatArray,
    at_median: bool,
) -> IndexArray:
    """Reorder each node's range of `order` in place, left triangles first; returns how many went left."""
    slots = _ranges(start, count)
    items = order[slots]
    node = np.repeat(np.arange(len(start)), count)
    offsets = np.concatenate([[0], np.cumsum(count)[:-1]])
    points = center[items]
    origin = np.minimum.reduceat(points, offsets, axis=0)
    extent = np.maximum.reduceat(points, offsets, axis=0) - origin
    bins = 16 if len(start) < 4096 else 8
    scale = np.where(extent > 0, bins * np.float32(0.9999) / np.maximum(extent, np.float32(1e-30)), 0)
    bin_index = np.minimum(((points - origin[node]) * scale[node]).astype(np.int64), bins - 1)
    axis, split, cost = _best_split(node, bin_index, low[items], high[items], len(start), bins)
    goes_right = bin_index[np.arange(len(node)), axis[node]] > split[node]
    by_median = np.full(len(start), at_median) | ~np.isfinite(cost)
    if by_median.any():
        rank = np.arange(len(node)) - offsets[node]
        goes_right = np.where(by_median[node], rank >= count[node] // 2, goes_right)
    left_count: IndexArray = np.bincount(node, weights=~goes_right, minlength=len(start)).astype(np.int64)
    lefts_before: IndexArray = np.cumsum(~goes_right) - ~goes_right
    rank_left: IndexArray = lefts_before - lefts_before[offsets][node]
    rank_right = (np.arange(len(node)) - offsets[node]) - rank_left
    target = start[node] + np.where(goes_right, left_count[node] + rank_right, rank_left)
    order[target] = items
    return left_count


def _best_split(
    node: IndexArray, bin_index: IndexArray, low: FloatArray, high: FloatArray, nodes: int, bins: int
) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Axis, last bin on the left and SAH cost of each node's cheapest split; infinite when there is none."""
    best_axis, best_split = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64)
    best_cost = np.full(nodes, np.inf, np.float32)
    for axis in range(3):
        key = node * bins + bin_index[:, axis]
        count = np.bincount(key, minlength=nodes * bins).reshape(nodes, bins)
        bin_low = np.full((3, nodes * bins), np.inf, np.float32)
        bin_high = np.full((3, nodes * bins), -np.inf, np.float32)
        for i in range(3):
            np.minimum.at(bin_low[i], key, low[:, i])
            np.maximum.at(bin_high[i], key, high[:, i])
        lows, highs = bin_low.reshape(3, nodes, bins), bin_high.reshape(3, nodes, bins)
        left_area = _swept_area(lows, highs)[:, :-1]
        right_area = _swept_area(lows[:, :, ::-1], highs[:, :, ::-1])[:, ::-1][:, 1:]
        left_count = np.cumsum(count, axis=1)[:, :-1]
        right_count = count.sum(axis=1, keepdims=True) - left_count
        cost = left_area * _blocks(left_count) + right_area * _blocks(right_count)
        cost = np.where((left_count > 0) & (right_count > 0), cost, np.inf).astype(np.float32)
        split = cost.argmin(axis=1)
        least = cost[np.arange(nodes), split]
        better = least < best_cost
        best_axis[better], best_split[better], best_cost[better] = axis, split[better], least[better]
    return best_axis, best_split, best_cost


def _blocks(count: IndexArray) -> IndexArray:
    """Leaves that so many triangles fill: a leaf costs the same to test whether it is full or not."""
    blocks: IndexArray = (count + LEAF_SIZE - 1) // LEAF_SIZE
    return blocks


def _swept_area(bin_low: FloatArray, bin_high: FloatArray) -> FloatArray:
    """Half areas (nodes, bins) of the union of all bins up to each one; 0 while that union is empty."""
    low = np.minimum.accumulate(bin_low, axis=2)
    high = np.maximum.accumulate(bin_high, axis=2)
    size = np.where(high >= low, high - np.where(np.isfinite(low), low, 0), 0)
    area: FloatArray = size[0] * size[1] + size[1] * size[2] + size[2] * size[0]
    return area


def _collapse(tree: _BinaryTree, width: int) -> list[IndexArray]:
    """Wide nodes level by level, each (M, width) binary node ids with -1 for empty slots."""
    area = tree.area()
    levels = []
    heads = np.zeros(1, np.int64)
    while len(heads):
        slots = np.full((len(heads), width), -1)
        slots[:, 0] = heads
        used = np.ones(len(heads), np.int64)
        for _ in range(width - 1):
            inner = (slots >= 0) & (tree.left[slots] >= 0)
            widest = np.where(inner, area[slots], -1).argmax(axis=1)
            rows = np.flatnonzero(inner.any(axis=1))
            left = tree.left[slots[rows, widest[rows]]]
            slots[rows, widest[rows]] = left
            slots[rows, used[rows]] = left + 1
            used[rows] += 1
        levels.append(slots)
        flat = slots.ravel()
        heads = flat[(flat >= 0) & (tree.left[flat] >= 0)]
    return levels


def _empty_nodes(count: int, width: int) -> FloatArray:
    """Nodes whose children all have inverted boxes, which no ray enters."""
    nodes = np.zeros((count, 8 * width), np.float32)
    nodes[:, 0 : 3 * width] = 1e30
    nodes[:, 3 * width : 6 * width] = -1e30
    nodes[:, 6 * width : 7 * width].view(np.int32)[:] = EMPTY_CHILD
    return nodes


def _pack(
    tree: _BinaryTree,
    levels: list[IndexArray],
    corners: FloatArray,
    ids: IndexArray,
    node_base: int,
    leaf_base: int,
) -> tuple[FloatArray, FloatArray]:
    slots = np.concatenate(levels)
    width = slots.shape[1]
    flat = slots.ravel()
    is_leaf = (flat >= 0) & (tree.left[flat] < 0)
    is_inner = (flat >= 0) & ~is_leaf
    reference = np.full(len(flat), EMPTY_CHILD, np.int64)
    reference[is_leaf] = ~(leaf_base + np.arange(int(is_leaf.sum())))
    # Level order: the wide nodes below the root appear in the order in which their heads do.
    reference[is_inner] = node_base + 1 + np.arange(int(is_inner.sum()))
    nodes = _empty_nodes(len(slots), width)
    used = slots >= 0
    for axis in range(3):
        low = nodes[:, axis * width : (axis + 1) * width]
        high = nodes[:, (3 + axis) * width : (4 + axis) * width]
        low[used] = tree.low[slots[used], axis]
        high[used] = tree.high[slots[used], axis]
    nodes[:, 6 * width : 7 * width].view(np.int32)[:] = reference.reshape(-1, width)
    return nodes, _pack_leaves(tree, flat[is_leaf], corners, ids)


def _pack_leaves(tree: _BinaryTree, leaf: IndexArray, corners: FloatArray, ids: IndexArray) -> FloatArray:
    start, count = tree.start[leaf], tree.count[leaf]
    lane = np.arange(LEAF_SIZE)
    filled = lane[None, :] < count[:, None]
    item = tree.order[np.minimum(start[:, None] + lane, len(tree.order) - 1)]
    return pack_leaves(corners[item], np.where(filled, ids[item], -1))


def pack_leaves(corner: FloatArray, ids: IndexArray) -> FloatArray:
    """Leaves as rows, of the corners (L, 4, 3, 3) and ids (L, 4) of their triangles."""
    edges = np.stack([corner[:, :, 0], corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]], axis=2)
    edges = np.where((ids >= 0)[:, :, None, None], edges, 0)
    leaves = np.zeros((len(ids), LEAF_STRIDE), np.float32)
    leaves[:, : 9 * LEAF_SIZE] = edges.transpose(0, 2, 3, 1).reshape(len(ids), -1)
    leaves[:, 9 * LEAF_SIZE :].view(np.int32)[:] = ids
    return leaves
