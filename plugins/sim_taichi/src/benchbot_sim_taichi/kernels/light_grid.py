# mypy: ignore-errors
"""Which lights matter where: weighs them in every block of a coarse grid, and chooses by that; see `light_grid`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.light import LightSample, light_cosine, point_of_light, sky_radiance
from benchbot_sim_taichi.kernels.sampling import sobol_2d
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, trace, vec3
from benchbot_sim_taichi.light_grid import HEADER, KINDS, PLACES
from benchbot_sim_taichi.lights import LIGHT_STRIDE
from benchbot_sim_taichi.surface_cells import DIRECTIONS

NEAREST_M2 = 0.01
UNSEEN = 0.02
LEAST_COSINE = 0.05
HINDMOST_LIGHT = -0.1  # cosines, below which a light's back, or a surface's, is turned in all its block
HINDMOST_SURFACE = -0.3
OFFSET_M = 5e-4


@ti.func
def row_near(near: ti.template(), point, normal):
    """Where in the grid the row begins that speaks for a surface at `point`."""
    local = (point - load3(near, 0)) * near[3]
    nx, ny, nz = ti.cast(near[4], ti.i32), ti.cast(near[5], ti.i32), ti.cast(near[6], ti.i32)
    x = ti.math.clamp(ti.cast(ti.floor(local.x), ti.i32), 0, nx - 1)
    y = ti.math.clamp(ti.cast(ti.floor(local.y), ti.i32), 0, ny - 1)
    z = ti.math.clamp(ti.cast(ti.floor(local.z), ti.i32), 0, nz - 1)
    size = ti.abs(normal)
    way = ti.select(normal.z < 0.0, 5, 4)
    if size.x >= ti.max(size.y, size.z):
        way = ti.select(normal.x < 0.0, 1, 0)
    elif size.y >= size.z:
        way = ti.select(normal.y < 0.0, 3, 2)
    number = ti.cast(near[HEADER + ((x * ny + y) * nz + z) * DIRECTIONS + way], ti.i32)
    return HEADER + nx * ny * nz * DIRECTIONS + number * (KINDS + ti.cast(near[7], ti.i32))


@ti.func
def sample_near(
    near: ti.template(), lights: ti.template(), env: ti.template(), kind, first, count, point, normal, index, scramble
):
    """As `light.sample_light`, but by what each light gives to surfaces that face like `normal` around `point`.

    `kind` is 0 for windows and 1 for lamps; `index` and `scramble` are those of `sobol_2d`. Where all of a kind give
    next to nothing, most samples have no `value`, and the others stand for them (Russian roulette).
    """
    sample = LightSample(direction=vec3(0.0, 0.0, 1.0), distance=FAR, value=vec3(0.0), radiance=vec3(0.0), density=0.0)
    row = row_near(near, point, normal)
    every = ti.cast(near[row + kind], ti.i32)
    if index % every == 0:
        xi = sobol_2d(index // every, scramble)
        row += KINDS
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
        sample = point_of_light(lights, env, low, share / ti.max(area, 1e-12), point, across)
        sample.value *= ti.cast(every, ti.f32)
    return sample


@ti.kernel
def weigh(
    nodes: floats,
    leaves: floats,
    env: floats,
    lights: floats,
    surfaces: floats,
    weights: floats,
    rows: ti.i32,
    count: ti.i32,
):
    """Irradiance that each light gives to each row's `PLACES` (position and normal each), little where it is hidden."""
    for index in range(rows * count):
        row = index // count
        light = index - row * count
        base = light * LIGHT_STRIDE
        edge1, edge2 = load3(lights, base + 3), load3(lights, base + 6)
        area = 0.5 * edge1.cross(edge2).norm()
        total = 0.0
        for k in range(PLACES):
            at = (row * PLACES + k) * 6
            normal = load3(surfaces, at + 3)
            point = load3(surfaces, at) + normal * OFFSET_M
            # For each place a point of its own of the light.
            target = load3(lights, base) + edge1 * (0.1 + 0.08 * k) + edge2 * (0.72 - 0.08 * k)
            offset = target - point
            distance2 = ti.max(offset.norm_sqr(), 1e-8)
            direction = offset / ti.sqrt(distance2)
            cosine = light_cosine(lights, base, direction)
            received = normal.dot(direction)
            if cosine > HINDMOST_LIGHT and received > HINDMOST_SURFACE:
                radiance = load3(lights, base + 14)
                if lights[base + 17] > 0.5:
                    radiance = sky_radiance(env, direction)
                given = radiance.max() * area * ti.max(cosine, LEAST_COSINE) / ti.max(distance2, NEAREST_M2)
                seen = UNSEEN
                if received > 0.0:
                    hit = trace(nodes, leaves, 0, point, direction, ti.sqrt(distance2) * 0.999, True)
                    seen = ti.select(hit.t < FAR, UNSEEN, 1.0)
                total += given * ti.max(received, LEAST_COSINE) * seen
        weights[index] = total
