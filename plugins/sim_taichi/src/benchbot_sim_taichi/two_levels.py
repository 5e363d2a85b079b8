"""Trees that change: one for what stands still, one for each object that has moved, and nodes above them all.

Nodes and leaves stay those of `bvh`, so that rays know of no levels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi.binary_tree import FloatArray
from benchbot_sim_taichi.bvh import (
    EMPTY_CHILD,
    LEAF_SIZE,
    LEAF_STRIDE,
    Bvh,
    pack_leaves,
)

NO_ROOT = -1
IDS = slice(9 * LEAF_SIZE, 10 * LEAF_SIZE)


@dataclass(frozen=True)
class Levels:
    """The tree of what has not moved, and those of the objects that have; all with nodes of one width."""

    static: Bvh
    parts: Mapping[int, Bvh] = field(default_factory=dict)

    def combined(self) -> Bvh:
        """One tree of everything."""
        return combined(self.static, list(self.parts.values()))

    def with_part(self, instance: int, tree: Bvh) -> "Levels":
        """The same with an object's tree put in, or put in place of another."""
        return replace(self, parts={**self.parts, instance: tree})

    def without_part(self, instance: int) -> "Levels":
        """The same without an object that has a tree of its own."""
        return replace(self, parts={index: tree for index, tree in self.parts.items() if index != instance})

    def without(self, is_gone: npt.NDArray[np.bool_]) -> "Levels":
        """The same without the triangles that `is_gone` (T,) marks, none of which has moved."""
        return replace(self, static=without(self.static, is_gone))


def without(tree: Bvh, is_gone: npt.NDArray[np.bool_]) -> Bvh:
    """The tree without the triangles that `is_gone` (T,) marks; boxes stay as they are."""
    leaves = tree.leaves.reshape(-1, LEAF_STRIDE).copy()
    ids = leaves[:, IDS].view(np.int32)
    gone = (ids >= 0) & is_gone[np.maximum(ids, 0)]
    leaves[:, : IDS.start][np.tile(gone, (1, 9))] = 0.0
    ids[gone] = -1
    return replace(tree, leaves=leaves.ravel())


def refitted(tree: Bvh, vertices: FloatArray, triangles: npt.NDArray[np.int32]) -> Bvh:
    """The tree around the same triangles with other corners: as exact as one built anew, its splits being the old."""
    ids = tree.leaves.reshape(-1, LEAF_STRIDE)[:, IDS].view(np.int32)
    corners = vertices[triangles[np.maximum(ids, 0)]]
    filled = (ids >= 0)[:, :, None, None]
    # Point by point: reducing along short axes takes numpy ten times as long.
    leaf_low = _folded(np.minimum, np.where(filled, corners, np.float32(1e30)).reshape(len(ids), -1, 3))
    leaf_high = _folded(np.maximum, np.where(filled, corners, np.float32(-1e30)).reshape(len(ids), -1, 3))
    width = tree.width
    nodes = tree.nodes.reshape(-1, 8 * width).copy()
    children = _children(nodes)
    boxes = nodes[:, : 6 * width].reshape(-1, 6, width)
    for level in reversed(_levels(children, tree.roots)):
        child = children[level]
        is_leaf, is_node = child < 0, (child >= 0) & (child != EMPTY_CHILD)
        inner = child[is_node]
        low = _folded(np.minimum, boxes[inner, :3].transpose(0, 2, 1))
        high = _folded(np.maximum, boxes[inner, 3:].transpose(0, 2, 1))
        level_low = np.full((*child.shape, 3), np.float32(1e30))
        level_high = -level_low
        level_low[is_leaf], level_high[is_leaf] = leaf_low[~child[is_leaf]], leaf_high[~child[is_leaf]]
        level_low[is_node], level_high[is_node] = low, high
        boxes[level, :3] = level_low.transpose(0, 2, 1)
        boxes[level, 3:] = level_high.transpose(0, 2, 1)
    nodes[:, : 6 * width] = boxes.reshape(-1, 6 * width)
    return replace(tree, nodes=nodes.ravel(), leaves=pack_leaves(corners, ids.astype(np.int64)).ravel())


def _children(nodes: FloatArray) -> npt.NDArray[np.int32]:
    """The references (N, width) to children of nodes (N, 8 × width), to be changed in place."""
    width = nodes.shape[1] // 8
    return nodes[:, 6 * width : 7 * width].view(np.int32)


def _folded(extreme: np.ufunc, points: FloatArray) -> FloatArray:
    """The least or greatest (N, 3) of points (N, M, 3)."""
    folded: FloatArray = reduce(extreme, (points[:, i] for i in range(points.shape[1])))
    return folded


def _levels(children: npt.NDArray[np.int32], roots: Sequence[int]) -> list[npt.NDArray[np.int32]]:
    """Nodes by their depth below the roots."""
    levels = []
    level = np.array(roots, np.int32)
    while len(level):
        levels.append(level)
        below = children[level].ravel()
        level = below[(below >= 0) & (below != EMPTY_CHILD)]
    return levels


def combined(static: Bvh, parts: Sequence[Bvh]) -> Bvh:
    """One tree of all: group by group the static triangles' and the parts', below a node of their own.

    As in any tree here, the first group's root is node 0. A group without any triangle has the root `NO_ROOT`.
    """
    width = static.width
    static_nodes = static.nodes.reshape(-1, 8 * width)
    # Node 0 makes room for the root of all.
    blocks, leaves = [static_nodes, static_nodes[:1]], [static.leaves]
    moved_root = len(static_nodes)
    roots: list[list[int]] = [[moved_root if root == 0 else root] if root >= 0 else [] for root in static.roots]
    node_base, leaf_base = len(static_nodes) + 1, len(static.leaves) // LEAF_STRIDE
    for part in parts:
        nodes = part.nodes.reshape(-1, 8 * width).copy()
        child = _children(nodes)
        is_node = (child >= 0) & (child != EMPTY_CHILD)
        child[is_node] += node_base
        child[child < 0] -= leaf_base
        for group, root in zip(roots, part.roots, strict=True):
            group.append(node_base + root)
        blocks.append(nodes)
        leaves.append(part.leaves)
        node_base += len(nodes)
        leaf_base += len(part.leaves) // LEAF_STRIDE
    nodes = np.concatenate(blocks)
    tops: list[FloatArray] = []
    tree_roots = []
    for group in roots:
        low = nodes[group, : 3 * width].reshape(-1, 3, width).min(axis=2)
        high = nodes[group, 3 * width : 6 * width].reshape(-1, 3, width).max(axis=2)
        used = np.flatnonzero((low <= high).all(axis=1))
        top = _top(np.array(group, np.int32)[used], low[used], high[used], tops, len(nodes), width)
        tree_roots.append(top if len(used) else NO_ROOT)
    nodes = np.concatenate([nodes, *tops])
    no_box = np.zeros((0, 3))
    nothing = _row(np.zeros(0, np.int32), no_box, no_box, width)
    nodes[0] = nothing if tree_roots[0] == NO_ROOT else nodes[tree_roots[0]]
    return replace(static, nodes=nodes.ravel(), leaves=np.concatenate(leaves), roots=(0, *tree_roots[1:]))


def _top(
    nodes: npt.NDArray[np.int32], low: FloatArray, high: FloatArray, rows: list[FloatArray], base: int, width: int
) -> int:
    """Put nodes with these boxes below one that is appended to `rows`, which start at node `base`; returns which."""
    if len(nodes) > width:
        center = low + high
        order = np.argsort(center[:, int(np.ptp(center, axis=0).argmax())], kind="stable")
        chunks = np.array_split(order, width)
        heads = [_top(nodes[chunk], low[chunk], high[chunk], rows, base, width) for chunk in chunks]
        nodes = np.array(heads, np.int32)
        low = np.stack([low[chunk].min(axis=0) for chunk in chunks])
        high = np.stack([high[chunk].max(axis=0) for chunk in chunks])
    rows.append(_row(nodes, low, high, width)[None])
    return base + len(rows) - 1


def _row(
    nodes: npt.NDArray[np.int32], low: npt.NDArray[np.floating], high: npt.NDArray[np.floating], width: int
) -> FloatArray:
    """A node with these children."""
    row = np.zeros((1, 8 * width), np.float32)
    boxes = row[0, : 6 * width].reshape(6, width)
    boxes[:3], boxes[3:] = 1e30, -1e30
    boxes[:3, : len(nodes)], boxes[3:, : len(nodes)] = low.T, high.T
    _children(row)[0] = EMPTY_CHILD
    _children(row)[0, : len(nodes)] = nodes
    filled: FloatArray = row[0]
    return filled
