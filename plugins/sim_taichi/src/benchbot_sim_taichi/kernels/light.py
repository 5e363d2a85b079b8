# mypy: ignore-errors
"""Radiance of sky and surroundings, and points on light sources."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.exterior.canvas import COLUMNS, TEXEL
from benchbot_sim_taichi.exterior.panorama import BEND, LEVELS, ROWS
from benchbot_sim_taichi.kernels.sampling import TWO_PI, orthonormal
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import vec3
from benchbot_sim_taichi.lights import LIGHT_STRIDE, OUTLOOK_AT, SKY_AT, SKY_STEPS

MIN_DISTANCE2_M2 = 0.0025
COARSEST = 0.035  # the sky's table has steps of two degrees


@ti.func
def sky_radiance(env: ti.template(), direction):
    """Sky along unit `direction`, and ground below, blended over half a degree: coarse, for light and dull mirrors."""
    height = ti.math.clamp(direction.z, -1.0, 1.0)
    flat = ti.max(height, 0.0)
    scale = 0.5 * (SKY_STEPS - 1) / ti.sqrt(ti.max(1.0 + flat, 1e-6))
    x = ti.math.clamp(direction.x * scale + 0.5 * (SKY_STEPS - 1), 0.0, SKY_STEPS - 1.001)
    y = ti.math.clamp(direction.y * scale + 0.5 * (SKY_STEPS - 1), 0.0, SKY_STEPS - 1.001)
    x0 = ti.cast(x, ti.i32)
    y0 = ti.cast(y, ti.i32)
    fx = x - ti.cast(x0, ti.f32)
    fy = y - ti.cast(y0, ti.f32)
    at = SKY_AT + (y0 * SKY_STEPS + x0) * 3
    near = load3(env, at) * (1.0 - fx) + load3(env, at + 3) * fx
    far = load3(env, at + SKY_STEPS * 3) * (1.0 - fx) + load3(env, at + SKY_STEPS * 3 + 3) * fx
    blend = ti.math.clamp(height * 60.0 + 0.5, 0.0, 1.0)
    return load3(env, 12) * (1.0 - blend) + (near * (1.0 - fy) + far * fy) * blend


@ti.func
def outlook(env: ti.template(), direction, angle):
    """Radiance that a camera or a mirror sees along unit `direction`, of details not finer than `angle` (radians)."""
    radiance = vec3(0.0)
    if env[16] < 0.5 or angle > COARSEST:
        radiance = sky_radiance(env, direction)
    else:
        level = ti.cast(angle > 1.5 * TEXEL, ti.i32) + ti.cast(angle > 3.0 * TEXEL, ti.i32)
        columns = COLUMNS >> level
        rows = ROWS >> level
        start = OUTLOOK_AT
        for i in ti.static(range(LEVELS - 1)):
            start += ti.select(level > i, (COLUMNS >> i) * (ROWS >> i), 0)
        bent = direction.z / (ti.abs(direction.z) + BEND) * (1.0 + BEND)
        y = ti.math.clamp((bent + 1.0) * 0.5 * ti.cast(rows, ti.f32) - 0.5, 0.0, ti.cast(rows, ti.f32) - 1.001)
        turn = ti.atan2(direction.y, direction.x) / TWO_PI
        x = (turn - ti.floor(turn)) * ti.cast(columns, ti.f32) - 0.5
        left = ti.cast(ti.floor(x), ti.i32)
        below = ti.cast(y, ti.i32)
        fx = x - ti.floor(x)
        fy = y - ti.cast(below, ti.f32)
        right = ti.select(left + 1 >= columns, 0, left + 1)
        left = ti.select(left < 0, columns - 1, left)
        low = start + below * columns
        high = low + columns
        near = unpacked(env, low + left) * (1.0 - fx) + unpacked(env, low + right) * fx
        far = unpacked(env, high + left) * (1.0 - fx) + unpacked(env, high + right) * fx
        radiance = near * (1.0 - fy) + far * fy
    return radiance


@ti.func
def unpacked(env: ti.template(), at):
    """A texel of the panorama: `exterior.panorama.packed`."""
    bits = ti.bit_cast(env[at], ti.u32)
    scale = ti.bit_cast(ti.cast((bits >> 27) + 98, ti.i32) << 23, ti.f32)  # 2 ** (exponent - 29)
    red, green, blue = bits & 511, (bits >> 9) & 511, (bits >> 18) & 511
    return vec3(ti.cast(red, ti.f32), ti.cast(green, ti.f32), ti.cast(blue, ti.f32)) * scale


@ti.func
def is_sun(env: ti.template(), direction):
    """Return whether a unit direction meets the sun's disc."""
    return (direction - load3(env, 0)).norm_sqr() * 3.14159265358979 < env[17]


@ti.func
def sun_direction(env: ti.template(), xi):
    """Return the direction to a point of the sun's disc, uniform over its solid angle."""
    tangent, bitangent = orthonormal(load3(env, 0))
    below = xi.x * env[17] / TWO_PI
    radius = ti.sqrt(ti.max(below * (2.0 - below), 0.0))
    angle = TWO_PI * xi.y
    return (
        tangent * (radius * ti.cos(angle)) + bitangent * (radius * ti.sin(angle)) + load3(env, 0) * (1.0 - below)
    ).normalized()


@ti.dataclass
class LightSample:
    """Unit direction to a point of a light, distance to test for shadow, irradiance per cosine; radiance and density.

    `density` is that of the direction, per solid angle; `value` is their quotient but bounded close to the light.
    """

    direction: vec3
    distance: ti.f32
    value: vec3
    radiance: vec3
    density: ti.f32


@ti.func
def point_of_light(lights: ti.template(), env: ti.template(), light, area_density, point, xi):
    """A point of one light, seen from `point`, found with `area_density` (probability per area)."""
    base = light * LIGHT_STRIDE
    root = ti.sqrt(ti.math.clamp(xi.x, 0.0, 1.0))
    target = (
        load3(lights, base) + load3(lights, base + 3) * (root * (1.0 - xi.y)) + load3(lights, base + 6) * (root * xi.y)
    )
    offset = target - point
    distance2 = ti.max(offset.norm_sqr(), 1e-10)
    distance = ti.sqrt(distance2)
    direction = offset / distance
    cosine = light_cosine(lights, base, direction)
    radiance = load3(lights, base + 14)
    if lights[base + 17] > 0.5:
        radiance = sky_radiance(env, direction)
    geometry = ti.max(cosine, 0.0) / ti.max(distance2, MIN_DISTANCE2_M2)
    return LightSample(
        direction=direction,
        distance=distance * 0.999,
        value=radiance * (geometry / area_density),
        radiance=radiance,
        density=ti.select(cosine > 0.0, area_density * distance2 / ti.max(cosine, 1e-6), 0.0),
    )


@ti.func
def light_cosine(lights: ti.template(), base, direction):
    """Cosine between a light's normal and the way back along `direction`; sheets shine to both sides."""
    normal = load3(lights, base + 9)
    cosine = -normal.dot(direction)
    if normal.norm_sqr() < 0.5:
        cosine = ti.abs(load3(lights, base + 3).cross(load3(lights, base + 6)).normalized(1e-12).dot(direction))
    return cosine
