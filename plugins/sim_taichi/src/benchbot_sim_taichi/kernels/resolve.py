# mypy: ignore-errors
"""Edges at their full worth: more camera rays through pixels that hold several surfaces.

On a processor the rays of four such pixels of a square of 4 x 4 go together, each in a lane of a packet.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.first_hits import TILE
from benchbot_sim_taichi.kernels.lanes import ints16, vec16
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.lightmap import light_at
from benchbot_sim_taichi.kernels.packet import RAYS, Packet, trace_packet
from benchbot_sim_taichi.kernels.paint import (
    GUIDE_STRIDE,
    MIRROR_STRIDE,
    REFLECT_ROUGHNESS,
    ROUGH,
    SHADE_STRIDE,
    SUN_EDGE,
    gloss,
    surface_number,
)
from benchbot_sim_taichi.kernels.reflectance import INV_PI, pane_reflectance
from benchbot_sim_taichi.kernels.shading import compress, expand, mirrored_share, shade
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, vec3
from benchbot_sim_taichi.tables import CAMERA_STRIDE

SUBSAMPLES = 4
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
    lowest = vec3(FAR)
    highest = vec3(0.0)
    for y in range(ti.max(top - 1, 0), ti.min(top + TILE + 1, height)):
        for x in range(ti.max(left - 1, 0), ti.min(left + TILE + 1, width)):
            value = load3(centers, (first + y * width + x) * 3)
            lowest = ti.min(lowest, value)
            highest = ti.max(highest, value)
    return steps_visibly(lowest, highest, lowest)


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
    t = guide[here * GUIDE_STRIDE + 3]
    found = (kinds[here] & SUN_EDGE) != 0
    for k in range(9):
        sx = ti.math.clamp(x + k % 3 - 1, 0, width - 1)
        sy = ti.math.clamp(y + k // 3 - 1, 0, height - 1)
        other = first + sy * width + sx
        beside = load3(centers, other * 3)
        lowest = ti.min(lowest, beside)
        highest = ti.max(highest, beside)
        if shades[other * SHADE_STRIDE + 3] != shades[here * SHADE_STRIDE + 3]:
            found = True
        elif t < FAR:
            if load3(guide, here * GUIDE_STRIDE).dot(load3(guide, other * GUIDE_STRIDE)) < 0.85:
                found = True
            if ti.abs(guide[other * GUIDE_STRIDE + 3] - t) > 0.05 * t:
                found = True
    return found and steps_visibly(lowest, highest, highest)


@ti.func
def point_in_pixel(x, y, sample):
    """Return a point of a pixel for each sample, on a rotated grid: four rows, four columns, one sample in each."""
    across = ti.cast(x, ti.f32) + (ti.cast((sample * 2 + sample // 2) % 4, ti.f32) + 0.5) * 0.25
    down = ti.cast(y, ti.f32) + (ti.cast(sample, ti.f32) + 0.5) * 0.25
    return across, down


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
                    reflection = stored.irradiance * INV_PI
                mirrored = mirrored_share(env, direction, surface.normal, surface)
                value = shade(env, direction, surface, stored.irradiance, stored.sun, mirrored, reflection)
    return value


@ti.kernel
def resolve_tiles(
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
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Exposed linear radiance (3 per pixel), from its `centers` alone where the neighbours look the same."""
    columns = (width + TILE - 1) // TILE
    rows = (height + TILE - 1) // TILE
    for member in range(count * columns * rows * RAYS):  # one thread takes 512 at least, which would be many as tiles
        if member % RAYS == 0:
            tile = member // RAYS
            picture = tile // (columns * rows)
            inside = tile - picture * (columns * rows)
            left = inside % columns * TILE
            top = inside // columns * TILE
            first = picture * width * height
            eye = picture * CAMERA_STRIDE
            origin = camera_origin(cameras, eye)
            edge = ti.Vector([0] * RAYS, dt=ti.i32)
            edges = 0
            may = may_have_contrast(centers, first, left, top, width, height)
            for i in range(RAYS):
                x = left + i % TILE
                y = top + i // TILE
                if x < width and y < height:
                    if may and at_edge(centers, guide, shades, kinds, first, x, y, width, height):
                        edge[edges] = i
                        edges += 1
                    else:
                        color = expand(load3(centers, (first + y * width + x) * 3))
                        for c in ti.static(range(3)):
                            radiance[(first + y * width + x) * 3 + c] = color[c]
            for group in range((edges + 3) // 4):
                along_x, along_y, along_z = vec16(0.0), vec16(0.0), vec16(0.0)
                for i in range(RAYS):
                    place = edge[ti.min(group * 4 + i // SUBSAMPLES, edges - 1)]
                    px, py = point_in_pixel(left + place % TILE, top + place // TILE, i % SUBSAMPLES)
                    way = camera_ray(cameras, eye, px, py)
                    along_x[i], along_y[i], along_z[i] = way.x, way.y, way.z
                rays = Packet(along_x=along_x, along_y=along_y, along_z=along_z, reach=vec16(FAR))
                rays.x, rays.y, rays.z = vec16(origin.x), vec16(origin.y), vec16(origin.z)
                # What is indexed at run time lies in memory: not the packet itself.
                triangle = ti.Vector([-1] * 32, dt=ti.i32)
                reach = ti.Vector([FAR] * 32, dt=ti.f32)
                us = ti.Vector([0.0] * 32, dt=ti.f32)
                vs = ti.Vector([0.0] * 32, dt=ti.f32)
                root = 0
                slot = 0
                while root >= 0:
                    rays.triangle = ints16(-1)
                    trace_packet(nodes, leaves, root, rays, False)
                    for i in range(RAYS):
                        triangle[slot + i] = rays.triangle[i]
                        reach[slot + i] = rays.reach[i]
                        us[slot + i] = rays.u[i]
                        vs[slot + i] = rays.v[i]
                    root = ti.select(root == 0, sheer_root, -1)
                    slot += RAYS
                for number in range(ti.min(4, edges - group * 4)):
                    place = edge[group * 4 + number]
                    x = left + place % TILE
                    y = top + place // TILE
                    pixel = first + y * width + x
                    total = load3(centers, pixel * 3)
                    for s in range(SUBSAMPLES):
                        lane = number * SUBSAMPLES + s
                        hits = ti.Vector([0.0] * 8)
                        for part in ti.static(range(2)):
                            hits[part * 4] = reach[part * RAYS + lane]
                            hits[part * 4 + 1] = ti.bit_cast(triangle[part * RAYS + lane], ti.f32)
                            hits[part * 4 + 2] = us[part * RAYS + lane]
                            hits[part * 4 + 3] = vs[part * RAYS + lane]
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
                            vec3(along_x[lane], along_y[lane], along_z[lane]),
                            1.0 / cameras[eye + 12],
                            hits,
                            (y * width + x) * SUBSAMPLES + s,
                            first,
                            x,
                            y,
                            width,
                            height,
                        )
                        total += compress(value * load3(cameras, eye + 16))
                    color = expand(total / ti.cast(SUBSAMPLES + 1, ti.f32))
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
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """The same on a GPU, each pixel for itself."""
    for pixel in range(count * width * height):
        x, y, first, eye = locate(pixel, width, height)
        total = load3(centers, pixel * 3)
        if at_edge(centers, guide, shades, kinds, first, x, y, width, height):
            origin = camera_origin(cameras, eye)
            for s in range(SUBSAMPLES):
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
                    (y * width + x) * SUBSAMPLES + s,
                    first,
                    x,
                    y,
                    width,
                    height,
                )
                total += compress(value * load3(cameras, eye + 16))
            total /= ti.cast(SUBSAMPLES + 1, ti.f32)
        color = expand(total)
        for c in ti.static(range(3)):
            radiance[pixel * 3 + c] = color[c]
