# mypy: ignore-errors
"""Rays against the tree of `benchbot_sim_taichi.bvh`.

Triangle test: Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.

On a processor the eight boxes of a node, and the four triangles of a leaf, are tested at once, each in a lane of its
own (`lanes`); on a GPU nodes have four: `trace_narrow`.

Barycentric coordinates are off by rounding, in proportion to distance times edges over the determinant. A triangle is
met that far beyond its edges (`EDGE`), so that no ray slips between two that share one.
"""

from benchbot_sim_taichi._ti import is_on_gpu, ti
from benchbot_sim_taichi.bvh import EMPTY_CHILD, LEAF_SIZE, LEAF_STRIDE, NARROW, NODE_STRIDE, STACK_SIZE
from benchbot_sim_taichi.kernels.lanes import absolute, larger, load4, load8, mask_of, smaller

FAR = 1e30
EDGE = 1.2e-7
EMPTY = int(EMPTY_CHILD)
BLOCK = 128  # threads of a GPU that share memory
NARROW_STRIDE = 8 * NARROW
SHARED_STACK = 48  # no ray can need more than 42 in rooms of 150,000 and 200,000 triangles
MISSED = 0x7FFFFFFF
SLOT = NARROW - 1
SORTING_NETWORK = ((0, 1), (2, 3), (0, 2), (1, 3), (1, 2))

floats = ti.types.ndarray(dtype=ti.f32, ndim=1)
ints = ti.types.ndarray(dtype=ti.i32, ndim=1)
vec3 = ti.types.vector(3, ti.f32)


@ti.dataclass
class Hit:
    """Nearest intersection: distance (FAR when none), triangle id (-1 when none), barycentric u and v."""

    t: ti.f32
    triangle: ti.i32
    u: ti.f32
    v: ti.f32


@ti.func
def safe_inverse(x):
    """1 / x that stays finite for x near 0."""
    tiny = ti.select(x < 0.0, -1e-12, 1e-12)
    return 1.0 / ti.select(ti.abs(x) < 1e-12, tiny, x)


@ti.func
def meet_triangles(sx, sy, sz, dx, dy, dz, e1x, e1y, e1z, e2x, e2y, e2z):
    """Distance (FAR where nothing is met) and barycentric u and v, in as many lanes as there are rays or triangles.

    `s` leads from a triangle's first corner to a ray's origin, `d` along the ray; `e1` and `e2` are edges from there.
    """
    px = dy * e2z - dz * e2y
    py = dz * e2x - dx * e2z
    pz = dx * e2y - dy * e2x
    det = px * e1x + py * e1y + pz * e1z
    inv_det = 1.0 / det
    qx = sy * e1z - sz * e1y
    qy = sz * e1x - sx * e1z
    qz = sx * e1y - sy * e1x
    u = (sx * px + sy * py + sz * pz) * inv_det
    v = (qx * dx + qy * dy + qz * dz) * inv_det
    t = (qx * e2x + qy * e2y + qz * e2z) * inv_det
    far = absolute(sx) + absolute(sy) + absolute(sz)
    wide = absolute(e1x) + absolute(e1y) + absolute(e1z) + absolute(e2x) + absolute(e2y) + absolute(e2z)
    least = smaller(smaller(u, v), 1.0 - u - v) + far * absolute(inv_det) * (EDGE * wide)
    return ti.select((det != 0.0) & (least >= 0.0) & (t > 0.0), t, FAR), u, v


@ti.func
def trace(
    nodes: ti.template(),
    leaves: ti.template(),
    root: ti.i32,
    origin: vec3,
    direction: vec3,
    t_max: ti.f32,
    any_hit: ti.template(),
):
    """Nearest hit in (0, t_max), or just the first found when `any_hit`."""
    hit = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
    if ti.static(is_on_gpu()):
        hit, _ = trace_narrow(nodes, leaves, root, -1, origin, direction, t_max, ti.cast(any_hit, ti.i32))
    else:
        hit = trace_wide(nodes, leaves, root, origin, direction, t_max, any_hit)
    return hit


@ti.func
def trace_wide(
    nodes: ti.template(),
    leaves: ti.template(),
    root: ti.i32,
    origin: vec3,
    direction: vec3,
    t_max: ti.f32,
    any_hit: ti.template(),
):
    """`trace` on a processor: nodes of eight."""
    hit = Hit(t=t_max, triangle=-1, u=0.0, v=0.0)
    inv_x, inv_y, inv_z = safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z)
    near_x = ti.select(inv_x >= 0.0, 0, 24)
    near_y = ti.select(inv_y >= 0.0, 8, 32)
    near_z = ti.select(inv_z >= 0.0, 16, 40)
    far_x, far_y, far_z = 24 - near_x, 40 - near_y, 56 - near_z
    ox, oy, oz = origin.x * inv_x, origin.y * inv_y, origin.z * inv_z

    stack_node = ti.Vector([0] * STACK_SIZE, dt=ti.i32)
    stack_t = ti.Vector([0.0] * STACK_SIZE, dt=ti.f32)
    depth = 0
    current = root
    # A ray with a NaN must not enter: it would hit every box.
    length2 = direction.dot(direction) + 0.0 * origin.dot(origin)
    running = (length2 > 1e-20) & (length2 < 1e20)
    while running:
        if current >= 0:
            base = current * NODE_STRIDE
            tx0 = load8(nodes, base + near_x) * inv_x - ox
            ty0 = load8(nodes, base + near_y) * inv_y - oy
            tz0 = load8(nodes, base + near_z) * inv_z - oz
            tx1 = load8(nodes, base + far_x) * inv_x - ox
            ty1 = load8(nodes, base + far_y) * inv_y - oy
            tz1 = load8(nodes, base + far_z) * inv_z - oz
            t_near = larger(larger(tx0, ty0), larger(tz0, 0.0))
            t_far = smaller(smaller(tx1, ty1), smaller(tz1, hit.t))
            mask = mask_of(t_near <= t_far * 1.0000004)
            nearest_t = FAR
            nearest = EMPTY
            while mask != 0:
                i = ti.math.clz(mask) - 1
                mask ^= 1 << (30 - i)
                child = ti.bit_cast(nodes[base + 48 + i], ti.i32)
                t = t_near[i]
                if ti.static(any_hit):  # any order will do
                    if nearest != EMPTY and depth < STACK_SIZE:
                        stack_node[depth] = nearest
                        depth += 1
                    nearest = child
                elif t < nearest_t:
                    if nearest != EMPTY and depth < STACK_SIZE:
                        stack_node[depth] = nearest
                        stack_t[depth] = nearest_t
                        depth += 1
                    nearest = child
                    nearest_t = t
                elif depth < STACK_SIZE:
                    stack_node[depth] = child
                    stack_t[depth] = t
                    depth += 1
            current = nearest
        elif current != EMPTY:
            base = (~current) * LEAF_STRIDE
            e1x, e1y, e1z = load4(leaves, base + 12), load4(leaves, base + 16), load4(leaves, base + 20)
            e2x, e2y, e2z = load4(leaves, base + 24), load4(leaves, base + 28), load4(leaves, base + 32)
            sx = origin.x - load4(leaves, base)
            sy = origin.y - load4(leaves, base + 4)
            sz = origin.z - load4(leaves, base + 8)
            t_hit, u, v = meet_triangles(
                sx, sy, sz, direction.x, direction.y, direction.z, e1x, e1y, e1z, e2x, e2y, e2z
            )
            best = -1
            for i in ti.static(range(4)):
                if t_hit[i] < hit.t:
                    hit.t = t_hit[i]
                    best = i
            if best >= 0:
                hit.u = u[best]
                hit.v = v[best]
                hit.triangle = ti.bit_cast(leaves[base + 36 + best], ti.i32)
                if ti.static(any_hit):
                    depth = 0
            current = EMPTY
        if current == EMPTY:
            running = False
            if ti.static(any_hit):
                if depth > 0:
                    depth -= 1
                    current = stack_node[depth]
                    running = True
            else:
                while depth > 0 and not running:
                    depth -= 1
                    if stack_t[depth] < hit.t:
                        current = stack_node[depth]
                        running = True
    if hit.triangle < 0:
        hit.t = FAR
    return hit


@ti.func
def trace_narrow(
    nodes: ti.template(),
    leaves: ti.template(),
    root: ti.i32,
    then: ti.i32,
    origin: vec3,
    direction: vec3,
    t_max: ti.f32,
    any_hit: ti.i32,
):
    """Nearest hit in (0, t_max) below `root` and `then` (-1 where there is no second root), as from `trace`.

    When `any_hit` is not 0, any hit below `root` is as good, and ends the search; whether there was one, also says the
    second value.

    On a GPU, arrays that are indexed at run time lie in memory, and setting them up for every ray takes longer than
    the ray itself. So all that belongs to a node stays in registers, sorted by a network; only the stack is an array,
    in the block's shared memory: enough for two of these in a kernel.
    """
    thread = ti.simt.block.global_thread_idx()
    thread &= BLOCK - 1
    stack = ti.simt.block.SharedArray((SHARED_STACK * BLOCK,), ti.i32)
    hit = Hit(t=t_max, triangle=-1, u=0.0, v=0.0)
    inv_x, inv_y, inv_z = safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z)
    near_x = ti.select(inv_x >= 0.0, 0, 3 * NARROW)
    near_y = ti.select(inv_y >= 0.0, NARROW, 4 * NARROW)
    near_z = ti.select(inv_z >= 0.0, 2 * NARROW, 5 * NARROW)
    far_x, far_y, far_z = 3 * NARROW - near_x, 5 * NARROW - near_y, 7 * NARROW - near_z
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
            base = current * NARROW_STRIDE
            key = ti.Vector([0] * NARROW, dt=ti.i32)
            for i in ti.static(range(NARROW)):
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
                if key[i] != MISSED and top < SHARED_STACK * BLOCK:
                    stack[top] = ti.bit_cast(nodes[base + 6 * NARROW + (key[i] & SLOT)], ti.i32)
                    top += BLOCK
            current = EMPTY
            if key[0] != MISSED:
                current = ti.bit_cast(nodes[base + 6 * NARROW + (key[0] & SLOT)], ti.i32)
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
