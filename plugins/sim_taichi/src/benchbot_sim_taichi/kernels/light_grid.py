# mypy: ignore-errors
"""Which lights matter where: weighs them in every block of a coarse grid, and chooses by that; see `light_grid`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.light import light_cosine, point_of_light, sky_radiance
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, trace, vec3
from benchbot_sim_taichi.light_grid import HEADER
from benchbot_sim_taichi.lights import LIGHT_STRIDE

POINTS = 8
NEAREST = 0.3
UNSEEN = 0.02
LEAST_COSINE = 0.1


@ti.func
def sample_near(near: ti.template(), lights: ti.template(), env: ti.template(), first, count, point, xi):
    """As `light.sample_light`, but by what each light gives to the block of the grid that `point` lies in."""
    local = (point - load3(near, 0)) * near[3]
    x = ti.math.clamp(ti.cast(ti.floor(local.x), ti.i32), 0, ti.cast(near[4], ti.i32) - 1)
    y = ti.math.clamp(ti.cast(ti.floor(local.y), ti.i32), 0, ti.cast(near[5], ti.i32) - 1)
    z = ti.math.clamp(ti.cast(ti.floor(local.z), ti.i32), 0, ti.cast(near[6], ti.i32) - 1)
    block = (x * ti.cast(near[5], ti.i32) + y) * ti.cast(near[6], ti.i32) + z
    row = HEADER + block * ti.cast(near[7], ti.i32)
    low = first
    high = first + count - 1
    while low < high:
        middle = (low + high) >> 1
        if near[row + middle] <= xi.x:
            low = middle + 1
        else:
            high = middle
    before = 0.0
    if low > first:
        before = near[row + low - 1]
    share = ti.max(near[row + low] - before, 1e-12)
    base = low * LIGHT_STRIDE
    area = 0.5 * load3(lights, base + 3).cross(load3(lights, base + 6)).norm()
    across = ti.Vector([(xi.x - before) / share, xi.y])
    return point_of_light(lights, env, low, share / ti.max(area, 1e-12), point, across)


@ti.kernel
def weigh(
    nodes: floats,
    leaves: floats,
    env: floats,
    lights: floats,
    header: floats,
    weights: floats,
    blocks: ti.i32,
):
    """Irradiance that each light gives to each block, at the most: at `POINTS` points, little where it is hidden."""
    count = ti.cast(header[7], ti.i32)
    for index in range(blocks * count):
        block = index // count
        light = index - block * count
        base = light * LIGHT_STRIDE
        ny, nz = ti.cast(header[5], ti.i32), ti.cast(header[6], ti.i32)
        x = block // (ny * nz)
        y = block // nz - x * ny
        z = block - (x * ny + y) * nz
        size = 1.0 / header[3]
        edge1, edge2 = load3(lights, base + 3), load3(lights, base + 6)
        area = 0.5 * edge1.cross(edge2).norm()
        total = 0.0
        for k in range(POINTS):
            # Near the corners of the block, each with a point of its own of the light.
            inside = vec3(0.15 + 0.7 * (k // 4), 0.15 + 0.7 * (k // 2 % 2), 0.15 + 0.7 * (k % 2))
            point = load3(header, 0) + (vec3(x, y, z) + inside) * size
            target = load3(lights, base) + edge1 * (0.1 + 0.08 * k) + edge2 * (0.72 - 0.08 * k)
            offset = target - point
            distance2 = ti.max(offset.norm_sqr(), 1e-8)
            direction = offset / ti.sqrt(distance2)
            cosine = ti.max(light_cosine(lights, base, direction), LEAST_COSINE)
            radiance = load3(lights, base + 14)
            if lights[base + 17] > 0.5:
                radiance = sky_radiance(env, direction)
            given = radiance.max() * area * cosine / ti.max(distance2, NEAREST * NEAREST * size * size)
            hit = trace(nodes, leaves, 0, point, direction, ti.sqrt(distance2) * 0.999, True)
            total += given * ti.select(hit.t < FAR, UNSEEN, 1.0)
        weights[index] = total
