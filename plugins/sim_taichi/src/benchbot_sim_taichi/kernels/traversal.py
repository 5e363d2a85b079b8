# mypy: ignore-errors
"""Rays against the tree of `benchbot_sim_taichi.bvh`.

Triangle test: Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.

The eight boxes of a node, and the four triangles of a leaf, are tested at once, each in a lane of its own (`lanes`).

Barycentric coordinates are off by rounding, in proportion to distance times edges over the determinant. A triangle is
met that far beyond its edges (`EDGE`), so that no ray slips between two that share one.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.bvh import EMPTY_CHILD, LEAF_STRIDE, NODE_STRIDE, STACK_SIZE
from benchbot_sim_taichi.kernels.lanes import absolute, larger, load4, load8, mask_of, smaller

FAR = 1e30
EDGE = 1.2e-7
EMPTY = int(EMPTY_CHILD)

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
