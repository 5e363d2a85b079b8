# mypy: ignore-errors
"""Rays against a tree of four-wide nodes, for a GPU.

There, arrays that are indexed at run time lie in memory, and setting them up for every ray takes longer than the ray
itself (measured on an H200: 1.4 times the rays without). So all that belongs to a node stays in registers, sorted by
a network; only the stack is an array, in the block's shared memory.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.bvh import EMPTY_CHILD, LEAF_SIZE, LEAF_STRIDE
from benchbot_sim_taichi.kernels.traversal import EDGE, FAR, Hit, safe_inverse, vec3

BLOCK = 128
WIDTH = 4
NODE_STRIDE = 8 * WIDTH
STACK_SIZE = 48  # no ray can need more than 42 in rooms of 150,000 and 200,000 triangles
EMPTY = int(EMPTY_CHILD)
MISSED = 0x7FFFFFFF
SLOT = WIDTH - 1
SORTING_NETWORK = ((0, 1), (2, 3), (0, 2), (1, 3), (1, 2))


@ti.func
def trace_gpu(
    nodes: ti.template(),
    leaves: ti.template(),
    root: ti.i32,
    then: ti.i32,
    origin: vec3,
    direction: vec3,
    t_max: ti.f32,
    thread: ti.i32,
    any_hit: ti.i32,
):
    """Nearest hit in (0, t_max) below `root` and `then` (-1 where there is no second root), as from `traversal.trace`.

    When `any_hit` is not 0, any hit below `root` is as good, and ends the search; whether there was one, also says the
    second value. `thread` is the number of the ray's thread in its block.
    """
    stack = ti.simt.block.SharedArray((STACK_SIZE * BLOCK,), ti.i32)
    hit = Hit(t=t_max, triangle=-1, u=0.0, v=0.0)
    inv_x, inv_y, inv_z = safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z)
    near_x = ti.select(inv_x >= 0.0, 0, 3 * WIDTH)
    near_y = ti.select(inv_y >= 0.0, WIDTH, 4 * WIDTH)
    near_z = ti.select(inv_z >= 0.0, 2 * WIDTH, 5 * WIDTH)
    far_x, far_y, far_z = 3 * WIDTH - near_x, 5 * WIDTH - near_y, 7 * WIDTH - near_z
    ox, oy, oz = -origin.x * inv_x, -origin.y * inv_y, -origin.z * inv_z
    top = thread
    current = root
    is_first = 1
    if then >= 0:
        stack[top] = then
        top += BLOCK
    # A ray with a NaN must not enter: it would hit every box.
    length2 = direction.dot(direction) + 0.0 * origin.dot(origin)
    if not ((length2 > 1e-20) & (length2 < 1e20)):
        current = EMPTY
    while current != EMPTY:
        if current >= 0:
            base = current * NODE_STRIDE
            key = ti.Vector([0] * WIDTH, dt=ti.i32)
            for i in ti.static(range(WIDTH)):
                near = ti.max(
                    ti.max(nodes[base + near_x + i] * inv_x + ox, nodes[base + near_y + i] * inv_y + oy),
                    ti.max(nodes[base + near_z + i] * inv_z + oz, 0.0),
                )
                far = ti.min(
                    ti.min(nodes[base + far_x + i] * inv_x + ox, nodes[base + far_y + i] * inv_y + oy),
                    ti.min(nodes[base + far_z + i] * inv_z + oz, hit.t),
                )
                # Bits of distances that are not negative sort as integers; the lowest two make room for the slot.
                bits = (ti.bit_cast(near, ti.i32) & ~SLOT) | i
                key[i] = ti.select(near <= far * 1.0000004, bits, MISSED)
            for low, high in ti.static(SORTING_NETWORK):
                lesser, greater = ti.min(key[low], key[high]), ti.max(key[low], key[high])
                key[low] = lesser
                key[high] = greater
            for i in ti.static((3, 2, 1)):
                if key[i] != MISSED and top < STACK_SIZE * BLOCK:
                    stack[top] = ti.bit_cast(nodes[base + 6 * WIDTH + (key[i] & SLOT)], ti.i32)
                    top += BLOCK
            current = EMPTY
            if key[0] != MISSED:
                current = ti.bit_cast(nodes[base + 6 * WIDTH + (key[0] & SLOT)], ti.i32)
        else:
            base = (~current) * LEAF_STRIDE
            for i in ti.static(range(LEAF_SIZE)):
                corner = vec3(leaves[base + i], leaves[base + 4 + i], leaves[base + 8 + i])
                edge1 = vec3(leaves[base + 12 + i], leaves[base + 16 + i], leaves[base + 20 + i])
                edge2 = vec3(leaves[base + 24 + i], leaves[base + 28 + i], leaves[base + 32 + i])
                p = direction.cross(edge2)
                det = edge1.dot(p)
                inv_det = 1.0 / det
                s = origin - corner
                q = s.cross(edge1)
                u = s.dot(p) * inv_det
                v = direction.dot(q) * inv_det
                t = edge2.dot(q) * inv_det
                far = ti.abs(s).sum()
                wide = ti.abs(edge1).sum() + ti.abs(edge2).sum()
                inside = ti.min(ti.min(u, v), 1.0 - u - v) + EDGE * far * wide * ti.abs(inv_det)
                if det != 0.0 and inside >= 0.0 and t > 0.0 and t < hit.t:
                    hit = Hit(t=t, triangle=ti.bit_cast(leaves[base + 36 + i], ti.i32), u=u, v=v)
            current = EMPTY
            if (any_hit & is_first) != 0 and hit.triangle >= 0:
                break
        if current == EMPTY and top >= BLOCK:
            top -= BLOCK
            current = stack[top]
            is_first = ti.select(then >= 0 and top == thread, 0, is_first)
    if hit.triangle < 0:
        hit.t = FAR
    return hit, (any_hit & is_first) != 0 and hit.triangle >= 0
