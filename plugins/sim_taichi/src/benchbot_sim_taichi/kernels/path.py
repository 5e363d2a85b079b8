# mypy: ignore-errors
"""Path tracing (Kajiya, "The rendering equation", 1986), with two strategies for each light.

Every reflection looks for the sun, and for a window and a lamp that matter there (`light_grid`), and also goes on by
its own lobes; what both strategies find is shared between them. Panes pass light straight on, also that of shadow rays;
solid glass refracts, and lets no shadow ray pass.
"""

from benchbot_sim_taichi._ti import is_on_gpu, ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray
from benchbot_sim_taichi.kernels.glance import tile_pixel
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.light import is_sun, light_cosine, outlook, sun_direction
from benchbot_sim_taichi.kernels.light_grid import density_in_row, row_near, sample_row
from benchbot_sim_taichi.kernels.reflectance import (
    LEAST_COSINE,
    dielectric_reflectance,
    environment_brdf,
    mirror_direction,
    pane_reflectance,
    scatter,
)
from benchbot_sim_taichi.kernels.sampling import bounded, cosine_direction, draw, hash_u32, power_share
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, trace_narrow, vec3
from benchbot_sim_taichi.lights import LIGHT_STRIDE

OFFSET_M = 5e-4
MAX_PANES = 32
ROULETTE_DEPTH = 3
BOTH, LIGHTS_ONLY, LOBES_ONLY = 0, 1, 2
SUN, WINDOW, LAMP, GO_ON = 0, 1, 2, 3


@ti.func
def share(density, other, strategies):
    """Return the weight of a sample found with `density` if the other strategy, when in use, has density `other`."""
    return ti.select(strategies == BOTH or other <= 0.0, power_share(density, other), 0.0)


@ti.dataclass
class Stages:
    """The order in which kinds of lights are sampled: the first, and those after the sun and after the windows."""

    first: ti.i32
    after_sun: ti.i32
    after_windows: ti.i32


@ti.func
def stages(env: ti.template(), portals, lamps, strategies):
    """Return the kinds of lights that every reflection samples."""
    after_windows = ti.select(lamps > 0, LAMP, GO_ON)
    after_sun = ti.select(portals > 0, WINDOW, after_windows)
    first = ti.select(load3(env, 3).max() > 0.0, SUN, after_sun)
    return Stages(
        first=ti.select(strategies == LOBES_ONLY, GO_ON, first), after_sun=after_sun, after_windows=after_windows
    )


@ti.func
def following(stage, looked_for):
    """Return the kind of light that is sampled after another."""
    return ti.select(stage == SUN, looked_for.after_sun, ti.select(stage == WINDOW, looked_for.after_windows, GO_ON))


@ti.kernel
def trace_paths(
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
    camera: floats,
    total: floats,
    width: ti.i32,
    height: ti.i32,
    samples: ti.i32,
    bounces: ti.i32,
    brightest: ti.f32,
    strategies: ti.i32,
    seed: ti.i32,
):
    """Add `samples` paths of at most `bounces` reflections to each pixel's sum of radiance.

    What reaches a surface by way of others counts up to `brightest`. `strategies` is for tests: `LIGHTS_ONLY` looks
    for lights where it can, `LOBES_ONLY` meets them by chance.
    """
    for index in range(((width + 7) >> 3) * ((height + 3) >> 2) * 32):
        _picture, x, y = tile_pixel(index, width, height)
        pixel = y * width + x
        state = hash_u32(ti.cast(pixel, ti.u32) ^ hash_u32(seed))
        is_inside = x < width and y < height
        to_start = ti.select(is_inside, samples, 0)
        looked_for = stages(env, portals, lamps, strategies)
        finished = vec3(0.0)
        radiance = vec3(0.0)
        through = vec3(1.0)
        direction = vec3(0.0)
        origin = vec3(0.0)
        depth = 0
        # The surface where the ray sets out, the density of its lobes there, whether it looked for lights itself.
        vertex, normal, face, view = vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)
        matt, specular, roughness, gloss = vec3(0.0), vec3(0.0), 1.0, 0.0
        density = 0.0
        was_lit = False
        # Where the grid of lights speaks for that surface.
        row = 0
        # A light that is looked for, and what of it would be seen.
        carried = vec3(0.0)
        lobe_density = 0.0
        light_density_there = 0.0
        window_density = 0.0
        distance = 0.0
        reach = FAR
        first_root = 0
        panes = 0
        stage = GO_ON
        in_flight = False
        running = False
        # On a GPU a pixel starts its next path at once, and rays of all kinds are traced in one place: threads would
        # otherwise wait for one another. Each place more makes the kernel slower to compile.
        while running or to_start > 0:
            if not in_flight:
                if not running:
                    to_start -= 1
                    finished += radiance
                    px, state = draw(state)
                    py, state = draw(state)
                    origin = camera_origin(camera, 0)
                    direction = camera_ray(camera, 0, ti.cast(x, ti.f32) + px, ti.cast(y, ti.f32) + py).normalized()
                    through = vec3(1.0)
                    radiance = vec3(0.0)
                    depth = 0
                    density = 0.0
                    was_lit = False
                    window_density = 0.0
                    distance = 0.0
                    reach = FAR
                    first_root = 0
                    panes = 0
                    stage = GO_ON
                    in_flight = True
                    running = True
                else:
                    first_xi, state = draw(state)
                    second_xi, state = draw(state)
                    xi = ti.Vector([first_xi, second_xi])
                    reach = FAR
                    light_radiance = vec3(0.0)
                    if stage == SUN:
                        direction = sun_direction(env, xi)
                        light_density_there = 1.0 / env[17]
                        light_radiance = load3(env, 3) * light_density_there
                    elif stage == GO_ON:
                        choice, state = draw(state)
                        if choice < gloss:
                            direction = mirror_direction(normal, view, roughness, xi)
                        else:
                            direction = cosine_direction(normal, xi)
                    else:
                        first = ti.select(stage == WINDOW, 0, portals)
                        count = ti.select(stage == WINDOW, portals, lamps)
                        sample = sample_row(near, lights, env, row, stage - WINDOW, first, count, vertex, xi)
                        direction = sample.direction
                        light_density_there = sample.density
                        light_radiance = sample.radiance
                        reach = ti.select(stage == WINDOW, FAR, sample.distance)
                    sent = scatter(normal, view, direction, matt, specular, roughness, gloss)
                    wanted = sent.w > 0.0 and face.dot(direction) > 0.0
                    origin = vertex
                    first_root = 0
                    panes = 0
                    window_density = 0.0
                    if stage == GO_ON:
                        through *= vec3(sent.x, sent.y, sent.z) / ti.max(sent.w, 1e-20)
                        density = sent.w
                        was_lit = strategies != LOBES_ONLY
                        if depth > ROULETTE_DEPTH:
                            choice, state = draw(state)
                            survival = ti.math.clamp(through.max(), 0.05, 1.0)
                            wanted = wanted and choice < survival
                            through /= survival
                        running = wanted
                    else:
                        carried = through * light_radiance * vec3(sent.x, sent.y, sent.z)
                        lobe_density = sent.w
                        wanted = wanted and light_density_there > 0.0
                        stage = ti.select(wanted, stage, following(stage, looked_for))
                    in_flight = wanted
            if in_flight:
                limit = ti.select(depth > 1, brightest, FAR)
                is_search = stage < GO_ON
                hit = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
                is_blocked = False
                if ti.static(is_on_gpu()):
                    any_hit = ti.cast(is_search and first_root == 0, ti.i32)
                    then = ti.select(first_root == 0, sheer_root, -1)
                    hit, is_blocked = trace_narrow(nodes, leaves, first_root, then, origin, direction, reach, any_hit)
                else:
                    root = first_root
                    nearest = reach
                    while root >= 0:
                        nearer = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
                        if is_search and root == 0:
                            nearer = trace(nodes, leaves, root, origin, direction, nearest, True)
                        else:
                            nearer = trace(nodes, leaves, root, origin, direction, nearest, False)
                        if nearer.triangle >= 0:
                            is_blocked = is_search and root == 0
                            nearest = nearer.t
                            hit = nearer
                        root = ti.select(root == 0 and not is_blocked, sheer_root, -1)
                if hit.triangle < 0:
                    if is_search:
                        found = ti.select(stage == WINDOW, window_density, light_density_there)
                        if found > 0.0:  # through several panes in a row: any of them could have been chosen
                            weight = ti.select(strategies == BOTH, share(found, lobe_density, BOTH), 1.0)
                            radiance += bounded(carried * (weight / found), limit)
                        stage = following(stage, looked_for)
                        in_flight = False
                    else:
                        other = ti.select(was_lit, window_density, 0.0)
                        spread = ti.select(depth == 0, 1.0 / camera[12], 1.0)
                        seen = outlook(env, direction, spread) * share(density, other, strategies)
                        if is_sun(env, direction):
                            other = ti.select(was_lit, 1.0 / env[17], 0.0)
                            seen += load3(env, 3) / env[17] * share(density, other, strategies)
                        radiance += bounded(through * seen, limit)
                        running = False
                elif is_blocked:
                    stage = following(stage, looked_for)
                    in_flight = False
                else:
                    distance += ti.select(is_search, 0.0, hit.t)
                    surface = surface_at(
                        triangles,
                        materials,
                        texels,
                        images,
                        hit.triangle,
                        hit.u,
                        hit.v,
                        direction,
                        distance / camera[12],
                    )
                    point = origin + direction * hit.t
                    light = light_of[hit.triangle]
                    tint = ti.select(surface.is_cut == 1, vec3(1.0), surface.diffuse)
                    mirrored = 0.0
                    cosine = ti.math.clamp(-surface.normal.dot(direction), 0.0, 1.0)
                    if surface.is_glass == 1 and surface.is_cut == 0:
                        mirrored = pane_reflectance(surface.specular.x, cosine)
                        if surface.refraction > 0.0:
                            mirrored = dielectric_reflectance(cosine, surface.refraction)
                    if surface.is_cut == 0 and surface.is_glass == 0:
                        if is_search:
                            stage = following(stage, looked_for)
                            in_flight = False
                        else:
                            other = 0.0
                            emitted = surface.emission
                            if light >= portals:
                                # Behind a closed lamp's faces there is no room: between two shells it would be an oven.
                                if light_cosine(lights, light * LIGHT_STRIDE, direction) <= 0.0:
                                    emitted = vec3(0.0)
                                if was_lit:
                                    other = density_in_row(
                                        near, lights, row, 1, portals, light, point - vertex, direction
                                    )
                            radiance += bounded(through * emitted * share(density, other, strategies), limit)
                            depth += 1
                            running = depth <= bounces
                            face = surface.face
                            normal = ti.select(surface.normal.dot(direction) > -LEAST_COSINE, face, surface.normal)
                            view = negated(direction)
                            vertex = point + face * OFFSET_M
                            row = row_near(near, vertex, face)
                            specular = surface.specular
                            roughness = surface.roughness
                            shiny = environment_brdf(env, specular, roughness, normal.dot(view))
                            matt = surface.diffuse * (vec3(1.0) - shiny)
                            gloss = shiny.max() / ti.max(shiny.max() + matt.max(), 1e-6)
                            stage = looked_for.first
                            in_flight = False
                    else:
                        panes += 1
                        origin = point + direction * OFFSET_M
                        if 0 <= light < portals:
                            window_density += density_in_row(near, lights, row, 0, 0, light, point - vertex, direction)
                        if is_search:
                            carried *= tint * (1.0 - mirrored)
                            reach -= hit.t + OFFSET_M
                            first_root = sheer_root
                            if panes >= MAX_PANES or surface.refraction > 0.0:
                                stage = following(stage, looked_for)
                                in_flight = False
                        else:
                            choice, state = draw(state)
                            if choice < mirrored:
                                direction = (direction + surface.normal * (2.0 * cosine)).normalized()
                                origin = point + surface.face * OFFSET_M
                                was_lit = False
                            else:
                                through *= tint
                                ratio = surface.refraction
                                if ratio > 0.0 and surface.is_cut == 0:
                                    behind = ti.sqrt(ti.max(1.0 - ratio * ratio * (1.0 - cosine * cosine), 0.0))
                                    direction = direction * ratio + surface.normal * (ratio * cosine - behind)
                                    direction = direction.normalized()
                                    origin = point - surface.face * OFFSET_M
                                    was_lit = False
                            running = panes < MAX_PANES
                in_flight = in_flight and running
        finished += radiance
        if is_inside:
            for i in ti.static(range(3)):
                total[pixel * 3 + i] += finished[i]
