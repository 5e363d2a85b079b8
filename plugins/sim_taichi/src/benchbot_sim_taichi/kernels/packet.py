# mypy: ignore-errors
"""Camera rays against the tree of `benchbot_sim_taichi.bvh`, the 16 of a square of pixels at once.

The rays of a square share their origin, so a pyramid bounds them: a box that lies outside one of its planes is left
out for all of them with one test, and of the test of a triangle all but three products is done once for all of them
(Reshetov, Soupikov and Hurley, "Multi-level ray tracing algorithm", 2005; Wald et al., "Interactive rendering with
coherent ray tracing", 2001). A square never reaches into another picture.

A square's rays have a lane each; the boxes of a node and the triangles of a leaf have theirs for what all rays share.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.bvh import LEAF_SIZE, LEAF_STRIDE, NODE_STRIDE, STACK_SIZE, WIDTH
from benchbot_sim_taichi.kernels.lanes import absolute, ints16, largest, load4, load8, mask_of, negated, vec16
from benchbot_sim_taichi.kernels.lens import undistort
from benchbot_sim_taichi.kernels.traversal import EDGE, EMPTY, FAR, Hit, floats, vec3
from benchbot_sim_taichi.tables import CAMERA_STRIDE

TILE = 4
RAYS = TILE * TILE
MARGIN_PIXELS = 0.01
HIT_STRIDE = 8


@ti.dataclass
class Plane:
    """Points with a product with `normal` of at least `-offset`, and where a node keeps its boxes' innermost corner."""

    normal: vec3
    offset: ti.f32
    x: ti.i32
    y: ti.i32
    z: ti.i32


@ti.func
def plane_through(origin, normal):
    """The plane through `origin`, moved outwards by more than rounding can amount to."""
    slack = 1e-6 * (1.0 + absolute(origin).sum()) * absolute(normal).sum()
    return Plane(
        normal=normal,
        offset=slack - normal.dot(origin),
        x=ti.select(normal.x >= 0.0, 3 * WIDTH, 0),
        y=ti.select(normal.y >= 0.0, 4 * WIDTH, WIDTH),
        z=ti.select(normal.z >= 0.0, 5 * WIDTH, 2 * WIDTH),
    )


@ti.func
def distances(nodes: ti.template(), base, plane):
    """How far each child of a node reaches into a plane's inner side (8 lanes)."""
    return (
        load8(nodes, base + plane.x) * plane.normal.x
        + load8(nodes, base + plane.y) * plane.normal.y
        + load8(nodes, base + plane.z) * plane.normal.z
        + plane.offset
    )


@ti.kernel
def meet(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    cameras: floats,
    hits: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """What the middle of each pixel shows: the nearest opaque triangle, then the nearest sheer one before it.

    Either is four values: distance (the camera's unit is planar depth; FAR none), u, v, and the triangle's bits.
    """
    columns = (width + TILE - 1) // TILE
    rows = (height + TILE - 1) // TILE
    for tile in range(count * columns * rows):
        picture = tile // (columns * rows)
        inside = tile - picture * (columns * rows)
        left = inside % columns * TILE
        top = inside // columns * TILE
        eye = picture * CAMERA_STRIDE
        origin = vec3(cameras[eye + 9], cameras[eye + 10], cameras[eye + 11])
        right = vec3(cameras[eye], cameras[eye + 3], cameras[eye + 6])
        down = vec3(cameras[eye + 1], cameras[eye + 4], cameras[eye + 7])
        forward = vec3(cameras[eye + 2], cameras[eye + 5], cameras[eye + 8])
        fx, fy, cx, cy = cameras[eye + 12], cameras[eye + 13], cameras[eye + 14], cameras[eye + 15]

        ray_x, ray_y, ray_z = vec16(0.0), vec16(0.0), vec16(0.0)
        hit_t, hit_u, hit_v = vec16(FAR), vec16(0.0), vec16(0.0)
        for i in ti.static(range(RAYS)):
            x = ti.cast(ti.min(left + i % TILE, width - 1), ti.f32) + 0.5
            y = ti.cast(ti.min(top + i // TILE, height - 1), ti.f32) + 0.5
            ray = right * ((x - cx) / fx) + down * ((y - cy) / fy) + forward
            ray_x[i], ray_y[i], ray_z[i] = ray.x, ray.y, ray.z

        # Normals of the pyramid come from the dual basis, which is the basis itself for any rotation.
        volume = forward.dot(right.cross(down))
        dual_x = down.cross(forward) / volume
        dual_y = forward.cross(right) / volume
        dual_z = right.cross(down) / volume
        first_x = (ti.cast(left, ti.f32) + 0.5 - MARGIN_PIXELS - cx) / fx
        first_y = (ti.cast(top, ti.f32) + 0.5 - MARGIN_PIXELS - cy) / fy
        last_x = (ti.cast(left + TILE, ti.f32) - 0.5 + MARGIN_PIXELS - cx) / fx
        last_y = (ti.cast(top + TILE, ti.f32) - 0.5 + MARGIN_PIXELS - cy) / fy
        if cameras[eye + 19] != 0.0:  # the pyramid is that of the rectangle around the square's bent rays
            first_x, last_x, first_y, last_y = FAR, -FAR, FAR, -FAR
            for i in ti.static(range(RAYS)):
                x = ti.cast(ti.min(left + i % TILE, width - 1), ti.f32) + 0.5
                y = ti.cast(ti.min(top + i // TILE, height - 1), ti.f32) + 0.5
                lens_x, lens_y = undistort(cameras, eye + 20, (x - cx) / fx, (y - cy) / fy)
                ray = right * lens_x + down * lens_y + forward
                ray_x[i], ray_y[i], ray_z[i] = ray.x, ray.y, ray.z
                first_x, last_x = ti.min(first_x, lens_x), ti.max(last_x, lens_x)
                first_y, last_y = ti.min(first_y, lens_y), ti.max(last_y, lens_y)
            margin = MARGIN_PIXELS / ti.min(ti.abs(fx), ti.abs(fy))
            first_x, last_x, first_y, last_y = first_x - margin, last_x + margin, first_y - margin, last_y + margin
        side_0 = plane_through(origin, dual_x - dual_z * ti.min(first_x, last_x))
        side_1 = plane_through(origin, dual_z * ti.max(first_x, last_x) - dual_x)
        side_2 = plane_through(origin, dual_y - dual_z * ti.min(first_y, last_y))
        side_3 = plane_through(origin, dual_z * ti.max(first_y, last_y) - dual_y)
        behind = plane_through(origin, negated(dual_z))

        stack_node = ti.Vector.zero(ti.i32, STACK_SIZE)
        stack_t = ti.Vector.zero(ti.f32, STACK_SIZE)
        farthest = FAR
        # A camera with a NaN must see nothing.
        bound = (absolute(origin) + absolute(dual_x) + absolute(dual_y) + absolute(dual_z)).sum()
        usable = bound < 1e20
        root = 0
        slot = 0
        while root >= 0:
            depth = 0
            current = root
            running = usable
            hit_triangle = ints16(-1)
            while running:
                if current >= 0:
                    base = current * NODE_STRIDE
                    d0 = distances(nodes, base, side_0)
                    d1 = distances(nodes, base, side_1)
                    d2 = distances(nodes, base, side_2)
                    d3 = distances(nodes, base, side_3)
                    a = ti.select(d0 < d1, d0, d1)
                    b = ti.select(d2 < d3, d2, d3)
                    reach = ti.select(a < b, a, b)
                    t_near = negated(distances(nodes, base, behind))
                    mask = mask_of((reach >= 0.0) & (t_near < farthest))
                    nearest_t = FAR
                    nearest = EMPTY
                    while mask != 0:
                        i = ti.math.clz(mask) - 1
                        mask ^= 1 << (30 - i)
                        child = ti.bit_cast(nodes[base + 6 * WIDTH + i], ti.i32)
                        t = t_near[i]
                        if t < nearest_t:
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
                    # Möller and Trumbore's products, in the order that takes the ray's direction last.
                    base = ~current * LEAF_STRIDE
                    e1x, e1y, e1z = load4(leaves, base + 12), load4(leaves, base + 16), load4(leaves, base + 20)
                    e2x, e2y, e2z = load4(leaves, base + 24), load4(leaves, base + 28), load4(leaves, base + 32)
                    sx = origin.x - load4(leaves, base)
                    sy = origin.y - load4(leaves, base + 4)
                    sz = origin.z - load4(leaves, base + 8)
                    across_x, across_y, across_z = e2y * e1z - e2z * e1y, e2z * e1x - e2x * e1z, e2x * e1y - e2y * e1x
                    u_x, u_y, u_z = e2y * sz - e2z * sy, e2z * sx - e2x * sz, e2x * sy - e2y * sx
                    v_x, v_y, v_z = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
                    heights = e2x * v_x + e2y * v_y + e2z * v_z
                    far = absolute(sx) + absolute(sy) + absolute(sz)
                    wide = absolute(e1x) + absolute(e1y) + absolute(e1z) + absolute(e2x) + absolute(e2y) + absolute(e2z)
                    slack = EDGE * far * wide
                    for k in ti.static(range(LEAF_SIZE)):
                        triangle = ti.bit_cast(leaves[base + 9 * LEAF_SIZE + k], ti.i32)
                        if triangle >= 0:
                            det = ray_x * across_x[k] + ray_y * across_y[k] + ray_z * across_z[k]
                            inv_det = 1.0 / det
                            u = (ray_x * u_x[k] + ray_y * u_y[k] + ray_z * u_z[k]) * inv_det
                            v = (ray_x * v_x[k] + ray_y * v_y[k] + ray_z * v_z[k]) * inv_det
                            t = inv_det * heights[k]
                            w = 1.0 - u - v
                            least = ti.select(u < v, u, v)
                            least = ti.select(w < least, w, least)
                            least += absolute(inv_det) * slack[k]
                            nearer = (det != 0.0) & (least >= 0.0) & (t > 0.0) & (t < hit_t)
                            hit_t = ti.select(nearer, t, hit_t)
                            hit_u = ti.select(nearer, u, hit_u)
                            hit_v = ti.select(nearer, v, hit_v)
                            hit_triangle = ti.select(nearer, ints16(triangle), hit_triangle)
                    farthest = largest(hit_t)
                    current = EMPTY
                if current == EMPTY:
                    running = False
                    while depth > 0 and not running:
                        depth -= 1
                        if stack_t[depth] < farthest:
                            current = stack_node[depth]
                            running = True
            for i in ti.static(range(RAYS)):
                x = left + i % TILE
                y = top + i // TILE
                if x < width and y < height:
                    at = ((picture * height + y) * width + x) * HIT_STRIDE + slot
                    hits[at] = ti.select(hit_triangle[i] >= 0, hit_t[i], FAR)
                    hits[at + 1] = hit_u[i]
                    hits[at + 2] = hit_v[i]
                    hits[at + 3] = ti.bit_cast(hit_triangle[i], ti.f32)
            root = ti.select(root == 0, sheer_root, -1)
            slot += 4


@ti.func
def met(hits: ti.template(), pixel, slot):
    """What `meet` stored: the nearest opaque hit for `slot` 0, the sheer one before it for 1."""
    at = pixel * HIT_STRIDE + slot * 4
    return Hit(
        t=hits[at],
        triangle=ti.bit_cast(hits[at + 3], ti.i32),
        u=hits[at + 1],
        v=hits[at + 2],
    )
