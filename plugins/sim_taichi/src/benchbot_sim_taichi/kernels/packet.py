# mypy: ignore-errors
"""Sixteen rays at once against the tree of `benchbot_sim_taichi.bvh`, a lane each.

Intervals that hold all origins and directions leave out most boxes of a node for all rays with one test; the others are
tested against each ray, so that rays with little in common lose little (Wald et al., "Interactive rendering with
coherent ray tracing", 2001; Boulos, Wald and Shirley, "Geometric and arithmetic culling methods for entire ray
packets", 2006). Rays whose directions differ in a sign are traced one group after the other. For processors.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.bvh import LEAF_SIZE, LEAF_STRIDE, NODE_STRIDE, STACK_SIZE, WIDTH
from benchbot_sim_taichi.kernels.lanes import (
    LANE_BITS,
    absolute,
    ints16,
    larger,
    largest,
    load8,
    mask_of,
    smaller,
    union,
    vec16,
)
from benchbot_sim_taichi.kernels.traversal import EMPTY, FAR, meet_triangles

RAYS = 16


@ti.dataclass
class Packet:
    """Origins and directions of sixteen rays, and how far they reach (`FAR` at most), in lengths of their directions.

    `trace_packet` shortens their reach to what they meet: a triangle (-1 none), at barycentric `u` and `v`.
    """

    x: vec16
    y: vec16
    z: vec16
    along_x: vec16
    along_y: vec16
    along_z: vec16
    reach: vec16
    triangle: ints16
    u: vec16
    v: vec16


@ti.func
def packet_from(origins: ti.template(), directions: ti.template(), first, count, reach):
    """The rays from number `first` on, of arrays with three values a ray; the last of `count` rays fills the lanes."""
    rays = Packet(reach=vec16(ti.min(reach, FAR)), triangle=ints16(-1))
    for lane in ti.static(range(RAYS)):
        at = ti.min(first + lane, count - 1) * 3
        rays.x[lane], rays.y[lane], rays.z[lane] = origins[at], origins[at + 1], origins[at + 2]
        rays.along_x[lane] = directions[at]
        rays.along_y[lane] = directions[at + 1]
        rays.along_z[lane] = directions[at + 2]
    return rays


@ti.func
def safe_inverses(lanes):
    """1 / x in each lane, finite for x near 0."""
    tiny = ti.select(lanes < 0.0, vec16(-1e-12), vec16(1e-12))
    return 1.0 / ti.select(absolute(lanes) < 1e-12, tiny, lanes)


@ti.func
def outermost(lanes, is_mine, upwards):
    """The largest of the lanes that are mine, or the smallest when not `upwards`."""
    sign = ti.select(upwards, 1.0, -1.0)
    return largest(ti.select(is_mine != 0, lanes * sign, vec16(-FAR))) * sign


@ti.func
def trace_packet(nodes: ti.template(), leaves: ti.template(), root, rays: ti.template(), any_hit: ti.template()):
    """Shorten the rays' reach to the nearest triangle of each; with `any_hit`, to -1 where anything is in the way.

    A ray with a NaN, or without a direction, meets nothing.
    """
    inv_x, inv_y, inv_z = safe_inverses(rays.along_x), safe_inverses(rays.along_y), safe_inverses(rays.along_z)
    octant = (
        ti.select(rays.along_x < 0.0, ints16(1), ints16(0))
        | ti.select(rays.along_y < 0.0, ints16(2), ints16(0))
        | ti.select(rays.along_z < 0.0, ints16(4), ints16(0))
    )
    length2 = rays.along_x * rays.along_x + rays.along_y * rays.along_y + rays.along_z * rays.along_z
    # From farther away, unused children of a node, whose boxes end before they begin at 1e30, could be entered.
    away = absolute(rays.x) + absolute(rays.y) + absolute(rays.z)
    is_usable = (length2 > 1e-20) & (length2 < 1e20) & (away < 1e20)
    left = union(ti.select(is_usable, ints16(LANE_BITS), ints16(0)))
    stack = ti.Vector([0] * STACK_SIZE, dt=ti.i32)
    while left != 0:
        first = 31 - ti.math.clz(left)
        signs = octant[first]
        is_mine = ti.select(octant == signs, ints16(LANE_BITS), ints16(0)) & left
        left &= ~union(is_mine)
        reach = ti.select(is_mine != 0, rays.reach, vec16(-1.0))

        up_x, up_y, up_z = signs & 1 == 0, signs & 2 == 0, signs & 4 == 0
        near_x = ti.select(up_x, 0, 3 * WIDTH)
        near_y = ti.select(up_y, WIDTH, 4 * WIDTH)
        near_z = ti.select(up_z, 2 * WIDTH, 5 * WIDTH)
        far_x, far_y, far_z = 3 * WIDTH - near_x, 5 * WIDTH - near_y, 7 * WIDTH - near_z
        ahead_x, behind_x = outermost(rays.x, is_mine, up_x), outermost(rays.x, is_mine, not up_x)
        ahead_y, behind_y = outermost(rays.y, is_mine, up_y), outermost(rays.y, is_mine, not up_y)
        ahead_z, behind_z = outermost(rays.z, is_mine, up_z), outermost(rays.z, is_mine, not up_z)
        least_x, most_x = outermost(inv_x, is_mine, False), outermost(inv_x, is_mine, True)
        least_y, most_y = outermost(inv_y, is_mine, False), outermost(inv_y, is_mine, True)
        least_z, most_z = outermost(inv_z, is_mine, False), outermost(inv_z, is_mine, True)
        order_x, order_y, order_z = rays.along_x[first], rays.along_y[first], rays.along_z[first]
        farthest = largest(reach)

        depth = 0
        current = root
        running = farthest > 0.0
        while running:
            if current >= 0:
                base = current * NODE_STRIDE
                box_near_x, box_far_x = load8(nodes, base + near_x), load8(nodes, base + far_x)
                box_near_y, box_far_y = load8(nodes, base + near_y), load8(nodes, base + far_y)
                box_near_z, box_far_z = load8(nodes, base + near_z), load8(nodes, base + far_z)
                to_x, to_y, to_z = box_near_x - ahead_x, box_near_y - ahead_y, box_near_z - ahead_z
                past_x, past_y, past_z = box_far_x - behind_x, box_far_y - behind_y, box_far_z - behind_z
                enter_x = smaller(to_x * least_x, to_x * most_x)
                enter_y = smaller(to_y * least_y, to_y * most_y)
                enter_z = smaller(to_z * least_z, to_z * most_z)
                leave_x = larger(past_x * least_x, past_x * most_x)
                leave_y = larger(past_y * least_y, past_y * most_y)
                leave_z = larger(past_z * least_z, past_z * most_z)
                enter = larger(larger(enter_x, enter_y), larger(enter_z, 0.0))
                leave = smaller(smaller(leave_x, leave_y), smaller(leave_z, farthest))
                mask = mask_of(enter <= leave * 1.000001)
                order = box_near_x * order_x + box_near_y * order_y + box_near_z * order_z
                nearest = FAR
                current = EMPTY
                while mask != 0:
                    i = ti.math.clz(mask) - 1
                    mask ^= 1 << (30 - i)
                    tx0 = (nodes[base + near_x + i] - rays.x) * inv_x
                    ty0 = (nodes[base + near_y + i] - rays.y) * inv_y
                    tz0 = (nodes[base + near_z + i] - rays.z) * inv_z
                    tx1 = (nodes[base + far_x + i] - rays.x) * inv_x
                    ty1 = (nodes[base + far_y + i] - rays.y) * inv_y
                    tz1 = (nodes[base + far_z + i] - rays.z) * inv_z
                    t_near = larger(larger(tx0, ty0), larger(tz0, 0.0))
                    t_far = smaller(smaller(tx1, ty1), smaller(tz1, reach))
                    if union(ti.select(t_near <= t_far * 1.0000004, ints16(1), ints16(0))) != 0:
                        child = ti.bit_cast(nodes[base + 6 * WIDTH + i], ti.i32)
                        if ti.static(any_hit) or order[i] < nearest:  # any order will do for any hit
                            if current != EMPTY and depth < STACK_SIZE:
                                stack[depth] = current
                                depth += 1
                            current = child
                            nearest = order[i]
                        elif depth < STACK_SIZE:
                            stack[depth] = child
                            depth += 1
            elif current != EMPTY:
                base = ~current * LEAF_STRIDE
                for k in range(LEAF_SIZE):
                    triangle = ti.bit_cast(leaves[base + 9 * LEAF_SIZE + k], ti.i32)
                    if triangle >= 0:
                        t, u, v = meet_triangles(
                            rays.x - leaves[base + k],
                            rays.y - leaves[base + 4 + k],
                            rays.z - leaves[base + 8 + k],
                            rays.along_x,
                            rays.along_y,
                            rays.along_z,
                            leaves[base + 12 + k],
                            leaves[base + 16 + k],
                            leaves[base + 20 + k],
                            leaves[base + 24 + k],
                            leaves[base + 28 + k],
                            leaves[base + 32 + k],
                        )
                        if ti.static(not any_hit):
                            rays.triangle = ti.select(t < reach, ints16(triangle), rays.triangle)
                            rays.u = ti.select(t < reach, u, rays.u)
                            rays.v = ti.select(t < reach, v, rays.v)
                        reach = ti.select(t < reach, vec16(-1.0) if ti.static(any_hit) else t, reach)
                farthest = largest(reach)
                current = EMPTY
            if current == EMPTY:
                running = depth > 0 and farthest > 0.0
                if running:
                    depth -= 1
                    current = stack[depth]
        rays.reach = ti.select(is_mine != 0, reach, rays.reach)
