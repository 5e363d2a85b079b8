# mypy: ignore-errors
"""The splits of `benchbot_sim_taichi.binary_tree`, compiled: one thread a node, so that they are always the same."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, vec3

BINS = 16
BIN_STRIDE = 8
AXIS_STRIDE = BINS * BIN_STRIDE
SCRATCH_STRIDE = 3 * AXIS_STRIDE
FEW_TRIANGLES = 32
FEW_BINS = 8
BOX_STRIDE = 6
LEAST_TURNS = 512  # of a loop: Taichi gives no thread fewer


@ti.func
def corner(boxes: ti.template(), at):
    """Three consecutive values."""
    return vec3(boxes[at], boxes[at + 1], boxes[at + 2])


@ti.func
def half_area(low, high):
    """Half the area of a box, 0 where it is empty."""
    size = ti.max(high - low, 0.0)
    return size.x * size.y + size.y * size.z + size.z * size.x


@ti.func
def blocks(count, leaf_size):
    """Leaves that so many triangles fill."""
    return ti.cast((ti.cast(count, ti.i32) + leaf_size - 1) // leaf_size, ti.f32)


@ti.func
def middle_bin(boxes: ti.template(), item, axis, low, scale, bins):
    """Return the bin of an axis in which a box's middle (doubled, as `low` is) lies."""
    at = item * BOX_STRIDE + axis
    return ti.min(ti.cast((boxes[at] + boxes[at + 3] - low) * scale, ti.i32), bins - 1)


@ti.func
def add_box(target: ti.template(), at, low, high):
    """Extend the box of six values from `at` on to contain another."""
    for i in ti.static(range(3)):
        target[at + i] = ti.min(target[at + i], low[i])
        target[at + 3 + i] = ti.max(target[at + 3 + i], high[i])


@ti.kernel
def split_nodes(
    boxes: floats,
    order: ints,
    starts: ints,
    counts: ints,
    left_counts: ints,
    children: floats,
    scratch: floats,
    nodes: ti.i32,
    pieces: ti.i32,
    leaf_size: ti.i32,
    at_median: ti.i32,
):
    """Reorder each node's range of `boxes` (6 a triangle) and `order` in place, left triangles first.

    `left_counts` takes how many went left, `children` (12 a node) the boxes of both sides. Scratch is
    `SCRATCH_STRIDE` a piece.
    """
    for turn in range(pieces * LEAST_TURNS):
        piece = turn // LEAST_TURNS
        mine = piece * SCRATCH_STRIDE
        node = ti.select(turn % LEAST_TURNS == 0, piece, nodes)
        while node < nodes:
            first = starts[node]
            size = counts[node]
            low = vec3(FAR)
            high = vec3(-FAR)
            for item in range(first, first + size):
                middle = corner(boxes, item * BOX_STRIDE) + corner(boxes, item * BOX_STRIDE + 3)
                low = ti.min(low, middle)
                high = ti.max(high, middle)
            bins = ti.select(size > FEW_TRIANGLES, BINS, FEW_BINS)
            extent = high - low
            scale = vec3(0.0)
            for axis in ti.static(range(3)):
                if extent[axis] > 0.0:
                    scale[axis] = ti.cast(bins, ti.f32) * 0.9999 / ti.max(extent[axis], 1e-30)
                for bin_ in range(bins):
                    at = mine + axis * AXIS_STRIDE + bin_ * BIN_STRIDE
                    for i in ti.static(range(3)):
                        scratch[at + i] = FAR
                        scratch[at + 3 + i] = -FAR
                    scratch[at + 6] = 0.0
            for item in range(first, first + size):
                box_low = corner(boxes, item * BOX_STRIDE)
                box_high = corner(boxes, item * BOX_STRIDE + 3)
                for axis in ti.static(range(3)):
                    bin_ = middle_bin(boxes, item, axis, low[axis], scale[axis], bins)
                    at = mine + axis * AXIS_STRIDE + bin_ * BIN_STRIDE
                    add_box(scratch, at, box_low, box_high)
                    scratch[at + 6] += 1.0

            best_cost = FAR
            best_axis = 0
            best_bin = -1
            for axis in range(3):
                base = mine + axis * AXIS_STRIDE
                swept_low = vec3(FAR)
                swept_high = vec3(-FAR)
                count = 0.0
                for back in range(bins - 1):  # what lies right of each bin
                    at = base + (bins - 1 - back) * BIN_STRIDE
                    swept_low = ti.min(swept_low, corner(scratch, at))
                    swept_high = ti.max(swept_high, corner(scratch, at + 3))
                    count += scratch[at + 6]
                    scratch[at - 1] = half_area(swept_low, swept_high) * blocks(count, leaf_size)
                swept_low = vec3(FAR)
                swept_high = vec3(-FAR)
                count = 0.0
                for bin_ in range(bins - 1):
                    at = base + bin_ * BIN_STRIDE
                    swept_low = ti.min(swept_low, corner(scratch, at))
                    swept_high = ti.max(swept_high, corner(scratch, at + 3))
                    count += scratch[at + 6]
                    if 0.0 < count < ti.cast(size, ti.f32):
                        cost = half_area(swept_low, swept_high) * blocks(count, leaf_size) + scratch[at + 7]
                        if cost < best_cost:
                            best_cost = cost
                            best_axis = axis
                            best_bin = bin_

            out = node * 2 * BOX_STRIDE
            for i in ti.static(range(3)):
                children[out + i] = FAR
                children[out + 3 + i] = -FAR
                children[out + 6 + i] = FAR
                children[out + 9 + i] = -FAR
            left = size // 2
            if best_bin >= 0 and at_median == 0:
                axis_low = ti.select(best_axis == 0, low.x, ti.select(best_axis == 1, low.y, low.z))
                axis_scale = ti.select(best_axis == 0, scale.x, ti.select(best_axis == 1, scale.y, scale.z))
                head = first
                tail = first + size - 1
                while head <= tail:
                    if middle_bin(boxes, head, best_axis, axis_low, axis_scale, bins) <= best_bin:
                        head += 1
                    else:
                        for i in ti.static(range(BOX_STRIDE)):
                            held = boxes[head * BOX_STRIDE + i]
                            boxes[head * BOX_STRIDE + i] = boxes[tail * BOX_STRIDE + i]
                            boxes[tail * BOX_STRIDE + i] = held
                        number = order[head]
                        order[head] = order[tail]
                        order[tail] = number
                        tail -= 1
                if first < head < first + size:  # else rounding has undone the split
                    left = head - first
            for item in range(first, first + size):
                side = out + ti.select(item < first + left, 0, BOX_STRIDE)
                add_box(children, side, corner(boxes, item * BOX_STRIDE), corner(boxes, item * BOX_STRIDE + 3))
            left_counts[node] = left
            node += pieces
