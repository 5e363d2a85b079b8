# mypy: ignore-errors
"""Sky radiance and points on light sources."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import vec3
from benchbot_sim_taichi.lights import LIGHT_STRIDE

MIN_DISTANCE2_M2 = 0.0025


@ti.func
def sky_radiance(env: ti.template(), direction):
    """Sky along unit `direction`: horizon to zenith above, ground below, blended over half a degree at the horizon."""
    height = ti.math.clamp(direction.z, -1.0, 1.0)
    above = load3(env, 9) + (load3(env, 6) - load3(env, 9)) * ti.sqrt(ti.max(height, 0.0))
    blend = ti.math.clamp(height * 60.0 + 0.5, 0.0, 1.0)
    return load3(env, 12) * (1.0 - blend) + above * blend


@ti.dataclass
class LightSample:
    """Unit direction to a point of a light, distance to test for shadow, and irradiance per cosine."""

    direction: vec3
    distance: ti.f32
    value: vec3


@ti.func
def sample_light(lights: ti.template(), env: ti.template(), first, count, point, xi):
    """Choose a point on lights `first` … `first + count` - 1 (`count` > 0), seen from `point`.

    The irradiance that it stands for is `value` times the cosine at the receiver.
    """
    low = first
    high = first + count - 1
    while low < high:
        middle = (low + high) >> 1
        if lights[middle * LIGHT_STRIDE + 12] <= xi.x:
            low = middle + 1
        else:
            high = middle
    base = low * LIGHT_STRIDE
    before = 0.0
    if low > first:
        before = lights[base - LIGHT_STRIDE + 12]
    across = (xi.x - before) / ti.max(lights[base + 12] - before, 1e-12)
    root = ti.sqrt(ti.math.clamp(across, 0.0, 1.0))
    target = (
        load3(lights, base) + load3(lights, base + 3) * (root * (1.0 - xi.y)) + load3(lights, base + 6) * (root * xi.y)
    )
    offset = target - point
    distance2 = ti.max(offset.norm_sqr(), 1e-10)
    distance = ti.sqrt(distance2)
    direction = offset / distance
    normal = load3(lights, base + 9)
    cosine = -normal.dot(direction)
    if normal.norm_sqr() < 0.5:
        plane = load3(lights, base + 3).cross(load3(lights, base + 6)).normalized(1e-12)
        cosine = ti.abs(plane.dot(direction))
    radiance = load3(lights, base + 14)
    if lights[base + 17] > 0.5:
        radiance = sky_radiance(env, direction)
    geometry = ti.max(cosine, 0.0) / ti.max(distance2, MIN_DISTANCE2_M2)
    return LightSample(
        direction=direction,
        distance=distance * 0.999,
        value=radiance * (geometry / lights[base + 13]),
    )
