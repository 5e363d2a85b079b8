"""A binary tree of boxes, split by a binned surface-area heuristic, level by level.

Wald, "On fast construction of SAH-based bounding volume hierarchies", RT 2007. On a processor the splits are compiled
(`kernels.splitting`), several nodes at a time; on a GPU, whose threads are too slow for the large nodes at the top,
numpy works out those of a whole level at once.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float32]
IndexArray = npt.NDArray[np.int64]

MEDIAN_DEPTH = 48
MAX_PIECES = 256
BOX_STRIDE = 6


@dataclass(frozen=True)
class BinaryTree:
    """Nodes in the order of their levels; a leaf's items are `count` of `order` from `start` on."""

    low: FloatArray
    high: FloatArray
    left: IndexArray  # -1 for leaves; the right child is left + 1
    start: IndexArray
    count: IndexArray
    order: IndexArray

    def area(self) -> FloatArray:
        """Half the areas of the nodes' boxes."""
        return _half_area(self.low, self.high)


class Splitter(Protocol):
    """An algorithm that splits the nodes of a tree."""

    def split(self, start: IndexArray, count: IndexArray, at_median: bool) -> tuple[IndexArray, FloatArray, FloatArray]:
        """Reorder each node's items, left ones first; return the counts of these, and low and high of all children."""

    @property
    def order(self) -> IndexArray:
        """The indices of the items in their current order."""


def grow(low: FloatArray, high: FloatArray, leaf_size: int, *, compiled: bool) -> BinaryTree:
    """Split all nodes of one level at once until none holds more than `leaf_size` of the boxes (N, 3), N > 0.

    `compiled` is allowed only if kernels run on the processor.
    """
    splitter: Splitter = (CompiledSplitter if compiled else NumpySplitter)(low, high, leaf_size)
    lefts, starts, counts = [np.full(1, -1)], [np.zeros(1, np.int64)], [np.full(1, len(low))]
    lows, highs = [low.min(axis=0)[None]], [high.max(axis=0)[None]]
    node_total = 1
    while True:
        open_nodes = np.flatnonzero(counts[-1] > leaf_size)
        if len(open_nodes) == 0:
            break
        start, count = starts[-1][open_nodes], counts[-1][open_nodes]
        left_count, child_low, child_high = splitter.split(start, count, len(counts) > MEDIAN_DEPTH)
        lefts[-1][open_nodes] = node_total + 2 * np.arange(len(open_nodes))
        starts.append(np.stack([start, start + left_count], axis=1).ravel())
        counts.append(np.stack([left_count, count - left_count], axis=1).ravel())
        lows.append(child_low)
        highs.append(child_high)
        lefts.append(np.full(2 * len(open_nodes), -1))
        node_total += 2 * len(open_nodes)
    return BinaryTree(
        np.concatenate(lows),
        np.concatenate(highs),
        np.concatenate(lefts),
        np.concatenate(starts),
        np.concatenate(counts),
        splitter.order,
    )


class CompiledSplitter:
    """Splits with a kernel; moves the boxes along with their numbers, so that those of a node lie together."""

    def __init__(self, low: FloatArray, high: FloatArray, leaf_size: int) -> None:
        self._boxes = np.ascontiguousarray(np.concatenate([low, high], axis=1), np.float32).ravel()
        self._order = np.arange(len(low), dtype=np.int32)
        self._leaf_size = leaf_size

    @property
    def order(self) -> IndexArray:
        """The indices of the items in their current order."""
        return self._order.astype(np.int64)

    def split(self, start: IndexArray, count: IndexArray, at_median: bool) -> tuple[IndexArray, FloatArray, FloatArray]:
        """Split nodes; see `Splitter`."""
        from benchbot_sim_taichi.kernels import splitting

        nodes, pieces = len(start), min(len(start), MAX_PIECES)
        left_count = np.zeros(nodes, np.int32)
        children = np.zeros(nodes * 2 * BOX_STRIDE, np.float32)
        splitting.split_nodes(
            self._boxes,
            self._order,
            start.astype(np.int32),
            count.astype(np.int32),
            left_count,
            children,
            np.zeros(pieces * splitting.SCRATCH_STRIDE, np.float32),
            nodes,
            pieces,
            self._leaf_size,
            int(at_median),
        )
        boxes = children.reshape(-1, BOX_STRIDE)
        return left_count.astype(np.int64), boxes[:, :3], boxes[:, 3:]


class NumpySplitter:
    """Splits with numpy, coordinate by coordinate: rows of them are read in a row, and gathered in half the time."""

    def __init__(self, low: FloatArray, high: FloatArray, leaf_size: int) -> None:
        # Least of both: one operation finds the box about some.
        self._ends = np.ascontiguousarray(np.concatenate([low.T, -high.T]))
        self._leaf_size = leaf_size
        self.order = np.arange(len(low))

    def split(self, start: IndexArray, count: IndexArray, at_median: bool) -> tuple[IndexArray, FloatArray, FloatArray]:
        """Split nodes; see `Splitter`."""
        slots, offsets = _ranges(start, count), np.cumsum(count) - count
        items, node = self.order[slots], np.repeat(np.arange(len(start)), count)
        ends = self._ends.take(items, axis=1)  # rows stay rows, which an index would not leave
        goes_right = self._goes_right(ends, node, count, at_median)
        # By node and side, each side in the order of before.
        moved = np.argsort(2 * node + goes_right, kind="stable")
        left_count: IndexArray = count - np.add.reduceat(goes_right, offsets, dtype=np.int64)
        self.order[slots] = items[moved]
        child_start = np.stack([offsets, offsets + left_count], axis=1).ravel()
        boxes = np.minimum.reduceat(ends.take(moved, axis=1), child_start, axis=1).T
        return left_count, boxes[:, :3], -boxes[:, 3:]

    def _goes_right(
        self, ends: FloatArray, node: IndexArray, count: IndexArray, at_median: bool
    ) -> npt.NDArray[np.bool_]:
        """Say which items, in the order of their nodes, go to the right child."""
        offsets = np.cumsum(count) - count
        points = (ends[:3] - ends[3:]) * np.float32(0.5)
        origin = np.minimum.reduceat(points, offsets, axis=1)
        extent = np.maximum.reduceat(points, offsets, axis=1) - origin
        bins = 16 if len(count) < 4096 else 8
        scale = np.where(extent > 0, bins * np.float32(0.9999) / np.maximum(extent, np.float32(1e-30)), 0)
        along = (points - np.repeat(origin, count, axis=1)) * np.repeat(scale, count, axis=1)
        bin_index = np.minimum(along.astype(np.uint8), bins - 1)
        axis, split, cost = _best_split(node, bin_index, ends, len(count), bins, self._leaf_size)
        goes_right: npt.NDArray[np.bool_] = bin_index[np.repeat(axis, count), np.arange(len(node))] > np.repeat(
            split, count
        )
        by_median = np.full(len(count), at_median) | ~np.isfinite(cost)
        if by_median.any():
            rank = np.arange(len(node)) - np.repeat(offsets, count)
            goes_right = np.where(np.repeat(by_median, count), rank >= np.repeat(count // 2, count), goes_right)
        return goes_right


def _half_area(low: FloatArray, high: FloatArray) -> FloatArray:
    size = np.maximum(high - low, 0)
    area: FloatArray = size[..., 0] * size[..., 1] + size[..., 1] * size[..., 2] + size[..., 2] * size[..., 0]
    return area


def _ranges(start: IndexArray, count: IndexArray) -> IndexArray:
    """Concatenation of `arange(start, start + count)` of each row."""
    offsets = np.concatenate([[0], np.cumsum(count)[:-1]])
    ranges: IndexArray = np.arange(int(count.sum())) + np.repeat(start - offsets, count)
    return ranges


def _best_split(
    node: IndexArray, bin_index: npt.NDArray[np.uint8], ends: FloatArray, nodes: int, bins: int, leaf_size: int
) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Axis, last bin on the left and SAH cost of each node's cheapest split; infinite when there is none.

    `ends` (6, N) are lows and negated highs of the items, `bin_index` (3, N) their bins along each axis.
    """
    best_axis, best_split = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64)
    best_cost = np.full(nodes, np.inf, np.float32)
    for axis, bin_of in enumerate(bin_index):
        # Items are in the order of their nodes: sorted by bins, those of one bin of one node follow one another.
        order = np.argsort(bin_of, kind="stable")
        count = np.bincount(bin_of * np.int64(nodes) + node, minlength=bins * nodes)
        filled = np.flatnonzero(count)
        of_bins = np.full((6, bins * nodes), np.inf, np.float32)
        of_bins[:, filled] = np.minimum.reduceat(
            ends.take(order, axis=1), np.cumsum(count[filled]) - count[filled], axis=1
        )
        boxes, count = of_bins.reshape(6, bins, nodes), count.reshape(bins, nodes)
        left_area = _swept_area(boxes)[:-1]
        right_area = _swept_area(boxes[:, ::-1])[::-1][1:]
        left_count = np.cumsum(count, axis=0)[:-1]
        right_count = count.sum(axis=0) - left_count
        cost = left_area * _blocks(left_count, leaf_size) + right_area * _blocks(right_count, leaf_size)
        cost = np.where((left_count > 0) & (right_count > 0), cost, np.inf).astype(np.float32)
        split = cost.argmin(axis=0)
        least = cost[split, np.arange(nodes)]
        better = least < best_cost
        best_axis[better], best_split[better], best_cost[better] = axis, split[better], least[better]
    return best_axis, best_split, best_cost


def _blocks(count: IndexArray, leaf_size: int) -> IndexArray:
    """Leaves that so many triangles fill: a leaf costs the same to test whether it is full or not."""
    blocks: IndexArray = (count + leaf_size - 1) // leaf_size
    return blocks


def _swept_area(boxes: FloatArray) -> FloatArray:
    """Half areas (bins, nodes) of the union of all bins up to each one; 0 while that union is empty."""
    union = np.minimum.accumulate(boxes, axis=1)
    size = np.where(np.isfinite(union[:3]), -union[3:] - union[:3], 0)
    area: FloatArray = size[0] * size[1] + size[1] * size[2] + size[2] * size[0]
    return area
