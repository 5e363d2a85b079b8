# mypy: ignore-errors
"""Light that comes to the nodes of surfaces straight from windows, lamps and the sun, by rays.

A node's raw light is 19 values: irradiance straight from windows and lamps, irradiance by way of surfaces nearer than
`indirect.NEAR_M`, and by way of all others, how much of the hemisphere those others fill (1: all), the share of the sun
that is seen, how much the node counts (next to nothing inside of solids), irradiance that it has found by chance (of
what is small and bright one node in many meets a point, and would be a bright spot), and the light vector along the
surface (Gershun, "The light field", 1939): directions to all that it has found, times the sum of the three colours from
there.

Each of 8 x 8 nodes of a chart takes a stratum of its own of each ray, so that an average over neighbours is one over
well spread rays (interleaved sampling: Keller and Heidrich, 2001).
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.charts import NODE_STRIDE
from benchbot_sim_taichi.kernels.cells import sample_normals, sample_point
from benchbot_sim_taichi.kernels.follow import NEAR_PANE_M, is_inside
from benchbot_sim_taichi.kernels.light import light_cosine
from benchbot_sim_taichi.kernels.light_grid import density_in_row, row_near, sample_near, shifted
from benchbot_sim_taichi.kernels.lightmap import OFFSET_M
from benchbot_sim_taichi.kernels.panes import sent
from benchbot_sim_taichi.kernels.sampling import (
    cone_direction,
    cosine_direction,
    hash_u32,
    interleave_index,
    sobol_2d,
)
from benchbot_sim_taichi.kernels.shading import EVEN_COSINE
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3
from benchbot_sim_taichi.lights import LIGHT_STRIDE

RAW_STRIDE = 19
PI = 3.14159265
DIRECT_RAYS = 16
SUN_RAYS = 8
PROBES = 8
PROBE, SUN = 2, 3  # kinds of rays, beside those to windows, 0, and to lamps, 1
GAP_M = 0.02  # what mouldings and pictures leave between themselves and a wall
HIDDEN_WEIGHT = 1e-3
LEAST_LIGHT = 1e-6  # from all around, so that the light vector of what nothing lights is that of even light


@ti.dataclass
class Node:
    """A node's place, lifted off its surface, its normal and its face's; stratum and scramble of its rays."""

    point: vec3
    normal: vec3
    face: vec3
    rank: ti.i32
    scramble: ti.i32


@ti.func
def node_at(triangles: ti.template(), vertices: ti.template(), samples: ti.template(), charted: ti.template(), node):
    """Return where a node is, and which rays it takes."""
    normal, face = sample_normals(triangles, samples, node)
    rank = ti.cast(hash_u32(node) & 63, ti.i32)
    scramble = 0
    if charted[node * NODE_STRIDE] >= 0:
        x, y = charted[node * NODE_STRIDE + 1], charted[node * NODE_STRIDE + 2]
        rank = interleave_index(x, y)
        scramble = ti.cast(hash_u32((y >> 3) * 65536 + (x >> 3)) >> 8, ti.i32)
    return Node(
        point=sample_point(triangles, vertices, samples, node) + face * OFFSET_M,
        normal=normal,
        face=face,
        rank=rank,
        scramble=scramble,
    )


@ti.kernel
def light_directly(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    lights: floats,
    portals: ti.i32,
    lamps: ti.i32,
    light_of: ints,
    near: floats,
    vertices: floats,
    samples: floats,
    charted: ints,
    raw: floats,
    first: ti.i32,
    count: ti.i32,
    seed: ti.i32,
):
    """Find the light of windows, lamps and the sun at `count` nodes from `first` on; all else of them becomes zero.

    Rays all about (`PROBES`) find out whether a node is hidden, and lamps that are too close to be found by points.
    """
    for node in range(first, first + count):
        at = node * RAW_STRIDE
        here = node_at(triangles, vertices, samples, charted, node)
        # Rows of blocks all about, so that no block's edge can be seen.
        row = row_near(near, shifted(near, here.point, here.normal, here.rank), here.normal)
        shut_in = 0
        direct = vec3(0.0)
        vector = here.normal * (EVEN_COSINE * LEAST_LIGHT)
        sun = 0.0
        for k in range(PROBES + DIRECT_RAYS * 2 + SUN_RAYS):
            ray = k - PROBES
            kind = ti.select(ray < 0, PROBE, ti.select(ray < DIRECT_RAYS * 2, ray // DIRECT_RAYS, SUN))
            toward = load3(env, 0)
            value = vec3(0.0)
            reach = FAR
            likely = 0.0
            rays = DIRECT_RAYS
            if kind == PROBE:
                rays = PROBES
                if lamps > 0 or shut_in == k:
                    toward = cosine_direction(here.normal, sobol_2d(here.rank * PROBES + k, here.scramble + seed + 4))
                    hit = trace(nodes, leaves, 0, here.point, toward, FAR, False)
                    if hit.t < GAP_M:
                        shut_in += 1
                    elif hit.triangle >= 0:
                        shut_in += is_inside(triangles, materials, hit.triangle, toward)
                    lamp = -1
                    if hit.triangle >= 0:
                        lamp = light_of[hit.triangle]
                    if lamp >= portals and light_cosine(lights, lamp * LIGHT_STRIDE, toward) > 0.0:
                        reach = hit.t * 0.999
                        value = load3(lights, lamp * LIGHT_STRIDE + 14) * (PI / ti.max(here.normal.dot(toward), 1e-6))
                        likely = near[row + 1] * density_in_row(
                            near, lights, row, 1, portals, lamp, toward * hit.t, toward
                        )
            elif shut_in < PROBES:
                if kind == SUN:
                    rays = SUN_RAYS
                    value = load3(env, 3)
                    toward = cone_direction(toward, env[15], sobol_2d(ray - DIRECT_RAYS * 2, hash_u32(node)))
                elif ti.select(kind == 0, portals, lamps) > 0:
                    every = ti.cast(near[row + kind], ti.i32)  # so that no sample is left out
                    light = sample_near(
                        near,
                        lights,
                        env,
                        row,
                        kind,
                        kind * portals,
                        ti.select(kind == 0, portals, lamps),
                        here.point,
                        (here.rank * DIRECT_RAYS + ray - kind * DIRECT_RAYS) * every,
                        here.scramble + seed + 1 + kind,
                    )
                    toward = light.direction
                    value = light.value / ti.cast(every, ti.f32)
                    likely = light.density
                    reach = ti.select(kind == 0, FAR, light.distance)
                    if kind == 1:
                        # Not bounded close by, as `value` is: probes share the weight there.
                        value = light.radiance / ti.max(likely, 1e-20)
                    elif light.distance < NEAR_PANE_M:
                        value = vec3(0.0)
            cosine = here.normal.dot(toward)
            if cosine > 0.0 and here.face.dot(toward) > 0.0 and value.max() > 0.0:
                passed = sent(
                    nodes, leaves, sheer_root, triangles, materials, texels, images, here.point, toward, reach
                )
                share = cosine / ti.cast(rays, ti.f32)
                if kind == SUN:
                    # The share of the colour of which panes let pass least; what passes more of the others is added.
                    least = passed.share.min()
                    sun += least / ti.cast(SUN_RAYS, ti.f32)
                    found = (passed.share - least) * value * share
                    direct += found
                    vector += toward * found.sum()
                else:
                    if kind != 0:
                        # Both ways to find a lamp, weighed by how likely each was (Veach and Guibas, 1995).
                        chosen, met = DIRECT_RAYS * likely, PROBES * cosine / PI
                        share *= ti.select(kind == PROBE, met, chosen) / ti.max(chosen + met, 1e-20)
                    found = passed.share * value * share
                    direct += found
                    vector += toward * found.sum()
        for i in ti.static(range(3)):
            raw[at + i] = direct[i]
            raw[at + 15 + i] = vector[i]
        raw[at + 18] = direct.sum() + LEAST_LIGHT
        for i in ti.static(range(3, 15)):
            raw[at + i] = 0.0
        raw[at + 9] = 1.0
        raw[at + 10] = sun
        raw[at + 11] = ti.select(shut_in == PROBES, HIDDEN_WEIGHT, 1.0)
