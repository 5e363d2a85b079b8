# mypy: ignore-errors
"""Light that reaches each pixel's surface, noisy but in a pattern that the filter of `filtering` averages out.

Neighbouring pixels take different strata (interleaved sampling: Keller and Heidrich, 2001), so that any window of 4x4
pixels holds a well-spread set of samples of every light.

A pixel's light (`LIGHT_PIXEL_STRIDE` values): irradiance without sun, share of the sun that is visible (`NO_SAMPLE`
before filtering where neighbours are to speak for the pixel), radiance that is mirrored, and how: by a `ROUGH`
surface, for which no ray of its own is sent, `GLOSSY_UNSEEN` still to come from neighbours, `GLOSSY` or `MIRROR`.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.cell_lookup import interpolate_cells, nearest_cell
from benchbot_sim_taichi.kernels.cells import INV_PI, NEAR_M, OFFSET_M
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.light_grid import density_in_row, row_near, sample_near, shifted
from benchbot_sim_taichi.kernels.neighbours import fit, pixel_plane
from benchbot_sim_taichi.kernels.panes import MAX_LAYERS, STEP_M, sent, sheerness
from benchbot_sim_taichi.kernels.primary import GUIDE_STRIDE, PIXEL_STRIDE
from benchbot_sim_taichi.kernels.reflectance import environment_brdf, mirror_direction, scatter
from benchbot_sim_taichi.kernels.sampling import bounded, cosine_direction, interleave_index, power_share, sobol_2d
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, vec3
from benchbot_sim_taichi.surface_cells import CELL_STRIDE
from benchbot_sim_taichi.tables import TRIANGLE_STRIDE

LIGHT_PIXEL_STRIDE = 8
REFLECT_ROUGHNESS = 0.55
MIRROR_ROUGHNESS = 0.08
BRIGHTEST_REFLECTION = 6.0
BESIDE_LAMP_M = 0.5
BESIDE_LAMP_RAYS = 16
PROBES = 4
NO_SAMPLE = -1.0
ROUGH, GLOSSY_UNSEEN, GLOSSY, MIRROR = 0.0, 1.0, 2.0, 3.0


@ti.func
def mirror_kind(pixels: ti.template(), base):
    """`ROUGH`, `GLOSSY` or `MIRROR`, by what lies in front of a pixel and how rough its surface is."""
    has_pane = pixels[base + 14] < FAR
    roughness = ti.select(has_pane, 0.0, pixels[base + 13])
    kind = ROUGH
    if has_pane or (pixels[base] < FAR and roughness < REFLECT_ROUGHNESS):
        kind = ti.select(roughness <= MIRROR_ROUGHNESS, MIRROR, GLOSSY)
    return kind


@ti.func
def lobe(env: ti.template(), pixels: ti.template(), base, view, toward):
    """Return the share of light from `toward` that a pixel's glossy lobe mirrors, per solid angle and colour (3).

    The fourth value is the density with which `mirror_direction` finds it. The shares of all directions integrate to 1.
    """
    normal = load3(pixels, base + 1)
    specular = load3(pixels, base + 10)
    roughness = pixels[base + 13]
    sent = scatter(normal, view, toward, vec3(0.0), specular, roughness, 1.0)
    even = ti.max(environment_brdf(env, specular, roughness, normal.dot(view)), 1e-4)
    return ti.Vector([sent.x / even.x, sent.y / even.y, sent.z / even.z, sent.w])


@ti.func
def no_glare(cameras: ti.template(), eye, reflection):
    """The same colour, no brighter than `BRIGHTEST_REFLECTION` in the picture.

    A rare bright hit would show as a square of the filter; beyond white, brighter looks the same.
    """
    exposure = load3(cameras, eye + 16)
    return bounded(reflection * exposure, BRIGHTEST_REFLECTION) / exposure


@ti.func
def surface_point(cameras: ti.template(), eye, pixels: ti.template(), pixel, x, y):
    """Position of a pixel's opaque surface, lifted off it."""
    base = pixel * PIXEL_STRIDE
    t = pixels[base]
    ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
    return camera_origin(cameras, eye) + ray * t + load3(pixels, base + 4) * (OFFSET_M + 1e-4 * t)


@ti.func
def sample_count(cameras: ti.template(), eye, guide: ti.template(), pixel, x, y, width, height):
    """Samples of each light that a pixel takes by itself.

    4 where few neighbours show the same surface to average with, otherwise 1; none on the black squares of a
    chessboard whose neighbours to the left and right can speak for them.
    """
    plane = pixel_plane(cameras, eye, guide, pixel, x, y)
    alike = 0
    beside = 0
    for k in range(8):
        distance = ti.select(k & 1 == 0, -1, 1) * (1 + (k >> 2))
        dx = ti.select(k & 2 == 0, distance, 0)
        dy = distance - dx
        inside = 0 <= x + dx < width and 0 <= y + dy < height
        other = pixel + ti.select(inside, dy * width + dx, 0)
        if inside and fit(guide, plane, dx, dy, other) > 0.5:
            alike += 1
            beside += ti.select(k < 2, 1, 0)
    shares = (x ^ y) & 1 == 1 and beside == 2
    return ti.select(alike < 4, 4, ti.select(shares, 0, 1))


@ti.func
def stratum(x, y):
    """Rank of a pixel in its 8x8 tile; either colour of the chessboard has 32 in a row."""
    rank = interleave_index(x, y)
    return (rank >> 1) | (rank & 1) << 5


@ti.kernel
def light_indirectly(
    nodes: floats,
    leaves: floats,
    triangles: floats,
    materials: floats,
    grid: ints,
    cells: floats,
    layout: floats,
    cameras: floats,
    pixels: floats,
    guide: floats,
    light_pixels: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    seed: ti.i32,
):
    """One short ray finds what is near (contact shadow, colour bleeding); beyond it the cells answer.

    Starts the pixel's light, to be run before the other kernels here: leaves whether the cells know of sunlight in
    place of the sun's share, and the number of samples that the pixel takes in the last value.
    """
    for pixel in range(count * width * height):
        x, y, _, eye = locate(pixel, width, height)
        base = pixel * PIXEL_STRIDE
        samples = 0
        sun = NO_SAMPLE
        radiance = vec3(0.0)
        if pixels[base] < FAR:
            samples = sample_count(cameras, eye, guide, pixel, x, y, width, height)
        if samples > 0:
            normal = load3(guide, pixel * GUIDE_STRIDE)
            face = load3(pixels, base + 4)
            point = surface_point(cameras, eye, pixels, pixel, x, y)
            stored = interpolate_cells(grid, cells, layout, point, normal)
            sun = stored.sun
            for s in range(samples):
                toward = cosine_direction(normal, sobol_2d(stratum(x, y) * samples + s, seed + 3))
                if toward.dot(face) > 0.0:
                    hit = trace(nodes, leaves, 0, point, toward, NEAR_M, False)
                    if hit.triangle >= 0:
                        met = load3(triangles, hit.triangle * TRIANGLE_STRIDE + 15)
                        met = ti.select(met.dot(toward) > 0.0, negated(met), met)
                        cell = nearest_cell(grid, cells, layout, point + toward * hit.t, met)
                        if cell >= 0:
                            radiance += load3(cells, cell * CELL_STRIDE + 15)
                    else:
                        radiance += stored.far
            radiance /= ti.cast(samples, ti.f32)
        out = pixel * LIGHT_PIXEL_STRIDE
        for i in ti.static(range(3)):
            light_pixels[out + i] = radiance[i] / INV_PI
        light_pixels[out + 3] = sun
        light_pixels[out + 7] = ti.cast(samples, ti.f32)


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
    near: floats,
    cameras: floats,
    pixels: floats,
    guide: floats,
    light_pixels: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    seed: ti.i32,
):
    """Shadow rays to windows, lamps and, where the cells around know of sunlight, the sun.

    The sun's share is that of the colour of which panes let pass least; what they let pass more of the others joins
    the irradiance. Glossy surfaces also mirror the windows and lamps, as far as `reflect` will not find them better.
    """
    for pixel in range(count * width * height):
        out = pixel * LIGHT_PIXEL_STRIDE
        samples = ti.cast(light_pixels[out + 7], ti.i32)
        if samples > 0:
            x, y, _, eye = locate(pixel, width, height)
            normal = load3(guide, pixel * GUIDE_STRIDE)
            face = load3(pixels, pixel * PIXEL_STRIDE + 4)
            point = surface_point(cameras, eye, pixels, pixel, x, y)
            row = 0
            if portals + lamps > 0:
                row = row_near(near, shifted(near, point, normal, stratum(x, y)), normal)
            kind = mirror_kind(pixels, pixel * PIXEL_STRIDE)
            view = negated(camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5).normalized())
            irradiance = vec3(0.0)
            reflection = vec3(0.0)
            sun = 0.0
            sun_rays = ti.select(light_pixels[out + 3] > 0.0, 1, 0)
            window_rays = ti.select(portals > 0, samples, 0)
            lamp_rays = 0
            if lamps > 0:
                # Beside a lamp, its near side gives far more light than the rest of it.
                is_beside = False
                for i in range(PROBES):  # not the samples that count, which would decide how often they do
                    index = stratum(x, y) * PROBES + i
                    probe = sample_near(near, lights, env, row, 1, portals, lamps, point, index, seed + 5)
                    is_beside |= probe.distance < BESIDE_LAMP_M
                lamp_rays = ti.select(is_beside, BESIDE_LAMP_RAYS, samples)
            for j in range(sun_rays + window_rays + lamp_rays):
                toward = load3(env, 0)  # the middle of the sun: its penumbra is about as wide as the filter
                value = vec3(1.0)
                distance = FAR
                density = 0.0
                if j >= sun_rays:
                    at_window = j < sun_rays + window_rays
                    k = j - sun_rays - ti.select(at_window, 0, window_rays)
                    rays = ti.select(at_window, samples, lamp_rays)
                    light = sample_near(
                        near,
                        lights,
                        env,
                        row,
                        ti.select(at_window, 0, 1),
                        ti.select(at_window, 0, portals),
                        ti.select(at_window, portals, lamps),
                        point,
                        stratum(x, y) * rays + k,
                        seed + ti.select(at_window, 1, 2),
                    )
                    toward = light.direction
                    value = light.value * (ti.cast(samples, ti.f32) / ti.cast(rays, ti.f32))
                    distance = ti.select(at_window, FAR, light.distance)
                    density = light.density / near[row + ti.select(at_window, 0, 1)] * ti.cast(samples, ti.f32)
                cosine = normal.dot(toward)
                if cosine > 0.0 and face.dot(toward) > 0.0 and value.max() > 0.0:
                    passed = sent(
                        nodes, leaves, sheer_root, triangles, materials, texels, images, point, toward, distance
                    )
                    if j < sun_rays:
                        sun = passed.share.min()
                        value = load3(env, 3) * ti.cast(samples, ti.f32)
                        passed.share = passed.share - sun
                    elif kind != MIRROR:
                        mirrored = lobe(env, pixels, pixel * PIXEL_STRIDE, view, toward)
                        mirrored *= power_share(density, ti.select(kind == GLOSSY, mirrored.w, 0.0))
                        found = passed.share * value * vec3(mirrored.x, mirrored.y, mirrored.z)
                        reflection += no_glare(cameras, eye, found)
                    irradiance += passed.share * value * cosine
            if kind == ROUGH:
                reflection += load3(light_pixels, out) * (INV_PI * ti.cast(samples, ti.f32))
            for i in ti.static(range(3)):
                light_pixels[out + i] += irradiance[i] / ti.cast(samples, ti.f32)
                light_pixels[out + 4 + i] = reflection[i] / ti.cast(samples, ti.f32)
            light_pixels[out + 3] = sun


@ti.kernel
def reflect(
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
    grid: ints,
    cells: floats,
    layout: floats,
    cameras: floats,
    pixels: floats,
    guide: floats,
    light_pixels: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    seed: ti.i32,
):
    """Trace the reflections of smooth surfaces and panes.

    It runs after `light_directly`: both sample windows and lamps for glossy surfaces, and their results are combined.
    """
    for pixel in range(count * width * height):
        x, y, _, eye = locate(pixel, width, height)
        base = pixel * PIXEL_STRIDE
        has_pane = pixels[base + 14] < FAR
        roughness = ti.select(has_pane, 0.0, pixels[base + 13])
        out = pixel * LIGHT_PIXEL_STRIDE
        samples = light_pixels[out + 7]
        kind = mirror_kind(pixels, base)
        if kind == GLOSSY and light_pixels[out + 3] == NO_SAMPLE:
            kind = GLOSSY_UNSEEN
        light_pixels[out + 7] = kind
        if kind >= GLOSSY:
            ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
            direction = ray.normalized()
            normal = load3(pixels, base + ti.select(has_pane, 15, 1))
            face = load3(pixels, base + ti.select(has_pane, 15, 4))
            origin = camera_origin(cameras, eye) + ray * ti.select(has_pane, pixels[base + 14], pixels[base])
            origin += face * OFFSET_M
            toward = direction - normal * (2.0 * direction.dot(normal))
            mirrored = ti.Vector([1.0, 1.0, 1.0, 0.0])
            row = 0
            if kind == GLOSSY:
                toward = mirror_direction(normal, negated(direction), roughness, sobol_2d(stratum(x, y), seed + 4))
                mirrored = lobe(env, pixels, base, negated(direction), toward)
                mirrored /= ti.Vector([mirrored.w, mirrored.w, mirrored.w, 1.0]) + 1e-20
                if portals + lamps > 0:
                    smooth = load3(guide, pixel * GUIDE_STRIDE)
                    point = surface_point(cameras, eye, pixels, pixel, x, y)
                    row = row_near(near, shifted(near, point, smooth, stratum(x, y)), smooth)
            density = 0.0
            if toward.dot(face) < 0.02:
                toward = (toward + face * (0.02 - toward.dot(face))).normalized()
            hit = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
            passed = vec3(1.0)
            root = 0
            start = 0.0
            layers = 0
            while root >= 0:
                met = trace(nodes, leaves, root, origin + toward * start, toward, hit.t - start, False)
                if root == 0:
                    hit = met
                    root = sheer_root
                elif met.triangle >= 0 and layers < MAX_LAYERS:
                    layer = sheerness(triangles, materials, texels, images, met.triangle, met.u, met.v, toward)
                    passed *= ti.select(layer.panes == 1, layer.share, vec3(1.0))
                    light = light_of[met.triangle]
                    if kind == GLOSSY and 0 <= light < portals:
                        density += density_in_row(near, lights, row, 0, 0, light, toward * (start + met.t), toward)
                    start += met.t + STEP_M
                    layers += 1
                else:
                    root = -1
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
                density = 0.0
                light = light_of[hit.triangle]
                if kind == GLOSSY and light >= portals:
                    density = density_in_row(near, lights, row, 1, portals, light, toward * hit.t, toward)
                reflection = (surface.diffuse + surface.specular * 0.5) * other.total * INV_PI
                reflection += surface.emission * power_share(mirrored.w, density * samples)
            else:
                reflection = outlook(env, toward, 0.002 + roughness * roughness)
                reflection *= power_share(mirrored.w, density * samples)
            reflection *= passed
            if kind == GLOSSY:
                reflection = no_glare(cameras, eye, reflection * vec3(mirrored.x, mirrored.y, mirrored.z))
                reflection += load3(light_pixels, out + 4)
            for i in ti.static(range(3)):
                light_pixels[out + 4 + i] = reflection[i]
