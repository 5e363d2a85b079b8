"""Bounding volume hierarchy: the binary tree of `binary_tree`, collapsed to wide nodes.

Collapse: Wald, Benthin, Boulos, "Getting rid of packets", RT 2008 (open the child of largest area first).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi import _ti, binary_tree
from benchbot_sim_taichi.binary_tree import BinaryTree, FloatArray, IndexArray

WIDTH = 8
NARROW = 4  # on a GPU
LEAF_SIZE = 4
NODE_STRIDE = 8 * WIDTH
LEAF_STRIDE = 40
STACK_SIZE = 64
EMPTY_CHILD = np.int32(2**31 - 1)


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
    width: int = WIDTH


@dataclass(frozen=True)
class Grown:
    """A group's binary tree, None where nothing is left of it, over triangles: `corners` (N, 3, 3) and `ids` (N,)."""

    tree: BinaryTree | None
    corners: FloatArray
    ids: IndexArray


def build(
    vertices: FloatArray, triangles: npt.NDArray[np.int32], groups: tuple[IndexArray, ...], width: int = WIDTH
) -> Bvh:
    """Build one tree per group of triangle ids, of nodes with up to `width` children.

    Triangles that are not finite or have no area are left out.
    """
    nodes, leaves, roots = [], [], []
    node_base = leaf_base = 0
    for ids in groups:
        group = _grow(vertices[triangles[ids]].reshape(-1, 3, 3), ids)
        tree_nodes, tree_leaves = _empty_nodes(1, width), np.zeros((1, LEAF_STRIDE), np.float32)
        if group.tree is not None:
            levels = _collapse(group.tree, width)
            tree_nodes, tree_leaves = _pack(group.tree, levels, group.corners, group.ids, node_base, leaf_base)
        nodes.append(tree_nodes)
        leaves.append(tree_leaves)
        roots.append(node_base)
        node_base += len(tree_nodes)
        leaf_base += len(tree_leaves)
    return Bvh(np.concatenate(nodes).ravel(), np.concatenate(leaves).ravel(), tuple(roots), width)


def usable(corners: FloatArray) -> npt.NDArray[np.bool_]:
    """Say which triangles (N, 3, 3) rays can hit: finite ones with an area, none farther than 1000 km.

    The bound keeps squares of coordinates inside float32.
    """
    bounded = np.all(np.abs(np.where(np.isfinite(corners), corners, 1e30)) < 1e6, axis=(1, 2))
    safe = np.where(bounded[:, None, None], corners, 0.0).astype(np.float64)
    doubled_area = np.linalg.norm(np.cross(safe[:, 1] - safe[:, 0], safe[:, 2] - safe[:, 0]), axis=1)
    hittable: npt.NDArray[np.bool_] = bounded & (doubled_area > 1e-14)
    return hittable


def _grow(corners: FloatArray, ids: IndexArray) -> Grown:
    is_usable = usable(corners)
    corners, ids = corners[is_usable], ids[is_usable]
    if len(ids) == 0:
        return Grown(None, corners, ids)
    one, two, three = corners[:, 0], corners[:, 1], corners[:, 2]  # pairs take a third of the time of min(axis=1)
    low, high = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
    return Grown(binary_tree.grow(low, high, LEAF_SIZE, compiled=_ti.is_on_processor()), corners, ids)


def _collapse(tree: BinaryTree, width: int) -> list[IndexArray]:
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
    tree: BinaryTree,
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


def _pack_leaves(tree: BinaryTree, leaf: IndexArray, corners: FloatArray, ids: IndexArray) -> FloatArray:
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
