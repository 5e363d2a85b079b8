# mypy: ignore-errors
"""Reference integrator: unidirectional path tracing with light sampling (Kajiya, "The rendering equation", 1986)."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.illumination import glossy_direction
from benchbot_sim_taichi.kernels.light import sample_light, sky_radiance
from benchbot_sim_taichi.kernels.primary import camera_origin, camera_ray
from benchbot_sim_taichi.kernels.resolve import environment_brdf, glass_fresnel
from benchbot_sim_taichi.kernels.sampling import ONE_OVER_2_32, cone_direction, cosine_direction, hash_u32
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3

INV_PI = 0.31830988618379067
OFFSET_M = 5e-4


@ti.func
def draw(state):
    """Next number in 0 … 1 and the state after it (a counter, hashed)."""
    following = state + ti.u32(0x9E3779B9)
    return ti.cast(hash_u32(following), ti.f32) * ONE_OVER_2_32, following


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
    camera: floats,
    total: floats,
    width: ti.i32,
    height: ti.i32,
    samples: ti.i32,
    bounces: ti.i32,
    seed: ti.i32,
):
    """Add `samples` paths of at most `bounces` reflections to each pixel's sum of radiance."""
    for pixel in range(width * height):
        state = hash_u32(ti.cast(pixel, ti.u32) ^ hash_u32(seed))
        for _ in range(samples):
            px, state = draw(state)
            py, state = draw(state)
            origin = camera_origin(camera, 0)
            direction = camera_ray(
                camera, 0, ti.cast(pixel % width, ti.f32) + px, ti.cast(pixel // width, ti.f32) + py
            ).normalized()
            through = vec3(1.0)
            radiance = vec3(0.0)
            depth = 0
            lamps_count = True
            panes = 0
            while depth <= bounces:
                root = 0
                nearest = FAR
                triangle = -1
                u = 0.0
                v = 0.0
                while root >= 0:
                    hit = trace(nodes, leaves, root, origin, direction, nearest, False)
                    if hit.triangle >= 0:
                        nearest = hit.t
                        triangle = hit.triangle
                        u = hit.u
                        v = hit.v
                    root = ti.select(root == 0, sheer_root, -1)
                if triangle < 0:
                    # After a diffuse reflection, sky seen through a pane was counted by sampling the pane.
                    if lamps_count or panes == 0 or portals == 0:
                        radiance += through * sky_radiance(env, direction)
                    break
                surface = surface_at(
                    triangles, materials, texels, images, triangle, u, v, direction, nearest / camera[12]
                )
                point = origin + direction * nearest
                if surface.is_glass == 1 or surface.is_cut == 1:
                    choice, state = draw(state)
                    mirrored = ti.select(surface.is_cut == 1, 0.0, glass_fresnel(-surface.normal.dot(direction)))
                    panes += 1
                    if choice < mirrored:
                        direction = direction - surface.normal * (2.0 * direction.dot(surface.normal))
                        origin = point + surface.face * OFFSET_M
                        panes = 0
                    else:
                        origin = point - surface.face * OFFSET_M
                    if panes > 16:
                        break
                else:
                    if lamps_count:
                        radiance += through * surface.emission
                    panes = 0
                    depth += 1
                    point += surface.face * OFFSET_M
                    shiny = environment_brdf(
                        surface.specular, surface.roughness, ti.max(-surface.normal.dot(direction), 0.0)
                    )
                    matt = surface.diffuse * (vec3(1.0) - shiny)
                    for kind in range(3):
                        x, state = draw(state)
                        y, state = draw(state)
                        toward = cone_direction(load3(env, 0), env[15], ti.Vector([x, y]))
                        value = load3(env, 3)
                        reach = FAR
                        wanted = kind == 0
                        if kind > 0:
                            first = ti.select(kind == 1, 0, portals)
                            count = ti.select(kind == 1, portals, lamps)
                            wanted = count > 0
                            if wanted:
                                light = sample_light(lights, env, first, count, point, ti.Vector([x, y]))
                                toward = light.direction
                                value = light.value
                                reach = ti.select(kind == 1, FAR, light.distance)
                        cosine = surface.normal.dot(toward)
                        if wanted and cosine > 0.0 and surface.face.dot(toward) > 0.0:
                            shadow = trace(nodes, leaves, 0, point, toward, reach, True)
                            if shadow.triangle < 0:
                                radiance += through * matt * value * (cosine * INV_PI)
                    x, state = draw(state)
                    y, state = draw(state)
                    choice, state = draw(state)
                    share = ti.math.clamp(shiny.max() / ti.max(shiny.max() + matt.max(), 1e-6), 0.0, 1.0)
                    lamps_count = choice < share
                    if lamps_count:
                        direction = glossy_direction(direction, surface.normal, surface.roughness, ti.Vector([x, y]))
                        through *= shiny / ti.max(share, 1e-6)
                    else:
                        direction = cosine_direction(surface.normal, ti.Vector([x, y]))
                        through *= matt / ti.max(1.0 - share, 1e-6)
                    origin = point
                    if direction.dot(surface.face) <= 0.0:
                        break
            for i in ti.static(range(3)):
                total[pixel * 3 + i] += radiance[i]
