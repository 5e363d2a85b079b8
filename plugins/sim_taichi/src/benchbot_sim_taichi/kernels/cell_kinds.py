# mypy: ignore-errors
"""Kinds of points on surfaces that may lie in one cell and get quite different light; `surface_cells` names them."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.cell_lookup import SLOT_M
from benchbot_sim_taichi.kernels.cells import CLEAR_M, OFFSET_M, sample_point
from benchbot_sim_taichi.kernels.follow import is_inside
from benchbot_sim_taichi.kernels.panes import sent
from benchbot_sim_taichi.kernels.sampling import cosine_direction, hash_u32, sobol_2d
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3
from benchbot_sim_taichi.surface_cells import BEHIND, BURIED, OPEN, OUTDOORS, SAMPLE_STRIDE, SLOT
from benchbot_sim_taichi.tables import TRIANGLE_STRIDE

PROBES = 6
LEAST_OUT = 2  # of them, where a sample is in no slot
OUTDOORS_RAYS = 8  # one to the sun, the others about


@ti.kernel
def find_kinds(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    portals: ti.i32,
    vertices: floats,
    samples: floats,
    kinds: ints,
    count: ti.i32,
    seed: ti.i32,
):
    """Fill `kinds` with the kinds of all samples.

    Those from which no ray gets out of a solid are buried in it, as a ceiling is below the dome of a lamp. Those from
    which hardly a ray gets further than `SLOT_M` are in a slot, as between a sill and the wall below it. Where panes
    keep a room from the sky, others that see the sky or the sun without one are outdoors.
    """
    for sample in range(count):
        triangle = ti.cast(samples[sample * SAMPLE_STRIDE], ti.i32)
        face = load3(triangles, triangle * TRIANGLE_STRIDE + 15) * samples[sample * SAMPLE_STRIDE + 3]
        position = sample_point(triangles, vertices, samples, sample) + face * OFFSET_M
        scramble = hash_u32(sample ^ hash_u32(seed + 1))
        buried = 0
        gets_out = 0
        for k in range(PROBES):
            if buried == k or gets_out < LEAST_OUT:
                out = cosine_direction(face, sobol_2d(k, scramble))
                hit = trace(nodes, leaves, 0, position, out, FAR, False)
                gets_out += ti.cast(hit.t >= SLOT_M, ti.i32)
                if hit.triangle >= 0:
                    buried += is_inside(triangles, materials, hit.triangle, out)
        kind = ti.select(buried == PROBES, BURIED, ti.select(gets_out < LEAST_OUT, SLOT, OPEN))
        for k in range(ti.select(portals > 0 and kind == OPEN, OUTDOORS_RAYS, 0)):
            if kind == OPEN:
                out = cosine_direction(face, sobol_2d(k, scramble))
                if k == 0:
                    out = load3(env, 0)
                if face.dot(out) > 0.0:
                    passed = sent(nodes, leaves, sheer_root, triangles, materials, texels, images, position, out, FAR)
                    if passed.share.max() > 0.0 and passed.panes == 0:
                        kind = OUTDOORS
        kinds[sample] = kind


@ti.kernel
def find_sides(
    nodes: floats,
    leaves: floats,
    triangles: floats,
    vertices: floats,
    samples: floats,
    first: ints,
    kinds: ints,
    count: ti.i32,
):
    """Change the kinds of samples in a room that a wall parts from the first such one of their cell."""
    for cell in range(count):
        anchor = vec3(0.0)
        is_first = True
        for sample in range(first[cell], first[cell + 1]):
            if kinds[sample] == OPEN:
                triangle = ti.cast(samples[sample * SAMPLE_STRIDE], ti.i32)
                face = load3(triangles, triangle * TRIANGLE_STRIDE + 15) * samples[sample * SAMPLE_STRIDE + 3]
                point = sample_point(triangles, vertices, samples, sample) + face * CLEAR_M
                way = point - anchor
                away = way.norm()
                if is_first:
                    anchor = point
                    is_first = False
                elif away > 0.0 and trace(nodes, leaves, 0, anchor, way / away, away, True).triangle >= 0:
                    kinds[sample] = BEHIND
