# mypy: ignore-errors
"""From light and reflectance to the radiance of each pixel, with more camera rays where pixels hold edges."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.cell_lookup import interpolate_cells
from benchbot_sim_taichi.kernels.cells import INV_PI
from benchbot_sim_taichi.kernels.illumination import LIGHT_PIXEL_STRIDE
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.panes import unpack
from benchbot_sim_taichi.kernels.primary import GUIDE_STRIDE, PIXEL_STRIDE
from benchbot_sim_taichi.kernels.reflectance import environment_brdf, pane_reflectance
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3

SUBSAMPLES = 4
VISIBLE_STEP = 0.02


@ti.func
def sun_highlight(normal, view, toward, specular, roughness):
    """GGX reflection of the sun, per unit irradiance times cosine; `view` points to the viewer."""
    half = (view + toward).normalized(1e-9)
    nv = ti.max(normal.dot(view), 1e-3)
    nl = ti.max(normal.dot(toward), 1e-3)
    nh = ti.max(normal.dot(half), 0.0)
    alpha = ti.max(roughness * roughness, 0.02)
    a2 = alpha * alpha
    d = nh * nh * (a2 - 1.0) + 1.0
    distribution = a2 * INV_PI / (d * d)
    visibility = 0.5 / (nl * ti.sqrt(nv * nv * (1.0 - a2) + a2) + nv * ti.sqrt(nl * nl * (1.0 - a2) + a2))
    fresnel = specular + (vec3(1.0) - specular) * ti.pow(1.0 - ti.max(half.dot(view), 0.0), 5.0)
    return fresnel * ti.min(distribution * visibility, 50.0)


@ti.func
def shade(env: ti.template(), direction, normal, diffuse, specular, emission, roughness, irradiance, sun, reflection):
    """Radiance that leaves a surface towards the viewer."""
    toward = load3(env, 0)
    cosine = ti.max(normal.dot(toward), 0.0)
    mirrored = environment_brdf(env, specular, roughness, ti.max(-normal.dot(direction), 0.0))
    sunlight = load3(env, 3) * (sun * cosine)
    radiance = emission + (irradiance + sunlight) * diffuse * (vec3(1.0) - mirrored) * INV_PI + mirrored * reflection
    if sun * cosine > 0.0:
        radiance += sunlight * sun_highlight(normal, negated(direction), toward, specular, roughness)
    return radiance


@ti.func
def compress(color):
    """Bounded weight of a sample, so that one bright sample does not own an edge pixel (Karis, 2013)."""
    return color / (1.0 + color.max())


@ti.func
def expand(color):
    """Inverse of `compress`."""
    return color / ti.max(1.0 - color.max(), 1e-3)


@ti.func
def has_contrast(centers: ti.template(), first, x, y, width, height):
    """Return whether colours around a pixel differ by over `VISIBLE_STEP`, as square roots of compressed light."""
    here = load3(centers, (first + y * width + x) * 3)
    lowest = here
    highest = here
    for k in range(9):
        sx = ti.math.clamp(x + k % 3 - 1, 0, width - 1)
        sy = ti.math.clamp(y + k // 3 - 1, 0, height - 1)
        beside = load3(centers, (first + sy * width + sx) * 3)
        lowest = ti.min(lowest, beside)
        highest = ti.max(highest, beside)
    # d sqrt(c) = dc / (2 sqrt(c)), squared to do without the root; the constant term spares noise in the dark.
    step = (highest - lowest) ** 2 - (highest + 0.002) * (4.0 * VISIBLE_STEP * VISIBLE_STEP)
    return step.max() > 0.0


@ti.func
def needs_more(pixels: ti.template(), guide: ti.template(), first, x, y, width, height):
    """Return whether a pixel touches an edge of an object, a crease or a jump in depth."""
    base = (first + y * width + x) * PIXEL_STRIDE
    found = False
    for k in range(8):
        d = ti.select(k >= 4, k + 1, k)
        sx = ti.math.clamp(x + d % 3 - 1, 0, width - 1)
        sy = ti.math.clamp(y + d // 3 - 1, 0, height - 1)
        other = (first + sy * width + sx) * PIXEL_STRIDE
        if pixels[other + 19] != pixels[base + 19]:
            found = True
        if (pixels[other + 14] < FAR) != (pixels[base + 14] < FAR):
            found = True
        if pixels[base] < FAR and pixels[other] < FAR:
            beside = (first + sy * width + sx) * GUIDE_STRIDE
            if load3(guide, (first + y * width + x) * GUIDE_STRIDE).dot(load3(guide, beside)) < 0.85:
                found = True
            t = pixels[base]
            if ti.abs(pixels[other] - t) > 0.05 * t:
                found = True
            if (load3(pixels, base + 7) - load3(pixels, other + 7)).norm() > 0.2:
                found = True
    return found


@ti.kernel
def shade_centers(
    env: floats,
    cameras: floats,
    pixels: floats,
    light_pixels: floats,
    centers: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Exposed radiance seen through the middle of each pixel, compressed (3 per pixel)."""
    for pixel in range(count * width * height):
        x, y, _, eye = locate(pixel, width, height)
        base = pixel * PIXEL_STRIDE
        at = pixel * LIGHT_PIXEL_STRIDE
        center = vec3(0.0)
        ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
        direction = ray.normalized()
        if pixels[base] < FAR:
            center = shade(
                env,
                direction,
                load3(pixels, base + 1),
                load3(pixels, base + 7),
                load3(pixels, base + 10),
                load3(pixels, base + 20),
                pixels[base + 13],
                load3(light_pixels, at),
                light_pixels[at + 3],
                ti.select(pixels[base + 14] < FAR, vec3(0.0), load3(light_pixels, at + 4)),
            )
        else:
            center = outlook(env, direction, 1.0 / cameras[eye + 12])
        if pixels[base + 14] < FAR:
            mirrored = pane_reflectance(pixels[base + 23], -load3(pixels, base + 15).dot(direction))
            center = center * unpack(ti.bit_cast(pixels[base + 18], ti.i32)) + load3(light_pixels, at + 4) * mirrored
        color = compress(center * load3(cameras, eye + 16))
        for i in ti.static(range(3)):
            centers[pixel * 3 + i] = color[i]


@ti.kernel
def resolve(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    grid: ints,
    cells: floats,
    layout: floats,
    cameras: floats,
    pixels: floats,
    guide: floats,
    light_pixels: floats,
    centers: floats,
    radiance: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Exposed linear radiance (3 per pixel), from its `centers` alone where the neighbours look the same."""
    for pixel in range(count * width * height):
        x, y, first, eye = locate(pixel, width, height)
        exposure = load3(cameras, eye + 16)
        color = load3(centers, pixel * 3)
        if has_contrast(centers, first, x, y, width, height) and needs_more(pixels, guide, first, x, y, width, height):
            origin = camera_origin(cameras, eye)
            total = color
            for s in range(SUBSAMPLES):
                # Rotated grid: four rows, four columns, one sample in each.
                px = ti.cast(x, ti.f32) + (ti.cast((s * 2 + s // 2) % 4, ti.f32) + 0.5) * 0.25
                py = ti.cast(y, ti.f32) + (ti.cast(s, ti.f32) + 0.5) * 0.25
                sub_ray = camera_ray(cameras, eye, px, py)
                sub_direction = sub_ray.normalized()
                value = outlook(env, sub_direction, 1.0 / cameras[eye + 12])
                pane = vec3(1.0)
                pane_light = vec3(0.0)
                root = 0
                limit = FAR
                while root >= 0:
                    hit = trace(nodes, leaves, root, origin, sub_ray, limit, False)
                    if hit.triangle >= 0:
                        limit = hit.t
                        surface = surface_at(
                            triangles,
                            materials,
                            texels,
                            images,
                            hit.triangle,
                            hit.u,
                            hit.v,
                            sub_direction,
                            hit.t / cameras[eye + 12],
                        )
                        # Light is borrowed from the neighbour whose surface is most alike.
                        best = -1
                        best_fit = 0.75
                        point = origin + sub_ray * hit.t
                        for k in range(9):
                            sx = ti.math.clamp(x + k % 3 - 1, 0, width - 1)
                            sy = ti.math.clamp(y + k // 3 - 1, 0, height - 1)
                            other = (first + sy * width + sx) * PIXEL_STRIDE
                            if surface.is_glass == 1:
                                if pixels[other + 14] < FAR:
                                    best = first + sy * width + sx
                            elif pixels[other] < FAR:
                                alignment = surface.smooth.dot(load3(guide, (first + sy * width + sx) * GUIDE_STRIDE))
                                same = ti.cast(pixels[other + 19] == ti.cast(surface.instance, ti.f32), ti.f32)
                                fit = alignment - 0.3 * (1.0 - same)
                                if fit > best_fit:
                                    place = (
                                        origin
                                        + camera_ray(cameras, eye, ti.cast(sx, ti.f32) + 0.5, ti.cast(sy, ti.f32) + 0.5)
                                        * pixels[other]
                                    )
                                    fit -= (place - point).norm() / hit.t * cameras[eye + 12] * 0.1
                                    if fit > best_fit:
                                        best_fit = fit
                                        best = first + sy * width + sx
                        irradiance = vec3(0.0)
                        reflection = vec3(0.0)
                        sun = 0.0
                        if best >= 0:
                            irradiance = load3(light_pixels, best * LIGHT_PIXEL_STRIDE)
                            sun = light_pixels[best * LIGHT_PIXEL_STRIDE + 3]
                            reflection = load3(light_pixels, best * LIGHT_PIXEL_STRIDE + 4)
                        elif surface.is_glass == 0:
                            stored = interpolate_cells(grid, cells, layout, point, surface.normal)
                            irradiance = stored.total
                            reflection = stored.total * INV_PI
                        if surface.is_glass == 1:
                            mirrored = pane_reflectance(surface.specular.x, -surface.normal.dot(sub_direction))
                            pane_light = reflection * mirrored
                            # This is its first face only; the neighbours have met all.
                            pane = surface.diffuse * (1.0 - mirrored)
                            if best >= 0:
                                pane = unpack(ti.bit_cast(pixels[best * PIXEL_STRIDE + 18], ti.i32))
                        elif surface.is_cut == 0:
                            value = shade(
                                env,
                                sub_direction,
                                surface.normal,
                                surface.diffuse,
                                surface.specular,
                                surface.emission,
                                surface.roughness,
                                irradiance,
                                sun,
                                reflection,
                            )
                    root = ti.select(root == 0, sheer_root, -1)
                total += compress((value * pane + pane_light) * exposure)
            color = total / ti.cast(SUBSAMPLES + 1, ti.f32)
        color = expand(color)
        for i in ti.static(range(3)):
            radiance[pixel * 3 + i] = color[i]
