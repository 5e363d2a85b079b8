# mypy: ignore-errors
"""Light that reaches each pixel's surface, noisy but in a pattern that the filter of `filtering` averages out.

Neighbouring pixels take different strata (interleaved sampling: Keller and Heidrich, 2001), so that any window of 4x4
pixels holds a well-spread set of samples of every light.

A pixel's light (`LIGHT_PIXEL_STRIDE` values): irradiance without sun, share of the sun that is visible, radiance from
the mirror direction, distance of what is mirrored (-1: no ray was sent).
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.cells import INV_PI, NEAR_M, OFFSET_M, interpolate_cells, nearest_cell
from benchbot_sim_taichi.kernels.light import sample_light, sky_radiance
from benchbot_sim_taichi.kernels.primary import GUIDE_STRIDE, PIXEL_STRIDE, camera_origin, camera_ray
from benchbot_sim_taichi.kernels.sampling import (
    cosine_direction,
    interleave_index,
    orthonormal,
    sobol_2d,
)
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3
from benchbot_sim_taichi.surface_cells import CELL_STRIDE
from benchbot_sim_taichi.tables import TRIANGLE_STRIDE

LIGHT_PIXEL_STRIDE = 8
REFLECT_ROUGHNESS = 0.55
MIRROR_ROUGHNESS = 0.08
BRIGHTEST_REFLECTION = 6.0


@ti.func
def glossy_direction(direction, normal, roughness, xi):
    """Mirror direction of a microfacet drawn from the GGX lobe (Walter et al., 2007); alpha = roughness²."""
    alpha = roughness * roughness
    tan2 = alpha * alpha * xi.x / ti.max(1.0 - xi.x, 1e-4)
    height = 1.0 / ti.sqrt(1.0 + tan2)
    radius = ti.sqrt(ti.max(0.0, 1.0 - height * height))
    angle = 6.28318530718 * xi.y
    tangent, bitangent = orthonormal(normal)
    facet = tangent * (radius * ti.cos(angle)) + bitangent * (radius * ti.sin(angle)) + normal * height
    mirrored = direction - facet * (2.0 * direction.dot(facet))
    return mirrored.normalized(1e-9)


@ti.func
def surface_point(camera: ti.template(), pixels: ti.template(), x, y, width):
    """Position of a pixel's opaque surface, lifted off it."""
    base = (y * width + x) * PIXEL_STRIDE
    t = pixels[base]
    ray = camera_ray(camera, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
    return camera_origin(camera) + ray * t + load3(pixels, base + 4) * (OFFSET_M + 1e-4 * t)


@ti.func
def repeats(guide: ti.template(), x, y, width, height):
    """How many samples a pixel needs by itself: 1, or 4 where few neighbours show the same surface to average with."""
    at = (y * width + x) * GUIDE_STRIDE
    normal = load3(guide, at)
    t = guide[at + 3]
    alike = 0
    for k in range(8):
        distance = 1 + k // 4
        sx = ti.math.clamp(x + ti.select(k % 4 == 0, distance, ti.select(k % 4 == 1, -distance, 0)), 0, width - 1)
        sy = ti.math.clamp(y + ti.select(k % 4 == 2, distance, ti.select(k % 4 == 3, -distance, 0)), 0, height - 1)
        other = (sy * width + sx) * GUIDE_STRIDE
        near = ti.abs(guide[other + 3] - t) < 0.05 * t
        alike += ti.select(near and normal.dot(load3(guide, other)) > 0.9, 1, 0)
    return ti.select(alike >= 4, 1, 4)


@ti.kernel
def light_indirectly(
    nodes: floats,
    leaves: floats,
    triangles: floats,
    grid: ints,
    cells: floats,
    layout: floats,
    camera: floats,
    pixels: floats,
    guide: floats,
    light_pixels: floats,
    width: ti.i32,
    height: ti.i32,
    seed: ti.i32,
):
    """One short ray finds what is near (contact shadow, colour bleeding); beyond it the cells answer.

    Starts the pixel's light: to be run before the other kernels here.
    """
    for pixel in range(width * height):
        x = pixel % width
        y = pixel // width
        base = pixel * PIXEL_STRIDE
        if pixels[base] < FAR:
            normal = load3(guide, pixel * GUIDE_STRIDE)
            face = load3(pixels, base + 4)
            point = surface_point(camera, pixels, x, y, width)
            stored = interpolate_cells(grid, cells, layout, point, normal)
            radiance = vec3(0.0)
            samples = repeats(guide, x, y, width, height)
            rank = interleave_index(x, y)
            for s in range(samples):
                toward = cosine_direction(normal, sobol_2d(rank * samples + s, seed + 3))
                if toward.dot(face) > 0.0:
                    hit = trace(nodes, leaves, 0, point, toward, NEAR_M, False)
                    if hit.triangle >= 0:
                        met = load3(triangles, hit.triangle * TRIANGLE_STRIDE + 15)
                        met = ti.select(met.dot(toward) > 0.0, -met, met)
                        cell = nearest_cell(grid, cells, layout, point + toward * hit.t, met)
                        if cell >= 0:
                            radiance += load3(cells, cell * CELL_STRIDE + 15)
                    else:
                        radiance += stored.far
            out = pixel * LIGHT_PIXEL_STRIDE
            for i in ti.static(range(3)):
                light_pixels[out + i] = radiance[i] / (INV_PI * ti.cast(samples, ti.f32))
                light_pixels[out + 4 + i] = (stored.total[i] * INV_PI + stored.far[i]) * 0.5
            light_pixels[out + 3] = stored.sun
            light_pixels[out + 7] = -1.0


@ti.kernel
def light_directly(
    nodes: floats,
    leaves: floats,
    env: floats,
    lights: floats,
    portals: ti.i32,
    lamps: ti.i32,
    camera: floats,
    pixels: floats,
    guide: floats,
    light_pixels: floats,
    width: ti.i32,
    height: ti.i32,
    seed: ti.i32,
):
    """Shadow rays to windows, lamps and, where the cells around know of sunlight, the sun."""
    for pixel in range(width * height):
        x = pixel % width
        y = pixel // width
        base = pixel * PIXEL_STRIDE
        out = pixel * LIGHT_PIXEL_STRIDE
        irradiance = vec3(0.0)
        sun = 0.0
        if pixels[base] < FAR:
            sun_rays = ti.select(light_pixels[out + 3] > 0.0, 1, 0)
            rank = interleave_index(x, y)
            normal = load3(guide, pixel * GUIDE_STRIDE)
            face = load3(pixels, base + 4)
            point = surface_point(camera, pixels, x, y, width)
            samples = repeats(guide, x, y, width, height)
            # Windows and lamps take turns, like the squares of a chessboard, where neighbours can share.
            takes_turns = portals > 0 and lamps > 0 and samples == 1
            window_turn = not takes_turns or (x ^ y) & 1 == 0
            window_rays = ti.select(portals > 0 and window_turn, samples, 0)
            lamp_rays = ti.select(lamps > 0 and (not takes_turns or not window_turn), samples, 0)
            share = ti.select(takes_turns, 2.0, 1.0 / ti.cast(samples, ti.f32))
            index = ti.select(takes_turns, rank >> 1, rank * samples)
            for j in range(sun_rays + window_rays + lamp_rays):
                toward = load3(env, 0)  # the middle of the sun: its penumbra is about as wide as the filter
                value = vec3(1.0)
                distance = FAR
                if j >= sun_rays:
                    at_window = j < sun_rays + window_rays
                    k = j - sun_rays - ti.select(at_window, 0, window_rays)
                    light = sample_light(
                        lights,
                        env,
                        ti.select(at_window, 0, portals),
                        ti.select(at_window, portals, lamps),
                        point,
                        sobol_2d(index + k, seed + ti.select(at_window, 1, 2)),
                    )
                    toward = light.direction
                    value = light.value * share
                    distance = ti.select(at_window, FAR, light.distance)
                cosine = normal.dot(toward)
                if cosine > 0.0 and face.dot(toward) > 0.0 and value.max() > 0.0:
                    hit = trace(nodes, leaves, 0, point, toward, distance, True)
                    if hit.triangle < 0:
                        if j < sun_rays:
                            sun = 1.0
                        else:
                            irradiance += value * cosine
            for i in ti.static(range(3)):
                light_pixels[out + i] += irradiance[i]
        light_pixels[out + 3] = sun


@ti.kernel
def reflect(
    nodes: floats,
    leaves: floats,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    grid: ints,
    cells: floats,
    layout: floats,
    camera: floats,
    pixels: floats,
    light_pixels: floats,
    width: ti.i32,
    height: ti.i32,
    seed: ti.i32,
):
    """What smooth surfaces and panes mirror."""
    for pixel in range(width * height):
        x = pixel % width
        y = pixel // width
        base = pixel * PIXEL_STRIDE
        has_pane = pixels[base + 14] < FAR
        roughness = ti.select(has_pane, 0.0, pixels[base + 13])
        if has_pane or (pixels[base] < FAR and roughness < REFLECT_ROUGHNESS):
            ray = camera_ray(camera, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
            direction = ray.normalized()
            normal = load3(pixels, base + ti.select(has_pane, 15, 1))
            face = load3(pixels, base + ti.select(has_pane, 15, 4))
            origin = camera_origin(camera) + ray * ti.select(has_pane, pixels[base + 14], pixels[base])
            origin += face * OFFSET_M
            toward = direction - normal * (2.0 * direction.dot(normal))
            if roughness > MIRROR_ROUGHNESS:
                rank = interleave_index(x, y)
                toward = glossy_direction(direction, normal, roughness, sobol_2d(rank, seed + 4))
            if toward.dot(face) < 0.02:
                toward = (toward + face * (0.02 - toward.dot(face))).normalized()
            hit = trace(nodes, leaves, 0, origin, toward, FAR, False)
            reflection = vec3(0.0)
            if hit.triangle >= 0:
                surface = surface_at(
                    triangles,
                    materials,
                    texels,
                    images,
                    hit.triangle,
                    hit.u,
                    hit.v,
                    toward,
                    hit.t * (0.002 + roughness * roughness),
                )
                other = interpolate_cells(grid, cells, layout, origin + toward * hit.t, surface.normal)
                reflection = surface.emission + (surface.diffuse + surface.specular * 0.5) * other.total * INV_PI
            else:
                reflection = sky_radiance(env, toward)
            if roughness > MIRROR_ROUGHNESS:
                # A rare bright hit would show as a square of the filter; beyond white, brighter looks the same.
                brightness = (reflection * load3(camera, 16)).max()
                reflection *= ti.min(1.0, BRIGHTEST_REFLECTION / ti.max(brightness, 1e-6))
            out = pixel * LIGHT_PIXEL_STRIDE
            for i in ti.static(range(3)):
                light_pixels[out + 4 + i] = reflection[i]
            light_pixels[out + 7] = ti.min(hit.t, 10.0)
