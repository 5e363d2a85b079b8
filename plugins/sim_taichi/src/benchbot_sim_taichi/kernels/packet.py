# mypy: ignore-errors
"""Camera rays against the tree of `benchbot_sim_taichi.bvh`, the 16 of a square of pixels at once.

The rays of a square share their origin, so a pyramid bounds them: a box that lies outside one of its planes is left
out for all of them with one test, and of the test of a triangle all but three products is done once for all of them
(Reshetov, Soupikov and Hurley, "Multi-level ray tracing algorithm", 2005; Wald et al., "Interactive rendering with
coherent ray tracing", 2001). A square never reaches into another picture.

As in `traversal`, what the compiler is to pack into vector instructions is stored into small local arrays, one for
each quantity: rows of one matrix were a third slower.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.bvh import LEAF_SIZE, LEAF_STRIDE, NODE_STRIDE, STACK_SIZE, WIDTH
from benchbot_sim_taichi.kernels.lens import undistort
from benchbot_sim_taichi.kernels.traversal import EDGE, EMPTY, FAR, Hit, floats, vec3
from benchbot_sim_taichi.tables import CAMERA_STRIDE

TILE = 4
RAYS = TILE * TILE
LANES = 8
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
    slack = 1e-6 * (1.0 + ti.abs(origin).sum()) * ti.abs(normal).sum()
    return Plane(
        normal=normal,
        offset=slack - normal.dot(origin),
        x=ti.select(normal.x >= 0.0, 3 * WIDTH, 0),
        y=ti.select(normal.y >= 0.0, 4 * WIDTH, WIDTH),
        z=ti.select(normal.z >= 0.0, 5 * WIDTH, 2 * WIDTH),
    )


@ti.func
def distance(nodes: ti.template(), base, i: ti.template(), plane):
    """How far child `i` reaches into a plane's inner side."""
    return (
        nodes[base + plane.x + i] * plane.normal.x
        + nodes[base + plane.y + i] * plane.normal.y
        + nodes[base + plane.z + i] * plane.normal.z
        + plane.offset
    )


@ti.func
def meet_leaf(
    leaves: ti.template(),
    leaf,
    origin,
    ray_x: ti.template(),
    ray_y: ti.template(),
    ray_z: ti.template(),
    hit_t: ti.template(),
    hit_u: ti.template(),
    hit_v: ti.template(),
    hit_triangle: ti.template(),
):
    """Move the rays' hits to triangles of a leaf that are nearer.

    Möller and Trumbore's products, in the order that takes the ray's direction last.
    """
    base = leaf * LEAF_STRIDE
    for k in range(LEAF_SIZE):
        triangle = ti.bit_cast(leaves[base + 9 * LEAF_SIZE + k], ti.i32)
        if triangle >= 0:
            at = base + k
            e1 = vec3(leaves[at + 12], leaves[at + 16], leaves[at + 20])
            e2 = vec3(leaves[at + 24], leaves[at + 28], leaves[at + 32])
            start = origin - vec3(leaves[at], leaves[at + 4], leaves[at + 8])
            across = e2.cross(e1)
            along_u = e2.cross(start)
            along_v = start.cross(e1)
            height = e2.dot(along_v)
            slack = EDGE * ti.abs(start).sum() * (ti.abs(e1).sum() + ti.abs(e2).sum())
            for group in range(RAYS // LANES):
                for lane in ti.static(range(LANES)):
                    i = group * LANES + lane
                    x, y, z = ray_x[i], ray_y[i], ray_z[i]
                    det = x * across.x + y * across.y + z * across.z
                    inv_det = 1.0 / det
                    u = (x * along_u.x + y * along_u.y + z * along_u.z) * inv_det
                    v = (x * along_v.x + y * along_v.y + z * along_v.z) * inv_det
                    t = height * inv_det
                    w = 1.0 - u - v
                    least = ti.select(u < v, u, v)
                    least = ti.select(w < least, w, least)
                    nearer = (det != 0.0) & (least >= -slack * ti.abs(inv_det)) & (t > 0.0) & (t < hit_t[i])
                    hit_t[i] = ti.select(nearer, t, hit_t[i])
                    hit_u[i] = ti.select(nearer, u, hit_u[i])
                    hit_v[i] = ti.select(nearer, v, hit_v[i])
                    hit_triangle[i] = ti.select(nearer, triangle, hit_triangle[i])


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

        ray_x = ti.Vector.zero(ti.f32, RAYS)
        ray_y = ti.Vector.zero(ti.f32, RAYS)
        ray_z = ti.Vector.zero(ti.f32, RAYS)
        hit_t = ti.Vector.zero(ti.f32, RAYS)
        hit_u = ti.Vector.zero(ti.f32, RAYS)
        hit_v = ti.Vector.zero(ti.f32, RAYS)
        hit_triangle = ti.Vector.zero(ti.i32, RAYS)
        for i in range(RAYS):
            x = ti.cast(ti.min(left + i % TILE, width - 1), ti.f32) + 0.5
            y = ti.cast(ti.min(top + i // TILE, height - 1), ti.f32) + 0.5
            ray = right * ((x - cx) / fx) + down * ((y - cy) / fy) + forward
            ray_x[i], ray_y[i], ray_z[i] = ray.x, ray.y, ray.z
            hit_t[i] = FAR

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
            for i in range(RAYS):
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
        behind = plane_through(origin, -dual_z)

        stack_node = ti.Vector.zero(ti.i32, STACK_SIZE)
        stack_t = ti.Vector.zero(ti.f32, STACK_SIZE)
        reach = ti.Vector.zero(ti.f32, WIDTH)
        t_near = ti.Vector.zero(ti.f32, WIDTH)
        farthest = FAR
        # A camera with a NaN must see nothing.
        bound = ti.abs(origin).sum() + ti.abs(dual_x).sum() + ti.abs(dual_y).sum() + ti.abs(dual_z).sum()
        usable = bound < 1e20
        root = 0
        slot = 0
        while root >= 0:
            depth = 0
            current = root
            running = usable
            for i in range(RAYS):
                hit_triangle[i] = -1
            while running:
                if current >= 0:
                    base = current * NODE_STRIDE
                    for i in ti.static(range(WIDTH)):
                        d0 = distance(nodes, base, i, side_0)
                        d1 = distance(nodes, base, i, side_1)
                        d2 = distance(nodes, base, i, side_2)
                        d3 = distance(nodes, base, i, side_3)
                        a = ti.select(d0 < d1, d0, d1)
                        b = ti.select(d2 < d3, d2, d3)
                        reach[i] = ti.select(a < b, a, b)
                        t_near[i] = -distance(nodes, base, i, behind)
                    mask = 0
                    for i in ti.static(range(WIDTH)):
                        mask |= ti.cast((reach[i] >= 0.0) & (t_near[i] < farthest), ti.i32) << (30 - i)
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
                    meet_leaf(leaves, ~current, origin, ray_x, ray_y, ray_z, hit_t, hit_u, hit_v, hit_triangle)
                    farthest = hit_t[0]
                    for i in range(1, RAYS):
                        farthest = ti.select(hit_t[i] > farthest, hit_t[i], farthest)
                    current = EMPTY
                if current == EMPTY:
                    running = False
                    while depth > 0 and not running:
                        depth -= 1
                        if stack_t[depth] < farthest:
                            current = stack_node[depth]
                            running = True
            for i in range(RAYS):
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
