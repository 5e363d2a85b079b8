# mypy: ignore-errors
"""Light sampling by weights in the blocks of a coarse grid; see `light_grid`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import absolute
from benchbot_sim_taichi.kernels.light import LightSample, light_cosine, point_of_light, sky_radiance
from benchbot_sim_taichi.kernels.sampling import hash_u32, sobol_2d
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, trace, vec3
from benchbot_sim_taichi.light_grid import HEADER, KINDS, PLACES
from benchbot_sim_taichi.lights import LIGHT_STRIDE
from benchbot_sim_taichi.surface_cells import DIRECTIONS

NEAREST_M2 = 0.01
UNSEEN = 0.15  # of what a hidden light would give: elsewhere in its block, a part of it may be seen
LEAST_COSINE = 0.05
HINDMOST_LIGHT = -0.1  # cosines, below which a light's back, or a surface's, is turned in all its block
HINDMOST_SURFACE = -0.3
OFFSET_M = 5e-4


@ti.func
def row_near(near: ti.template(), point, normal):
    """Return the offset of the grid's row for a surface at `point`."""
    local = (point - load3(near, 0)) * near[3]
    nx, ny, nz = ti.cast(near[4], ti.i32), ti.cast(near[5], ti.i32), ti.cast(near[6], ti.i32)
    x = ti.math.clamp(ti.cast(ti.floor(local.x), ti.i32), 0, nx - 1)
    y = ti.math.clamp(ti.cast(ti.floor(local.y), ti.i32), 0, ny - 1)
    z = ti.math.clamp(ti.cast(ti.floor(local.z), ti.i32), 0, nz - 1)
    size = absolute(normal)
    way = ti.select(normal.z < 0.0, 5, 4)
    if size.x >= ti.max(size.y, size.z):
        way = ti.select(normal.x < 0.0, 1, 0)
    elif size.y >= size.z:
        way = ti.select(normal.y < 0.0, 3, 2)
    number = ti.cast(near[HEADER + ((x * ny + y) * nz + z) * DIRECTIONS + way], ti.i32)
    return HEADER + nx * ny * nz * DIRECTIONS + number * (KINDS + ti.cast(near[7], ti.i32))


@ti.func
def shifted(near: ti.template(), point, normal, number):
    """A place up to half a block of the grid beside `point`, at random; the same for the same `number`.

    Where neighbouring pixels ask for the rows of such places, none of them sees where a block ends.
    """
    bits = hash_u32(number)
    across = ti.cast(bits & 0xFFFF, ti.f32) / 65536.0
    down = ti.cast(bits >> 16, ti.f32) / 65536.0
    size = absolute(normal)
    shift = ti.Vector([across, down, 0.5])
    if size.x >= ti.max(size.y, size.z):
        shift = ti.Vector([0.5, across, down])
    elif size.y >= size.z:
        shift = ti.Vector([across, 0.5, down])
    return point + (shift - 0.5) / near[3]


@ti.dataclass
class Choice:
    """A light, its share of the samples of its kind, and where in that share (0 … 1) the number fell that chose it."""

    light: ti.i32
    share: ti.f32
    across: ti.f32


@ti.func
def choose(near: ti.template(), row, first, count, number):
    """Choose one of the lights `first` … `first + count` - 1 by their shares in a row of the grid."""
    low = first
    high = first + count - 1
    while low < high:
        middle = (low + high) >> 1
        if near[row + KINDS + middle] <= number:
            low = middle + 1
        else:
            high = middle
    before = 0.0
    if low > first:
        before = near[row + KINDS + low - 1]
    share = ti.max(near[row + KINDS + low] - before, 1e-12)
    return Choice(light=low, share=share, across=(number - before) / share)


@ti.func
def sample_near(
    near: ti.template(), lights: ti.template(), env: ti.template(), row, kind, first, count, point, index, scramble
):
    """A point of one of `count` (> 0) lights, chosen by what they give where `row` of the grid speaks for surfaces.

    The irradiance that it stands for is `value` times the cosine at the receiver. `kind` is 0 for windows and 1 for
    lamps, `first` the first light of the kind; `index` and `scramble` are those of `sobol_2d`. Where all of a kind give
    next to nothing, most samples have no `value`, and the others stand for them (Russian roulette).
    """
    sample = LightSample(direction=vec3(0.0, 0.0, 1.0), distance=FAR, value=vec3(0.0), radiance=vec3(0.0), density=0.0)
    every = ti.cast(near[row + kind], ti.i32)
    if index % every == 0:
        xi = sobol_2d(index // every, scramble)
        chosen = choose(near, row, first, count, xi.x)
        across = ti.Vector([chosen.across, xi.y])
        sample = point_of_light(
            lights, env, chosen.light, chosen.share / lights[chosen.light * LIGHT_STRIDE + 13], point, across
        )
        sample.value *= ti.cast(every, ti.f32)
    return sample


@ti.func
def sample_row(near: ti.template(), lights: ti.template(), env: ti.template(), row, kind, first, count, point, xi):
    """As `sample_near`, from a row of the grid and by random numbers; its `density` is 0 where it is left out.

    Otherwise `density` counts that it might have been.
    """
    sample = LightSample(direction=vec3(0.0, 0.0, 1.0), distance=FAR, value=vec3(0.0), radiance=vec3(0.0), density=0.0)
    number = xi.x * near[row + kind]
    if number < 1.0:
        chosen = choose(near, row, first, count, number)
        density = chosen.share / (near[row + kind] * lights[chosen.light * LIGHT_STRIDE + 13])
        sample = point_of_light(lights, env, chosen.light, density, point, ti.Vector([chosen.across, xi.y]))
    return sample


@ti.func
def density_in_row(near: ti.template(), lights: ti.template(), row, kind, first, light, offset, direction):
    """Density, per solid angle, with which `sample_row` would have found a point of a light at `offset`."""
    share = near[row + KINDS + light]
    if light > first:
        share -= near[row + KINDS + light - 1]
    cosine = light_cosine(lights, light * LIGHT_STRIDE, direction)
    density = ti.max(share, 1e-12) / (near[row + kind] * lights[light * LIGHT_STRIDE + 13])
    return ti.select(cosine > 0.0, density * offset.norm_sqr() / ti.max(cosine, 1e-6), 0.0)


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
                given = (
                    radiance.max() * lights[base + 13] * ti.max(cosine, LEAST_COSINE) / ti.max(distance2, NEAREST_M2)
                )
                seen = UNSEEN
                if received > 0.0:
                    hit = trace(nodes, leaves, 0, point, direction, ti.sqrt(distance2) * 0.999, True)
                    seen = ti.select(hit.t < FAR, UNSEEN, 1.0)
                total += given * ti.max(received, LEAST_COSINE) * seen
        weights[index] = total
