# mypy: ignore-errors
"""Sky radiance and points on light sources."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.sampling import TWO_PI, orthonormal
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import vec3
from benchbot_sim_taichi.lights import LIGHT_STRIDE, SKY_AT, SKY_STEPS

MIN_DISTANCE2_M2 = 0.0025


@ti.func
def sky_radiance(env: ti.template(), direction):
    """Sky along unit `direction`: a table's, or horizon to zenith above; ground below, blended over half a degree."""
    height = ti.math.clamp(direction.z, -1.0, 1.0)
    above = load3(env, 9) + (load3(env, 6) - load3(env, 9)) * ti.sqrt(ti.max(height, 0.0))
    if env[16] > 0.5:
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
        above = near * (1.0 - fy) + far * fy
    blend = ti.math.clamp(height * 60.0 + 0.5, 0.0, 1.0)
    return load3(env, 12) * (1.0 - blend) + above * blend


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
