# mypy: ignore-errors
"""Light that comes to the nodes of surfaces by way of other surfaces, by rays; `bake` says what their raw light is."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.charts import NODE_M, NODE_STRIDE
from benchbot_sim_taichi.kernels.bake import GAP_M, HIDDEN_WEIGHT, LEAST_LIGHT, RAW_STRIDE, node_at
from benchbot_sim_taichi.kernels.cell_lookup import cell_met, interpolate_cells
from benchbot_sim_taichi.kernels.follow import NEAR_PANE_M, follow, mirrored_sun
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.light import sky_radiance
from benchbot_sim_taichi.kernels.light_grid import choose, row_near, shifted
from benchbot_sim_taichi.kernels.lightmap import stored_light
from benchbot_sim_taichi.kernels.panes import sent
from benchbot_sim_taichi.kernels.reflectance import INV_PI, mean_mirrored
from benchbot_sim_taichi.kernels.sampling import (
    cosine_direction,
    evenly_spread,
    hash_u32,
    sobol_2d,
)
from benchbot_sim_taichi.kernels.shading import EVEN_COSINE, mirrored_share, sent_by_dull
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, vec3
from benchbot_sim_taichi.surface_cells import CELL_STRIDE, SAMPLE_STRIDE

NEAR_M = 0.5
NEAR_SUN_M = 0.1  # a sill in the sun is small, and so bright that rays which meet it by chance are spots
MOST_BACKS = 0.5
MOST_BLOCKED = 0.75
MOST_OF_MEAN = 4.0
"""What a ray brings beyond so many times as much as others do on average is found by chance."""


@ti.func
def directed(
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    env: ti.template(),
    samples: ti.template(),
    node,
    here,
    direction,
):
    """Return what a node sends of the sunshine on it to who looks along `direction`, by what it sends on average."""
    base = node * SAMPLE_STRIDE
    triangle = ti.cast(samples[base], ti.i32)
    u, v = samples[base + 1], samples[base + 2]
    surface = surface_at(triangles, materials, texels, images, triangle, u, v, negated(here.face), NODE_M)
    matt = surface.diffuse * (vec3(1.0) - mean_mirrored(env, surface.specular, surface.roughness)) * INV_PI
    mirrored = mirrored_share(env, negated(load3(env, 0)), here.normal, surface) * INV_PI
    return (matt + mirrored_sun(env, direction, surface)) / ti.max(matt + mirrored, 1e-6)


@ti.func
def patch_below(shares: ti.template(), first, last, number):
    """Return the first entry from `first` to `last` that `number` is not above."""
    low = first
    high = last
    while low < high:
        middle = (low + high) >> 1
        if shares[middle] <= number:
            low = middle + 1
        else:
            high = middle
    return low


@ti.func
def beyond(light, most):
    """Return what of some light (3) has to go so that its brightest colour is `most`."""
    return light * (1.0 - ti.min(most / ti.max(light.max(), 1e-9), 1.0))


@ti.kernel
def gather(
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
    grid: ints,
    cells: floats,
    layout: floats,
    places: floats,
    index: ints,
    light: ints,
    vertices: floats,
    samples: floats,
    charted: ints,
    raw: floats,
    first_patch: ints,
    patches: ints,
    shares: floats,
    colors: floats,
    clusters_near: floats,
    clusters: ti.i32,
    rays_per_node: ti.i32,
    patches_per_node: ti.i32,
    adds_cells: ti.i32,
    first: ti.i32,
    count: ti.i32,
    seed: ti.i32,
):
    """Find the light that comes to the same nodes by way of other surfaces, and how much each node counts.

    What a surface sends on is what `light` has stored: all of its light, or, with `adds_cells` (1, else 0), its direct
    light, to which its cell adds the rest. Sunshine from beyond `NEAR_SUN_M` comes from `patches` instead, nodes that
    rays about would seldom meet: `clusters_near` chooses one of their clusters, whose patches are chosen by their part
    of all that it sends (`shares`, summed up), and `colors` (3 per patch) are what each sends, divided by that part.
    """
    for node in range(first, first + count):
        at = node * RAW_STRIDE
        here = node_at(triangles, vertices, samples, charted, node)
        near_light = vec3(0.0)
        far_light = vec3(0.0)
        open_share = 0.0
        backs = 0.0
        blocked = 0.0
        vector = vec3(0.0)
        brightest = vec3(0.0)
        is_brightest_far = False
        was_hidden = raw[at + 11] != 1.0
        rays = ti.select(was_hidden, 0, rays_per_node)
        for k in range(rays):
            toward = cosine_direction(here.normal, sobol_2d(here.rank * rays + k, here.scramble + seed + 3))
            if toward.dot(here.face) > 0.0:
                end, surface = follow(
                    nodes,
                    leaves,
                    sheer_root,
                    triangles,
                    materials,
                    texels,
                    images,
                    env,
                    here.point,
                    toward,
                    NEAR_M,
                    hash_u32(node ^ hash_u32(k + seed)),
                    evenly_spread(k, node),
                )
                radiance = vec3(0.0)
                # Few rays are mirrored: what they meet is noise unless averaged as light from afar.
                is_far = end.mirrors > 0 or end.hit.t > NEAR_M
                is_near_pane = end.mirrors == 0 and end.pane_m < NEAR_PANE_M
                if 0.0 <= end.first_m < GAP_M:
                    blocked += 1.0
                if end.is_inside == 1:
                    backs += 1.0
                    is_far = False
                elif end.hit.triangle >= 0:
                    stored = stored_light(places, index, light, triangles, end.hit, surface.face)
                    total = stored.irradiance
                    mirrored = sent_by_dull(end.direction, surface, stored)
                    if end.mirrors > 0 or end.hit.t < NEAR_SUN_M:
                        sunlight = load3(env, 3) * (stored.sun * ti.max(surface.face.dot(load3(env, 0)), 0.0))
                        total += sunlight
                        if end.mirrors > 0:
                            highlight = sunlight / end.likely * mirrored_sun(env, end.direction, surface)
                            radiance += surface.emission + highlight
                        else:
                            mirrored += sunlight * INV_PI
                    if adds_cells == 1:
                        point = end.origin + end.direction * end.hit.t
                        distance = ti.select(end.mirrors > 0, FAR, end.hit.t)
                        cell = cell_met(grid, cells, layout, point, surface.face, distance)
                        if cell >= 0:
                            bounced = load3(cells, cell * CELL_STRIDE + 9)
                            total += bounced
                            mirrored += bounced * INV_PI
                    radiance += surface.diffuse * end.matt * total * INV_PI + end.evenly * mirrored
                    radiance *= end.share
                elif portals == 0 or end.panes == 0 or end.mirrors > 0 or is_near_pane:
                    is_far = not is_near_pane
                    radiance = end.share * sky_radiance(env, end.direction)
                if is_far:
                    open_share += 1.0
                    far_light += radiance
                else:
                    near_light += radiance
                vector += toward * radiance.sum()
                if radiance.max() > brightest.max():
                    brightest = radiance
                    is_brightest_far = is_far
        counted = ti.cast(rays, ti.f32)
        scale = 1.0 / ti.max(counted - backs, 1.0)
        all_others = near_light + far_light - brightest
        by_chance = beyond(brightest, all_others.max() * MOST_OF_MEAN / ti.max(counted - 1.0, 1.0))
        if is_brightest_far:
            far_light = far_light - by_chance
        else:
            near_light = near_light - by_chance
        by_chance *= scale / INV_PI
        vector *= scale / INV_PI
        everything = (near_light + far_light).sum() * (scale / INV_PI) + by_chance.sum()
        near_patches = vec3(0.0)
        far_patches = vec3(0.0)
        largest = vec3(0.0)
        is_largest_near = False
        taken = ti.select(clusters > 0 and rays > 0, patches_per_node, 0)
        row = 0
        if clusters > 0:
            row = row_near(clusters_near, shifted(clusters_near, here.point, here.normal, here.rank), here.normal)
        for k in range(taken):
            xi = sobol_2d(here.rank * taken + k, here.scramble + seed + 5)
            chosen = choose(clusters_near, row, 0, clusters, xi.x)
            first_of = first_patch[chosen.light]
            patch = patch_below(shares, first_of, first_patch[chosen.light + 1] - 1, chosen.across)
            other = node_at(triangles, vertices, samples, charted, patches[patch])
            offset = other.point - here.point
            distance2 = offset.norm_sqr()
            if distance2 > NEAR_SUN_M * NEAR_SUN_M:
                distance = ti.sqrt(distance2)
                toward = offset / distance
                received = here.normal.dot(toward)
                given = -other.normal.dot(toward)
                if received > 0.0 and given > 0.0 and here.face.dot(toward) > 0.0 and other.face.dot(toward) < 0.0:
                    passed = sent(
                        nodes, leaves, sheer_root, triangles, materials, texels, images, here.point, toward, distance
                    )
                    weight = received * given / (distance2 * chosen.share * ti.cast(taken, ti.f32))
                    found = passed.share * load3(colors, patch * 3) * weight
                    if found.max() > 0.0:
                        found *= directed(
                            triangles, materials, texels, images, env, samples, patches[patch], other, toward
                        )
                    if distance < NEAR_M:
                        near_patches += found
                    else:
                        far_patches += found
                    vector += toward * found.sum()
                    everything += found.sum()
                    if found.max() > largest.max():
                        largest = found
                        is_largest_near = distance < NEAR_M
        # A patch may be chosen once in thousands of nodes.
        all_else = near_patches + far_patches - largest + (near_light + far_light) * (scale / INV_PI)
        largest = beyond(largest, all_else.max())
        if is_largest_near:
            near_patches = near_patches - largest
        else:
            far_patches = far_patches - largest
        by_chance += largest
        is_hidden = was_hidden or backs > MOST_BACKS * counted or blocked > MOST_BLOCKED * counted
        for i in ti.static(range(3)):
            raw[at + 3 + i] = near_light[i] * (scale / INV_PI) + near_patches[i]
            raw[at + 6 + i] = far_light[i] * (scale / INV_PI) + far_patches[i]
            raw[at + 12 + i] = by_chance[i]
            raw[at + 15 + i] += vector[i]
        raw[at + 18] += everything
        raw[at + 9] = open_share * scale
        # A node that is no chart's may lie between two shells of a thing, and lattices of the outer one share it.
        is_between = charted[node * NODE_STRIDE] < 0 and open_share == 0.0
        raw[at + 11] = ti.select(is_between, HIDDEN_WEIGHT, 1.0)
        if is_hidden:
            stored = interpolate_cells(grid, cells, layout, here.point, here.normal)
            for i in ti.static(range(3)):
                raw[at + i] = stored.total[i]
                raw[at + 3 + i] = 0.0
                raw[at + 6 + i] = 0.0
                raw[at + 12 + i] = 0.0
                raw[at + 15 + i] = here.normal[i] * (EVEN_COSINE * LEAST_LIGHT)
            raw[at + 18] = LEAST_LIGHT
            raw[at + 9] = 0.0
            raw[at + 11] = HIDDEN_WEIGHT
