# mypy: ignore-errors
"""Light that is kept at the nodes of surfaces, looked up. A node has three words, see `smoothing.finish`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.charts import PLACE_STRIDE
from benchbot_sim_taichi.kernels.panes import sent
from benchbot_sim_taichi.kernels.sampling import ONE_OVER_2_32, cone_direction, hash_u32
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, vec3
from benchbot_sim_taichi.tables import TRIANGLE_STRIDE

OFFSET_M = 5e-4
LIGHT_WORDS = 3
SUN_STEPS = 32767.0
VECTOR_STEPS = 511.0
DIFFERENT_SUN = 0.02
SUN_PROBES = 4
SUN_RAYS = 8


@ti.dataclass
class StoredLight:
    """Irradiance without the sun's, the share of the sun that is seen, and whether a ray would know it better.

    `vector` is the mean direction from which irradiance comes, shorter the more directions there are.
    """

    irradiance: vec3
    sun: ti.f32
    is_sun_edge: ti.i32
    vector: vec3


@ti.func
def stored_light(
    places: ti.template(), index: ti.template(), light: ti.template(), triangles: ti.template(), hit, face
):
    """Blend the nodes around a hit, of the side of its triangle that `face` (towards the viewer) is the normal of."""
    back = ti.cast(load3(triangles, hit.triangle * TRIANGLE_STRIDE + 15).dot(face) < 0.0, ti.i32)
    at = (hit.triangle * 2 + back) * PLACE_STRIDE
    stored = StoredLight(irradiance=vec3(0.0), sun=0.0, is_sun_edge=0, vector=vec3(0.0))
    first = places[at]
    if first >= 0.0:
        width = ti.cast(places[at + 1], ti.i32)
        x = ti.max(places[at + 2] + places[at + 4] * hit.u + places[at + 6] * hit.v, 0.0)
        y = ti.max(places[at + 3] + places[at + 5] * hit.u + places[at + 7] * hit.v, 0.0)
        x0 = ti.min(ti.cast(x, ti.i32), width - 2)
        # The last row has no other below it.
        y0 = ti.cast(ti.max(y - 1e-3, 0.0), ti.i32)
        across = ti.min(x - ti.cast(x0, ti.f32), 1.0)
        down = ti.min(y - ti.cast(y0, ti.f32), 1.0)
        entry = ti.cast(first, ti.i32) + y0 * width + x0
        lowest = 1.0
        highest = 0.0
        for k in ti.static(range(4)):
            node = ti.max(index[entry + (k & 1) + (k >> 1) * width], 0) * LIGHT_WORDS
            weight = across if ti.static(k & 1) else 1.0 - across
            weight *= down if ti.static(k >> 1) else 1.0 - down
            red_green = light[node]
            blue_sun = light[node + 1]
            # Values are never negative: sixteen bits are exponent and eight of the fraction.
            stored.irradiance += weight * vec3(
                ti.bit_cast((red_green & 0xFFFF) << 15, ti.f32),
                ti.bit_cast((red_green >> 1) & 0x7FFF8000, ti.f32),
                ti.bit_cast((blue_sun & 0xFFFF) << 15, ti.f32),
            )
            sun = ti.cast((blue_sun >> 16) & 0x7FFF, ti.f32) / SUN_STEPS
            stored.sun += weight * sun
            lowest = ti.min(lowest, sun)
            highest = ti.max(highest, sun)
            stored.is_sun_edge |= (blue_sun >> 31) & 1
            packed = light[node + 2]
            stored.vector += weight * vec3(
                ti.cast(packed & 0x3FF, ti.f32),
                ti.cast((packed >> 10) & 0x3FF, ti.f32),
                ti.cast(packed >> 20, ti.f32),
            )
        stored.vector = stored.vector / VECTOR_STEPS - 1.0
        stored.is_sun_edge |= ti.cast(highest - lowest > DIFFERENT_SUN, ti.i32)
    return stored


@ti.func
def light_at(
    nodes: ti.template(),
    leaves: ti.template(),
    sheer_root,
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    env: ti.template(),
    places: ti.template(),
    index: ti.template(),
    light: ti.template(),
    hit,
    face,
    point,
    number,
):
    """As `stored_light`, with rays to the sun where the nodes around do not agree about it."""
    stored = stored_light(places, index, light, triangles, hit, face)
    if stored.is_sun_edge == 1:
        stored.sun = sun_share(
            nodes, leaves, sheer_root, triangles, materials, texels, images, env, face, point, number
        )
    return stored


@ti.func
def sun_share(
    nodes: ti.template(),
    leaves: ti.template(),
    sheer_root,
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    env: ti.template(),
    face,
    point,
    number,
):
    """Share of the sun that is seen, by rays.

    Four go to places all about near the rim of its disc, more to all of it if they disagree; `number` turns them.
    """
    seen = 0.0
    if face.dot(load3(env, 0)) > 0.0:
        lifted = point + face * OFFSET_M
        turn = ti.cast(hash_u32(number), ti.f32) * ONE_OVER_2_32
        rays = SUN_PROBES
        first = 0.0
        total = 0.0
        k = 0
        while k < rays:
            place = ti.Vector([0.8, turn + 0.5 * ti.cast(k, ti.f32) + 0.25 * ti.cast(k // 2, ti.f32)])
            if k >= SUN_PROBES:
                part = ti.cast(k - SUN_PROBES, ti.f32) / ti.cast(SUN_RAYS - SUN_PROBES, ti.f32)
                place = ti.Vector([0.06 + 0.54 * part, turn + 0.25 + 0.7639 * ti.cast(k, ti.f32)])
            toward = cone_direction(load3(env, 0), env[15], place)
            share = sent(
                nodes, leaves, sheer_root, triangles, materials, texels, images, lifted, toward, FAR
            ).share.min()
            if k == 0:
                first = share
            elif ti.abs(share - first) > DIFFERENT_SUN:
                rays = SUN_RAYS
            total += share
            k += 1
        seen = total / ti.cast(rays, ti.f32)
    return seen
