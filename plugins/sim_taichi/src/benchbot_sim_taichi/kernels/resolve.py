# mypy: ignore-errors
"""Edges at their full worth: more camera rays through pixels that hold several surfaces.

On a processor such pixels are listed, the rays of four of them are traced and shaded at once, each in a lane
(`first_hits.meet`, `paint_tiles`), and then blended; on a GPU each sample has a thread.
"""

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.first_hits import PIXELS_AT_ONCE, SAMPLES, TILE, locate_tile, point_in_pixel
from benchbot_sim_taichi.kernels.lanes import (
    Lanes3,
    absolute,
    gather,
    gather_ints,
    ints16,
    larger,
    load16,
    smaller,
    vec16,
)
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.lightmap import light_at
from benchbot_sim_taichi.kernels.packet import RAYS
from benchbot_sim_taichi.kernels.paint import (
    GUIDE_STRIDE,
    MIRROR_STRIDE,
    ROUGH,
    SHADE_STRIDE,
    SUN_EDGE,
    gloss,
    surface_number,
)
from benchbot_sim_taichi.kernels.reflectance import pane_reflectance
from benchbot_sim_taichi.kernels.shading import (
    REFLECT_ROUGHNESS,
    compress,
    dull_reflection,
    expand,
    mirrored_share,
    shade,
)
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, vec3

VISIBLE_STEP = 0.02


@ti.func
def steps_visibly(lowest, highest, dark):
    """Return whether a range of colours is over `VISIBLE_STEP` wide, as square roots of compressed light.

    d sqrt(c) = dc / (2 sqrt(c)), squared to do without the root; its constant term spares noise in the dark.
    """
    step = (highest - lowest) ** 2 - (dark + 0.002) * (4.0 * VISIBLE_STEP * VISIBLE_STEP)
    return step.max() > 0.0


@ti.func
def may_have_contrast(centers: ti.template(), first, left, top, width, height):
    """Return whether any pixel of a square may have contrast: false only where no pixel has."""
    across = TILE + 2  # the square and a pixel around it, three values each: two registers for a row
    found = True
    if width >= across:
        begin = ti.math.clamp(left - 1, 0, width - across)
        darkest, brightest = vec16(FAR), vec16(0.0)
        darkest_end, brightest_end = vec16(FAR), vec16(0.0)
        for y in range(ti.max(top - 1, 0), ti.min(top + TILE + 1, height)):
            at = (first + y * width + begin) * 3
            row, row_end = load16(centers, at), load16(centers, at + across * 3 - RAYS)
            darkest, brightest = smaller(darkest, row), larger(brightest, row)
            darkest_end, brightest_end = smaller(darkest_end, row_end), larger(brightest_end, row_end)
        lowest, highest = vec3(FAR), vec3(0.0)
        for i in ti.static(range(RAYS)):
            lowest[i % 3] = ti.min(lowest[i % 3], darkest[i])
            highest[i % 3] = ti.max(highest[i % 3], brightest[i])
        for i in ti.static(range(2 * RAYS - (TILE + 2) * 3, RAYS)):
            lowest[(i + 2) % 3] = ti.min(lowest[(i + 2) % 3], darkest_end[i])
            highest[(i + 2) % 3] = ti.max(highest[(i + 2) % 3], brightest_end[i])
        found = steps_visibly(lowest, highest, lowest)
    return found


@ti.func
def beside_of(x, y, k, width, height):
    """Return one of the nine pixels around and at another, the nearest where the picture ends."""
    return ti.math.clamp(y + k // 3 - 1, 0, height - 1) * width + ti.math.clamp(x + k % 3 - 1, 0, width - 1)


@ti.func
def at_edge(
    centers: ti.template(),
    guide: ti.template(),
    shades: ti.template(),
    kinds: ti.template(),
    first,
    x,
    y,
    width,
    height,
):
    """Return whether a pixel has contrast and touches an edge of an object or sunshine, a crease, a jump in depth."""
    here = first + y * width + x
    lowest = load3(centers, here * 3)
    highest = lowest
    for k in range(9):
        beside = load3(centers, (first + beside_of(x, y, k, width, height)) * 3)
        lowest = ti.min(lowest, beside)
        highest = ti.max(highest, beside)
    found = False
    if steps_visibly(lowest, highest, highest):
        t = guide[here * GUIDE_STRIDE + 3]
        found = (kinds[here] & SUN_EDGE) != 0
        k = 0
        while k < 9 and not found:
            other = first + beside_of(x, y, k, width, height)
            if shades[other * SHADE_STRIDE + 3] != shades[here * SHADE_STRIDE + 3]:
                found = True
            elif t < FAR:
                found = ti.abs(guide[other * GUIDE_STRIDE + 3] - t) > 0.05 * t
                if load3(guide, here * GUIDE_STRIDE).dot(load3(guide, other * GUIDE_STRIDE)) < 0.85:
                    found = True
            k += 1
    return found


@ti.func
def edges_of_square(
    centers: ti.template(),
    guide: ti.template(),
    shades: ti.template(),
    kinds: ti.template(),
    first,
    left,
    top,
    width,
    height,
):
    """Return 1 in the lanes of pixels that are `at_edge`; pixels beyond the picture are taken for its last ones."""
    x, y = ints16([i % TILE for i in range(RAYS)]) + left, ints16([i // TILE for i in range(RAYS)]) + top
    x, y = smaller(x, ints16(width - 1)), smaller(y, ints16(height - 1))
    here = y * width + x + first
    number = gather(shades, here * SHADE_STRIDE + 3)
    at = here * GUIDE_STRIDE
    normal = Lanes3(x=gather(guide, at), y=gather(guide, at + 1), z=gather(guide, at + 2))
    t = gather(guide, at + 3)
    found = gather_ints(kinds, here) & SUN_EDGE
    lowest = Lanes3(x=vec16(FAR), y=vec16(FAR), z=vec16(FAR))
    highest = Lanes3(x=vec16(0.0), y=vec16(0.0), z=vec16(0.0))
    for k in range(9):
        beside_x = smaller(larger(x + (k % 3 - 1), ints16(0)), ints16(width - 1))
        beside_y = smaller(larger(y + (k // 3 - 1), ints16(0)), ints16(height - 1))
        beside = beside_y * width + beside_x + first
        red, green, blue = (
            gather(centers, beside * 3),
            gather(centers, beside * 3 + 1),
            gather(centers, beside * 3 + 2),
        )
        lowest = Lanes3(x=smaller(lowest.x, red), y=smaller(lowest.y, green), z=smaller(lowest.z, blue))
        highest = Lanes3(x=larger(highest.x, red), y=larger(highest.y, green), z=larger(highest.z, blue))
        at = beside * GUIDE_STRIDE
        alignment = normal.x * gather(guide, at) + normal.y * gather(guide, at + 1) + normal.z * gather(guide, at + 2)
        jump = absolute(gather(guide, at + 3) - t)
        other = gather(shades, beside * SHADE_STRIDE + 3)
        found = ti.select((t < FAR) & ((alignment < 0.85) | (jump > 0.05 * t)), ints16(1), found)
        found = ti.select(other != number, ints16(1), found)
    step_x, step_y, step_z = highest.x - lowest.x, highest.y - lowest.y, highest.z - lowest.z
    least = 4.0 * VISIBLE_STEP * VISIBLE_STEP
    over = larger(step_x * step_x - (highest.x + 0.002) * least, step_y * step_y - (highest.y + 0.002) * least)
    over = larger(over, step_z * step_z - (highest.z + 0.002) * least)
    return ti.select((found != 0) & (over > 0.0), ints16(1), ints16(0))


@ti.func
def borrowed(
    shades: ti.template(), mirrors: ti.template(), kinds: ti.template(), number, is_glass, first, x, y, width, height
):
    """Return what a pixel near by, of the same surface, mirrors; negative where there is none."""
    reflection = vec3(-1.0)
    for k in range(9):  # the pixel itself first
        sx = ti.math.clamp(x + (k + 4) % 9 % 3 - 1, 0, width - 1)
        sy = ti.math.clamp(y + (k + 4) % 9 // 3 - 1, 0, height - 1)
        other = first + sy * width + sx
        shown = shades[other * SHADE_STRIDE + 3]
        is_same = shown == number
        if is_glass == 1:
            is_same = shown < -1.5
        if reflection.x < 0.0 and is_same and gloss(kinds[other]) != ROUGH:
            reflection = load3(mirrors, other * MIRROR_STRIDE + 11)
    return reflection


@ti.func
def seen_through(
    nodes: ti.template(),
    leaves: ti.template(),
    sheer_root,
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    env: ti.template(),
    places: ti.template(),
    index: ti.template(),
    light: ti.template(),
    shades: ti.template(),
    mirrors: ti.template(),
    kinds: ti.template(),
    origin,
    ray,
    pixel_angle,
    hits,
    sample,
    first,
    x,
    y,
    width,
    height,
):
    """Return the radiance along one ray of a pixel; `hits` are the nearest opaque one and the sheer one before it.

    Each is four values: distance, triangle (bits), u and v.
    """
    direction = ray.normalized()
    value = outlook(env, direction, pixel_angle)
    for part in range(2):
        hit = Hit(
            t=hits[part * 4],
            triangle=ti.bit_cast(hits[part * 4 + 1], ti.i32),
            u=hits[part * 4 + 2],
            v=hits[part * 4 + 3],
        )
        if hit.triangle >= 0:
            surface = surface_at(
                triangles, materials, texels, images, hit.triangle, hit.u, hit.v, direction, hit.t * pixel_angle
            )
            reflection = vec3(-1.0)
            if surface.is_glass == 1 or surface.roughness < REFLECT_ROUGHNESS:
                number = surface_number(triangles, hit.triangle)
                reflection = borrowed(shades, mirrors, kinds, number, surface.is_glass, first, x, y, width, height)
            if surface.is_cut == 0 and surface.is_glass == 1:
                mirrored = pane_reflectance(surface.specular.x, -surface.normal.dot(direction))
                value *= surface.diffuse * (1.0 - mirrored)
                value += ti.max(reflection, 0.0) * mirrored
            elif surface.is_cut == 0:
                stored = light_at(
                    nodes,
                    leaves,
                    sheer_root,
                    triangles,
                    materials,
                    texels,
                    images,
                    env,
                    places,
                    index,
                    light,
                    hit,
                    surface.face,
                    origin + ray * hit.t,
                    sample,
                )
                if reflection.x < 0.0:
                    reflection = dull_reflection(direction, surface, stored)
                mirrored = mirrored_share(env, direction, surface.normal, surface)
                value = shade(env, direction, surface, stored.irradiance, stored.sun, mirrored, reflection)
    return value


@ti.kernel
def find_edges(
    centers: floats,
    guide: floats,
    shades: floats,
    kinds: ints,
    marks: ints,
    radiance: floats,
    tiles: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Mark pixels that hold several surfaces, square by square: their number, or -1.

    `radiance` is what the others' `centers` say: exposed and linear.
    """
    for member in range(tiles * RAYS):  # one thread takes 512 at least, which would be many as tiles
        if member % RAYS == 0:
            tile = member // RAYS
            picture, left, top = locate_tile(tile, width, height)
            first = picture * width * height
            is_edge = ints16(0)
            if may_have_contrast(centers, first, left, top, width, height):
                is_edge = edges_of_square(centers, guide, shades, kinds, first, left, top, width, height)
            for i in range(RAYS):
                x = left + i % TILE
                y = top + i // TILE
                marks[member + i] = -1
                if x < width and y < height:
                    pixel = first + y * width + x
                    if is_edge[i] != 0:
                        marks[member + i] = pixel
                    else:
                        color = expand(load3(centers, pixel * 3))
                        for c in ti.static(range(3)):
                            radiance[pixel * 3 + c] = color[c]


def edges_of(marks: npt.NDArray[np.int32], count: int) -> npt.NDArray[np.int32]:
    """Return the marked pixels of `count` pictures as `first_hits.points_of` takes them.

    Each picture begins another four pixels: what is traced together is the same whatever a picture is taken with.
    """
    listed: list[npt.NDArray[np.int32]] = []
    for of_picture in marks.reshape(count, -1):
        edges = of_picture[of_picture >= 0]
        listed += [edges, np.full(-len(edges) % PIXELS_AT_ONCE, -1, np.int32)]
    return np.concatenate(listed)


@ti.kernel
def blend_samples(
    cameras: floats,
    pixels: ints,
    sample_shades: floats,
    sample_mirrors: floats,
    sample_kinds: ints,
    shades: floats,
    mirrors: floats,
    kinds: ints,
    centers: floats,
    radiance: floats,
    width: ti.i32,
    height: ti.i32,
):
    """Exposed linear radiance of the listed pixels, from their centers and samples."""
    for number in range(pixels.shape[0]):
        pixel = pixels[number]
        if pixel >= 0:
            x, y, first, eye = locate(pixel, width, height)
            total = load3(centers, pixel * 3)
            for s in range(SAMPLES):
                sample = number * SAMPLES + s
                color = load3(sample_shades, sample * SHADE_STRIDE)
                if gloss(sample_kinds[sample]) != ROUGH:
                    of = sample_shades[sample * SHADE_STRIDE + 3]
                    is_glass = ti.cast(of < 0.0, ti.i32)
                    reflection = borrowed(shades, mirrors, kinds, of, is_glass, first, x, y, width, height)
                    if reflection.x < 0.0:
                        reflection = load3(sample_mirrors, sample * MIRROR_STRIDE + 11)
                    color += load3(sample_mirrors, sample * MIRROR_STRIDE + 6) * reflection
                total += compress(color * load3(cameras, eye + 16))
            color = expand(total / ti.cast(SAMPLES + 1, ti.f32))
            for c in ti.static(range(3)):
                radiance[pixel * 3 + c] = color[c]


@ti.kernel
def resolve_pixels(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    places: floats,
    index: ints,
    light: ints,
    cameras: floats,
    guide: floats,
    shades: floats,
    mirrors: floats,
    kinds: ints,
    centers: floats,
    radiance: floats,
    listed: ints,
    samples: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Exposed linear radiance (3 per pixel) on a GPU, from its `centers` alone where the neighbours look the same.

    The others are `listed`, from the second place on, in any order: their number, in the first. Threads that have
    nothing to trace would otherwise wait for those that have. `samples` (3 each) are what is traced for them.
    """
    listed[0] = 0
    for pixel in range(count * width * height):
        x, y, first, _ = locate(pixel, width, height)
        if at_edge(centers, guide, shades, kinds, first, x, y, width, height):
            listed[ti.atomic_add(listed[0], 1) + 1] = pixel
        else:
            color = expand(load3(centers, pixel * 3))
            for c in ti.static(range(3)):
                radiance[pixel * 3 + c] = color[c]
    for sample in range(listed[0] * SAMPLES):
        s = sample % SAMPLES
        x, y, first, eye = locate(listed[sample // SAMPLES + 1], width, height)
        origin = camera_origin(cameras, eye)
        px, py = point_in_pixel(x, y, s)
        ray = camera_ray(cameras, eye, px, py)
        hits = ti.Vector([0.0] * 8)
        hits[1] = ti.bit_cast(-1, ti.f32)
        hits[5] = ti.bit_cast(-1, ti.f32)
        reach = FAR
        for part in range(2):
            root = ti.select(part == 0, 0, sheer_root)
            if root >= 0:
                hit = trace(nodes, leaves, root, origin, ray, reach, False)
                reach = ti.min(reach, hit.t)
                hits[part * 4] = hit.t
                hits[part * 4 + 1] = ti.bit_cast(hit.triangle, ti.f32)
                hits[part * 4 + 2] = hit.u
                hits[part * 4 + 3] = hit.v
        value = seen_through(
            nodes,
            leaves,
            sheer_root,
            triangles,
            materials,
            texels,
            images,
            env,
            places,
            index,
            light,
            shades,
            mirrors,
            kinds,
            origin,
            ray,
            1.0 / cameras[eye + 12],
            hits,
            (y * width + x) * SAMPLES + s,
            first,
            x,
            y,
            width,
            height,
        )
        shown = compress(value * load3(cameras, eye + 16))
        for c in ti.static(range(3)):
            samples[sample * 3 + c] = shown[c]
    for number in range(listed[0]):
        pixel = listed[number + 1]
        total = load3(centers, pixel * 3)
        for s in range(SAMPLES):
            total += load3(samples, (number * SAMPLES + s) * 3)
        color = expand(total / ti.cast(SAMPLES + 1, ti.f32))
        for c in ti.static(range(3)):
            radiance[pixel * 3 + c] = color[c]
