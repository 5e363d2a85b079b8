# mypy: ignore-errors
"""Radiance of surfaces in the sun."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.charts import NODE_M
from benchbot_sim_taichi.kernels.bake import RAW_STRIDE, node_at
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.reflectance import INV_PI, mean_mirrored
from benchbot_sim_taichi.kernels.shading import mirrored_share
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import floats, ints, vec3
from benchbot_sim_taichi.surface_cells import SAMPLE_STRIDE


@ti.kernel
def find_glow(
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    vertices: floats,
    samples: floats,
    charted: ints,
    raw: floats,
    glow: floats,
    count: ti.i32,
):
    """Fill `glow` (3 per node) with the radiance that nodes send of the sunshine on them."""
    for node in range(count):
        here = node_at(triangles, vertices, samples, charted, node)
        base = node * SAMPLE_STRIDE
        triangle = ti.cast(samples[base], ti.i32)
        u, v = samples[base + 1], samples[base + 2]
        surface = surface_at(triangles, materials, texels, images, triangle, u, v, negated(here.face), NODE_M)
        sun = raw[node * RAW_STRIDE + 10] * ti.max(here.normal.dot(load3(env, 0)), 0.0)
        lit = load3(env, 3) * sun
        mirrored = mean_mirrored(env, surface.specular, surface.roughness)
        sent_on = surface.diffuse * (vec3(1.0) - mirrored)
        sent_on += mirrored_share(env, negated(load3(env, 0)), here.normal, surface)
        for i in ti.static(range(3)):
            glow[node * 3 + i] = sent_on[i] * lit[i] * INV_PI
