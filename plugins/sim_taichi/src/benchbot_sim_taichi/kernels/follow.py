# mypy: ignore-errors
"""Rays that gather light, followed to where it comes from: through panes, and by way of what mirrors."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.lightmap import OFFSET_M
from benchbot_sim_taichi.kernels.panes import MAX_LAYERS, STEP_M, sheerness
from benchbot_sim_taichi.kernels.reflectance import mirror_direction, mirror_share, pane_reflectance
from benchbot_sim_taichi.kernels.sampling import draw
from benchbot_sim_taichi.kernels.shading import REFLECT_ROUGHNESS, mirrored_share, sun_highlight
from benchbot_sim_taichi.kernels.surface import Surface, load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, trace, vec3
from benchbot_sim_taichi.tables import MATERIAL_STRIDE, TRIANGLE_STRIDE

MOST_MIRRORS = 4
NEAR_PANE_M = 0.5
"""Sky through panes nearer than that is gathered by rays all about. Points on a pane find sky with fewer rays where it
is far, and make what is near it too bright by chance, or too dark."""
LEAST_FOOTPRINT_M = 0.03
FOOTPRINT_PER_M = 0.03  # wider than a picture's: a ray stands for many, but coarse levels of an image mix its parts
MORE_MIRRORED = 5.0
MOST_MORE = 0.2
LEAST_ROUGHNESS = 0.4
"""Of what mirrors the sun: too few rays would meet a sharper spot."""


@ti.dataclass
class Arrival:
    """Where a ray ends: the hit and the ray's last stretch, the share of light that comes from there.

    `first_m` is the distance to the first opaque surface, `pane_m` along the last stretch to its last pane. Of the
    light on a surface `matt` is sent on by its matt lobe, besides the colour of that, and `evenly` is mirrored without
    a ray for it. `likely` is how likely the ray was to end there and not to be mirrored, which `matt` counts in.
    `is_inside`: the ray came from within a solid.
    """

    hit: Hit
    origin: vec3
    direction: vec3
    share: vec3
    matt: vec3
    evenly: vec3
    likely: ti.f32
    first_m: ti.f32
    pane_m: ti.f32
    panes: ti.i32
    mirrors: ti.i32
    is_inside: ti.i32


@ti.func
def is_inside(triangles: ti.template(), materials: ti.template(), triangle, toward):
    """Return 1 if a ray that meets a triangle comes from within the solid which it bounds, else 0."""
    base = triangle * TRIANGLE_STRIDE
    is_sheet = ti.cast(materials[ti.cast(triangles[base + 18], ti.i32) * MATERIAL_STRIDE + 14], ti.i32)
    return ti.select(load3(triangles, base + 15).dot(toward) > 0.0, 1 - is_sheet, 0)


@ti.func
def follow(
    nodes: ti.template(),
    leaves: ti.template(),
    sheer_root,
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    env: ti.template(),
    origin,
    direction,
    even_m,
    number,
    toss,
):
    """Return where a ray ends, and the surface there if it meets one.

    Panes and surfaces mirror it by chance (`number`), surfaces by their upper lobe, the first by `toss` (0 … 1). Dull
    ones do not, nor those that it meets before `even_m`: what they mirror is known without a ray, and few would be
    noise.
    """
    end = Arrival(
        hit=Hit(t=FAR, triangle=-1, u=0.0, v=0.0),
        origin=origin,
        direction=direction,
        share=vec3(1.0),
        matt=vec3(0.0),
        evenly=vec3(0.0),
        likely=1.0,
        first_m=-1.0,
        pane_m=FAR,
        panes=0,
        mirrors=0,
        is_inside=0,
    )
    surface = Surface()
    state = number
    root = 0
    start = 0.0
    layers = 0
    while root >= 0:
        found = trace(nodes, leaves, root, end.origin + end.direction * start, end.direction, end.hit.t - start, False)
        is_mirrored = False
        at = end.origin
        turned = end.direction
        chance, state = draw(state)
        if root == 0:
            end.hit = found
            root = sheer_root
        elif found.triangle >= 0 and layers < MAX_LAYERS:
            layer = sheerness(triangles, materials, texels, images, found.triangle, found.u, found.v, end.direction)
            start += found.t + STEP_M
            layers += 1
            # The light of leaves and grilles is that of what is behind them.
            if layer.panes == 1:
                across = load3(triangles, found.triangle * TRIANGLE_STRIDE + 15)
                facing = across.dot(end.direction)
                glass = ti.cast(triangles[found.triangle * TRIANGLE_STRIDE + 18], ti.i32) * MATERIAL_STRIDE
                mirrored = pane_reflectance(materials[glass + 16], ti.abs(facing))
                if chance < mirrored:
                    is_mirrored = True
                    at = end.origin + end.direction * (start - 2.0 * STEP_M)
                    turned = end.direction - across * (2.0 * facing)
                else:
                    end.share *= layer.share / (1.0 - mirrored)
                    end.panes += 1
                    end.pane_m = start - STEP_M
        else:
            root = -1
        if root < 0 and end.hit.triangle >= 0:
            hit = end.hit
            end.first_m = ti.select(end.first_m < 0.0, hit.t, end.first_m)
            end.is_inside = is_inside(triangles, materials, hit.triangle, end.direction)
            footprint_m = LEAST_FOOTPRINT_M + FOOTPRINT_PER_M * hit.t
            surface = surface_at(
                triangles, materials, texels, images, hit.triangle, hit.u, hit.v, end.direction, footprint_m
            )
            mirrored = mirrored_share(env, end.direction, surface.normal, surface)
            is_near = end.mirrors == 0 and hit.t < even_m
            is_dull = surface.roughness >= REFLECT_ROUGHNESS
            if end.is_inside == 1 or is_near or is_dull or end.mirrors == MOST_MIRRORS:
                end.matt = vec3(1.0) - mirrored
                end.evenly = mirrored
            else:
                chance = ti.select(end.mirrors == 0, toss, chance)
                # One of 25 rays that finds a window is a bright spot; one of five, with a fifth of its light, is none.
                share = ti.min(ti.max(mirrored.max(), ti.min(MORE_MIRRORED * mirrored.max(), MOST_MORE)), 0.999)
                end.likely = 1.0 - share
                if chance < share:
                    first, state = draw(state)
                    second, state = draw(state)
                    view = negated(end.direction)
                    turned = mirror_direction(surface.normal, view, surface.roughness, ti.Vector([first, second]))
                    sent_on = mirror_share(surface.normal, view, turned, surface.specular, surface.roughness)
                    is_mirrored = surface.face.dot(turned) > 0.0
                    at = end.origin + end.direction * hit.t + surface.face * OFFSET_M
                    end.share *= ti.select(is_mirrored, sent_on / share, vec3(0.0))
                else:
                    end.matt = (vec3(1.0) - mirrored) / end.likely
        if is_mirrored:
            end.mirrors += 1
            end.origin = at
            end.direction = turned
            end.hit = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
            root = 0
            start = 0.0
            layers = 0
    return end, surface


@ti.func
def mirrored_sun(env: ti.template(), direction, surface):
    """Return what a surface in the sun sends of its light by the upper lobe, per unit irradiance (3)."""
    roughness = ti.max(surface.roughness, LEAST_ROUGHNESS)
    return sun_highlight(surface.normal, negated(direction), load3(env, 0), surface.specular, roughness)
