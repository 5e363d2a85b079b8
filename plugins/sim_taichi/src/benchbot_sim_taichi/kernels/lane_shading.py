# mypy: ignore-errors
"""The stored light of sixteen surfaces and what they send to the viewer, a lane each, for processors.

The same as `lightmap.stored_light`, `reflectance.environment_brdf` and `shading`; `lane_surface` finds the surfaces.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.charts import PLACE_STRIDE
from benchbot_sim_taichi.kernels.lanes import (
    LANE_BITS,
    Lanes3,
    dot3,
    equal_lanes,
    from_bits,
    gather,
    gather_ints,
    ints16,
    lanes3,
    larger,
    normalized3,
    product3,
    scaled3,
    smaller,
    sum3,
    to_floats,
    to_ints,
    union,
    vec16,
)
from benchbot_sim_taichi.kernels.lightmap import DIFFERENT_SUN, LIGHT_WORDS, SUN_STEPS, VECTOR_STEPS
from benchbot_sim_taichi.kernels.reflectance import INV_PI
from benchbot_sim_taichi.kernels.shading import EVEN_COSINE, EVER_LESS, LESS_FACING, LOBE_COSINE, TO_LOBE
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.lights import ALBEDO_AT
from benchbot_sim_taichi.reflectance import ALBEDO_STEPS


@ti.dataclass
class LaneLight:
    """`lightmap.StoredLight` of each lane."""

    irradiance: Lanes3
    sun: vec16
    is_sun_edge: ints16
    vector: Lanes3


@ti.func
def stored_lights(
    places: ti.template(),
    index: ti.template(),
    light: ti.template(),
    triangle: ti.template(),
    is_back: ti.template(),
    u: ti.template(),
    v: ti.template(),
):
    """See `lightmap.stored_light`."""
    first, width = vec16(-1.0), vec16(2.0)
    x, y = vec16(0.0), vec16(0.0)
    sides = triangle * 2 + is_back
    numbers = sides
    left = union(ti.select(triangle >= 0, ints16(LANE_BITS), ints16(0)))
    while left != 0:
        at = numbers[31 - ti.math.clz(left)]
        mine = equal_lanes(sides, at)
        left &= ~union(mine)
        at *= PLACE_STRIDE
        first = ti.select(mine != 0, vec16(places[at]), first)
        width = ti.select(mine != 0, vec16(places[at + 1]), width)
        x = ti.select(mine != 0, places[at + 2] + places[at + 4] * u + places[at + 6] * v, x)
        y = ti.select(mine != 0, places[at + 3] + places[at + 5] * u + places[at + 7] * v, y)
    known = ti.select(first >= 0.0, vec16(1.0), vec16(0.0))
    x = larger(x, vec16(0.0))
    y = larger(y, vec16(0.0))
    x0 = ti.floor(smaller(x, width - 2.0))
    # The last row has no other below it.
    y0 = ti.floor(larger(y - 1e-3, vec16(0.0)))
    across = smaller(x - x0, vec16(1.0))
    down = smaller(y - y0, vec16(1.0))
    columns = to_ints(width)
    entry = to_ints(larger(first, vec16(0.0))) + ti.select(first >= 0.0, to_ints(y0) * columns + to_ints(x0), ints16(0))
    below = ti.select(first >= 0.0, entry + columns, entry)
    beside = ti.select(first >= 0.0, ints16(1), ints16(0))
    nothing = lanes3(ti.Vector([0.0, 0.0, 0.0]))
    stored = LaneLight(irradiance=nothing, sun=vec16(0.0), is_sun_edge=ints16(0), vector=nothing)
    lowest, highest = vec16(1.0), vec16(0.0)
    for k in range(4):
        node = gather_ints(index, ti.select(k > 1, below, entry) + beside * (k % 2))
        node = ti.select(node < 0, ints16(0), node) * LIGHT_WORDS
        weight = ti.select(k % 2 == 1, across, 1.0 - across) * ti.select(k > 1, down, 1.0 - down) * known
        red_green = gather_ints(light, node)
        blue_sun = gather_ints(light, node + 1)
        stored.irradiance.x += weight * from_bits((red_green & 0xFFFF) << 15)
        stored.irradiance.y += weight * from_bits((red_green >> 1) & 0x7FFF8000)
        stored.irradiance.z += weight * from_bits((blue_sun & 0xFFFF) << 15)
        sun = to_floats((blue_sun >> 16) & 0x7FFF) * (1.0 / SUN_STEPS)
        stored.sun += weight * sun
        lowest = smaller(lowest, sun)
        highest = larger(highest, sun)
        stored.is_sun_edge |= (blue_sun >> 31) & 1
        packed = gather_ints(light, node + 2)
        stored.vector.x += weight * to_floats(packed & 0x3FF)
        stored.vector.y += weight * to_floats((packed >> 10) & 0x3FF)
        stored.vector.z += weight * to_floats(packed >> 20)
    stored.vector.x = stored.vector.x * (1.0 / VECTOR_STEPS) - 1.0
    stored.vector.y = stored.vector.y * (1.0 / VECTOR_STEPS) - 1.0
    stored.vector.z = stored.vector.z * (1.0 / VECTOR_STEPS) - 1.0
    differs = ti.select(highest - lowest > DIFFERENT_SUN, ints16(1), ints16(0))
    stored.is_sun_edge = ti.select(first >= 0.0, stored.is_sun_edge | differs, ints16(0))
    return stored


@ti.func
def mirrored_shares(env: ti.template(), direction: ti.template(), surface: ti.template()):
    """See `shading.mirrored_share`."""
    cosine = smaller(larger(0.0 - dot3(surface.normal, direction), vec16(0.0)), vec16(1.0))
    row = surface.roughness * (ALBEDO_STEPS - 1.0)
    column = ti.sqrt(cosine) * (ALBEDO_STEPS - 1.0)
    row0 = smaller(ti.floor(row), vec16(ALBEDO_STEPS - 2.0))
    column0 = smaller(ti.floor(column), vec16(ALBEDO_STEPS - 2.0))
    down = row - row0
    right = column - column0
    upper = to_ints((row0 * float(ALBEDO_STEPS) + column0) * 2.0) + ALBEDO_AT
    scale, bias = vec16(0.0), vec16(0.0)
    for k in range(4):
        at = upper + ((k // 2) * ALBEDO_STEPS + k % 2) * 2
        weight = ti.select(k % 2 == 1, right, 1.0 - right) * ti.select(k > 1, down, 1.0 - down)
        scale += gather(env, at) * weight
        bias += gather(env, at + 1) * weight
    return Lanes3(
        x=surface.specular.x * scale + bias, y=surface.specular.y * scale + bias, z=surface.specular.z * scale + bias
    )


@ti.func
def dull_reflections(direction: ti.template(), surface: ti.template(), stored: ti.template()):
    """See `shading.dull_reflection`."""
    cosine = larger(0.0 - dot3(surface.normal, direction), vec16(0.0))
    lean = 1.0 - surface.roughness * (surface.roughness * EVER_LESS + cosine * LESS_FACING)
    height = cosine + surface.roughness * (LOBE_COSINE - cosine) * TO_LOBE
    steep = smaller(larger(dot3(surface.normal, stored.vector), vec16(0.0)), vec16(1.0))
    along = lean * (dot3(stored.vector, direction) + steep * cosine)
    up = (steep - EVEN_COSINE) * (height - EVEN_COSINE)
    root = larger(1.0 + along + smaller(4.5 * up, 2.25 * up), vec16(0.0))
    return scaled3(stored.irradiance, root * root * root * root * INV_PI)


@ti.func
def shade_lanes(
    env: ti.template(),
    direction: ti.template(),
    surface: ti.template(),
    irradiance: ti.template(),
    sun: ti.template(),
    mirrored: ti.template(),
    reflection: ti.template(),
):
    """See `shading.shade`."""
    toward = lanes3(load3(env, 0))
    cosine = larger(dot3(surface.normal, toward), vec16(0.0)) * sun
    sunlight = Lanes3(x=cosine * env[3], y=cosine * env[4], z=cosine * env[5])
    matt = scaled3(
        product3(surface.diffuse, Lanes3(x=1.0 - mirrored.x, y=1.0 - mirrored.y, z=1.0 - mirrored.z)),
        vec16(INV_PI),
    )
    radiance = sum3(surface.emission, product3(mirrored, reflection))
    radiance = sum3(radiance, product3(sum3(irradiance, sunlight), matt))
    if union(ti.select(cosine > 0.0, ints16(1), ints16(0))) != 0:
        half = normalized3(Lanes3(x=toward.x - direction.x, y=toward.y - direction.y, z=toward.z - direction.z))
        nv = larger(0.0 - dot3(surface.normal, direction), vec16(1e-3))
        nl = larger(dot3(surface.normal, toward), vec16(1e-3))
        nh = larger(dot3(surface.normal, half), vec16(0.0))
        alpha = larger(surface.roughness * surface.roughness, vec16(0.02))
        a2 = alpha * alpha
        d = nh * nh * (a2 - 1.0) + 1.0
        visibility = 0.5 / (nl * ti.sqrt(nv * nv * (1.0 - a2) + a2) + nv * ti.sqrt(nl * nl * (1.0 - a2) + a2))
        peak = smaller(a2 * INV_PI / (d * d) * visibility, vec16(50.0))
        away = 1.0 - larger(0.0 - dot3(half, direction), vec16(0.0))
        grazing = away * away * away * away * away
        highlight = Lanes3(
            x=surface.specular.x + (1.0 - surface.specular.x) * grazing,
            y=surface.specular.y + (1.0 - surface.specular.y) * grazing,
            z=surface.specular.z + (1.0 - surface.specular.z) * grazing,
        )
        radiance = sum3(radiance, product3(sunlight, scaled3(highlight, peak)))
    return radiance


@ti.func
def compressed(color: ti.template()):
    """See `shading.compress`."""
    return scaled3(color, 1.0 / (1.0 + larger(color.x, larger(color.y, color.z))))
