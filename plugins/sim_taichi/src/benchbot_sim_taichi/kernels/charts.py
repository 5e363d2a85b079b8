# mypy: ignore-errors
"""Points of lattices on surfaces; `charts` says what they are for."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.sampling import hash_u32
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, vec3

vec2 = ti.types.vector(2, ti.f32)

FARTHEST_STEPS = 1.5
INSET_STEPS = 0.1
VOXEL_M = 0.02
NORMAL_STEPS = 2.5
ALIKE = 0.8


@ti.func
def along_segment(at, start, end):
    """Return how far along a segment (0 … 1) its point nearest to `at` lies."""
    way = end - start
    return ti.math.clamp((at - start).dot(way) / ti.max(way.dot(way), 1e-12), 0.0, 1.0)


@ti.kernel
def place(lattice: ints, chart_of: ints, first: ints, triangles: ints, corners: floats, samples: floats, count: ti.i32):
    """Find the point of its chart nearest to each of `count` lattice points, a little inside of its triangle.

    `lattice` has x, y, width and height of each; the triangles of chart i are `triangles[first[i]]` to
    `triangles[first[i + 1] - 1]`, with their `corners` (6 values) in the lattice. A sample's triangle is -1 where none
    is near.
    """
    for point in range(count):
        chart = chart_of[point]
        at = vec2(ti.cast(lattice[point * 4], ti.f32), ti.cast(lattice[point * 4 + 1], ti.f32))
        nearest = FAR
        best = -1
        best_u = 0.0
        best_v = 0.0
        k = first[chart]
        while k < first[chart + 1] and nearest > 0.0:
            a = vec2(corners[k * 6], corners[k * 6 + 1])
            b = vec2(corners[k * 6 + 2], corners[k * 6 + 3])
            c = vec2(corners[k * 6 + 4], corners[k * 6 + 5])
            ab, ac, p = b - a, c - a, at - a
            area = ab.x * ac.y - ab.y * ac.x
            scale = 1.0 / ti.select(ti.abs(area) < 1e-9, 1e-9, area)
            u = (p.x * ac.y - p.y * ac.x) * scale
            v = (ab.x * p.y - ab.y * p.x) * scale
            away = 0.0
            if u < 0.0 or v < 0.0 or u + v > 1.0:
                s = along_segment(at, a, b)
                t = along_segment(at, a, c)
                w = along_segment(at, b, c)
                to_s = (p - ab * s).norm_sqr()
                to_t = (p - ac * t).norm_sqr()
                to_w = (at - b - (c - b) * w).norm_sqr()
                away = ti.min(to_s, to_t, to_w)
                u = ti.select(to_s == away, s, ti.select(to_t == away, 0.0, 1.0 - w))
                v = ti.select(to_s == away, 0.0, ti.select(to_t == away, t, w))
            if away < nearest:
                nearest = away
                best = k
                best_u = u
                best_v = v
            k += 1
        # The four points around any place of the chart are within the diagonal of a lattice square of it.
        is_near = best >= 0 and nearest < FARTHEST_STEPS * FARTHEST_STEPS
        samples[point * 4] = -1.0
        if is_near:
            samples[point * 4] = ti.cast(triangles[best], ti.f32)
            b = vec2(corners[best * 6 + 2] - corners[best * 6], corners[best * 6 + 3] - corners[best * 6 + 1])
            c = vec2(corners[best * 6 + 4] - corners[best * 6], corners[best * 6 + 5] - corners[best * 6 + 1])
            to_middle = (b * (1.0 / 3.0 - best_u) + c * (1.0 / 3.0 - best_v)).norm()
            inset = ti.min(INSET_STEPS / ti.max(to_middle, 1e-6), 0.5)
            samples[point * 4 + 1] = best_u + (1.0 / 3.0 - best_u) * inset
            samples[point * 4 + 2] = best_v + (1.0 / 3.0 - best_v) * inset
        samples[point * 4 + 3] = 1.0


@ti.func
def mixed(code, value):
    """Return a hash of a hash and one value more."""
    return hash_u32(code * ti.u32(0x9E3779B1) + ti.cast(value, ti.u32))


@ti.func
def corner_weights(x, y, width, height):
    """Return the weights of a triangle's corners at a lattice point, those beyond the triangle drawn to its edge."""
    across = ti.cast(x, ti.f32) / ti.cast(width - 1, ti.f32)
    down = ti.cast(y, ti.f32) / ti.cast(height - 1, ti.f32)
    beyond = ti.max(across + down - 1.0, 0.0)
    return vec3(1.0 - across - down + beyond, across - 0.5 * beyond, down - 0.5 * beyond)


@ti.func
def blended(values: ti.template(), number, corner, weight):
    """Blend what three corners have, the first of them being `corner`."""
    total = vec3(0.0)
    for i in ti.static(range(3)):
        total += load3(values, number * 9 + (corner + i) % 3 * 3) * weight[i]
    return total


@ti.kernel
def spread(
    records: ints,
    instances: ints,
    vertices: floats,
    normals: floats,
    keys: ints,
    uv: floats,
    alike: ints,
    count: ti.i32,
):
    """Lay points over triangles: a key of 64 bits that close points share, barycentric u and v, likeness to others.

    `records` has six values of each: triangle, the corner that its lattice begins at, side, width, height, and the
    first point. Bit 0 of `alike` says that the next point in the row faces nearly the same way, bit 1 that of the next
    row.
    """
    for number in range(count):
        corner = records[number * 6 + 1]
        side = ti.cast(records[number * 6 + 2], ti.f32)
        width = records[number * 6 + 3]
        height = records[number * 6 + 4]
        first = records[number * 6 + 5]
        for k in range(width * height):
            x = k % width
            y = k // width
            weight = corner_weights(x, y, width, height)
            position = blended(vertices, number, corner, weight)
            normal = (blended(normals, number, corner, weight) * side).normalized(1e-9)
            low = ti.cast(instances[number], ti.u32)
            high = hash_u32(instances[number] + 1)
            for i in ti.static(range(3)):
                voxel = ti.cast(ti.floor(position[i] / VOXEL_M), ti.i32)
                way = ti.cast(ti.floor(normal[i] * NORMAL_STEPS + 0.5), ti.i32)
                low = mixed(mixed(low, voxel), way)
                high = mixed(mixed(high, way), voxel)
            keys[(first + k) * 2] = ti.cast(low, ti.i32)
            keys[(first + k) * 2 + 1] = ti.cast(high, ti.i32)
            for i in ti.static(range(3)):
                if (corner + i) % 3 > 0:
                    uv[(first + k) * 2 + (corner + i) % 3 - 1] = weight[i]
            bits = 0
            for beside in range(2):
                if x + 1 - beside < width and y + beside < height:
                    other = blended(normals, number, corner, corner_weights(x + 1 - beside, y + beside, width, height))
                    if (other * side).normalized(1e-9).dot(normal) > ALIKE:
                        bits |= 1 << beside
            alike[first + k] = bits
