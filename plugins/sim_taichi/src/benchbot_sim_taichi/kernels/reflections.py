# mypy: ignore-errors
"""The radiance that smooth surfaces and panes mirror: traced, spread among neighbours where they are rough, added.

Of glossy surfaces every other pixel traces a ray of its own, in a pattern that the filter averages out (interleaved
sampling: Keller and Heidrich, 2001), and one to a lamp, which such rays seldom meet. Where little is mirrored, every
fourth does; a pixel that none beside it could speak for does in any case.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.first_hits import camera_rays
from benchbot_sim_taichi.kernels.lanes import (
    LANES,
    Lanes3,
    absolute,
    dot3,
    gather,
    gather_ints,
    ints16,
    lane3,
    larger,
    negated,
    scaled3,
    smaller,
    to_floats,
    union,
    vec16,
)
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.light_grid import density_in_row, row_near, sample_near, shifted
from benchbot_sim_taichi.kernels.lightmap import OFFSET_M, stored_light
from benchbot_sim_taichi.kernels.neighbours import MIN_ALIGNMENT, fit, pixel_plane
from benchbot_sim_taichi.kernels.paint import FAINT, GLOSSY, GUIDE_STRIDE, MIRROR_STRIDE, ROUGH, SHADE_STRIDE, gloss
from benchbot_sim_taichi.kernels.panes import MAX_LAYERS, STEP_M, sent, sheerness
from benchbot_sim_taichi.kernels.reflectance import INV_PI, mirror_direction, scatter
from benchbot_sim_taichi.kernels.sampling import bounded, interleave_index, power_share, sobol_2d
from benchbot_sim_taichi.kernels.shading import compress, mirrored_share
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, vec3
from benchbot_sim_taichi.tables import CAMERA_STRIDE

BRIGHTEST_REFLECTION = 20.0  # brighter than windows by day
LEAST_MIRRORED = 0.07
STEEPEST = 0.02
UNSEEN = -1.0


@ti.func
def lobe(mirrors: ti.template(), out, view, toward):
    """Return the share of light from `toward` that a glossy surface mirrors, per solid angle and colour (3).

    The fourth value is the density with which `mirror_direction` finds it. The shares of all directions integrate to 1.
    """
    normal = load3(mirrors, out)
    mirrored = load3(mirrors, out + 6)
    sent_on = scatter(normal, view, toward, vec3(0.0), load3(mirrors, out + 14), mirrors[out + 9], 1.0)
    even = ti.max(mirrored, 1e-4)
    return ti.Vector([sent_on.x / even.x, sent_on.y / even.y, sent_on.z / even.z, sent_on.w])


@ti.func
def no_glare(cameras: ti.template(), eye, reflection, mirrored):
    """The same colour, no brighter than `BRIGHTEST_REFLECTION` in the picture; than white where little is `mirrored`.

    A rare bright hit would show as a square of the filter. `LEAST_MIRRORED` is what floors mirror of a window.
    """
    exposure = load3(cameras, eye + 16)
    brightest = ti.max(BRIGHTEST_REFLECTION, 1.0 / ti.max(mirrored.max(), LEAST_MIRRORED))
    return bounded(reflection * exposure, brightest) / exposure


@ti.func
def stratum(x, y, share_bits):
    """Rank of a pixel in its 8x8 tile: those of either colour of the chessboard have 32 in a row with one bit.

    With two bits the pixels whose x and y are even have 16 in a row.
    """
    rank = interleave_index(x, y)
    return (rank >> share_bits) | (rank & ((1 << share_bits) - 1)) << (6 - share_bits)


@ti.func
def has_own_ray(kind, x, y):
    """Return whether a glossy pixel is of those that trace what they mirror."""
    return (x ^ y) & 1 == 0 and ((kind & FAINT) == 0 or y & 1 == 0)


@ti.func
def is_alone(cameras: ti.template(), eye, guide: ti.template(), kinds: ti.template(), first, x, y, width, height):
    """Return whether no pixel beside another traces for it what their surface mirrors, as on thin and bent things."""
    plane = pixel_plane(cameras, eye, guide, first + y * width + x, x, y)
    found = False
    k = 0
    while k < 9 and not found:
        dx, dy = k % 3 - 1, k // 3 - 1
        if 0 <= x + dx < width and 0 <= y + dy < height:
            other = first + (y + dy) * width + x + dx
            if gloss(kinds[other]) == GLOSSY and has_own_ray(kinds[other], x + dx, y + dy):
                found = fit(guide, plane, dx, dy, other) > 0.0
        k += 1
    return not found


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
    places: floats,
    index: ints,
    light: ints,
    cameras: floats,
    guide: floats,
    mirrors: floats,
    kinds: ints,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    seed: ti.i32,
):
    """Trace what pixels mirror: radiance into their mirror, `UNSEEN` where neighbours are to speak for them.

    In each row first those of the chessboard's one colour, then the others: threads beside one another then have
    either all or none a glossy surface's ray to trace.
    """
    for number in range(count * width * height):
        x, y, first, eye = locate(number, width, height)
        before = (width + 1 - (y & 1)) >> 1
        x = ti.select(x < before, 2 * x + (y & 1), 2 * (x - before) + 1 - (y & 1))
        pixel = first + y * width + x
        kind = gloss(kinds[pixel])
        out = pixel * MIRROR_STRIDE
        share_bits = ti.select((kinds[pixel] & FAINT) != 0, 2, 1)
        is_silent = kind == GLOSSY and not has_own_ray(kinds[pixel], x, y)
        if is_silent:
            is_silent = not is_alone(cameras, eye, guide, kinds, first, x, y, width, height)
        if is_silent:
            mirrors[out + 11] = UNSEEN
        elif kind != ROUGH:
            ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
            direction = ray.normalized()
            normal = load3(mirrors, out)
            face = load3(mirrors, out + 3)
            roughness = mirrors[out + 9]
            origin = camera_origin(cameras, eye) + ray * mirrors[out + 10]
            origin += face * (OFFSET_M + 1e-4 * mirrors[out + 10])
            toward = direction - normal * (2.0 * direction.dot(normal))
            rank = stratum(x, y, share_bits)
            weight = ti.Vector([1.0, 1.0, 1.0, 0.0])
            at_lamp = vec3(0.0)
            row = 0
            if kind == GLOSSY:
                view = negated(direction)
                if lamps > 0:
                    row = row_near(near, shifted(near, origin, face, rank), face)
                    sample = sample_near(near, lights, env, row, 1, portals, lamps, origin, rank, seed + 2)
                    if sample.value.max() > 0.0 and face.dot(sample.direction) > 0.0:
                        mirrored = lobe(mirrors, out, view, sample.direction)
                        mirrored *= power_share(sample.density / near[row + 1], mirrored.w)
                        given = no_glare(
                            cameras,
                            eye,
                            sample.value * vec3(mirrored.x, mirrored.y, mirrored.z),
                            load3(mirrors, out + 6),
                        )
                        if given.max() > 0.0:
                            at_lamp = (
                                given
                                * sent(
                                    nodes,
                                    leaves,
                                    sheer_root,
                                    triangles,
                                    materials,
                                    texels,
                                    images,
                                    origin,
                                    sample.direction,
                                    sample.distance,
                                ).share
                            )
                toward = mirror_direction(normal, view, roughness, sobol_2d(rank, seed + 4))
                weight = lobe(mirrors, out, view, toward)
                weight /= ti.Vector([weight.w, weight.w, weight.w, 1.0]) + 1e-20
            if toward.dot(face) < STEEPEST:
                toward = (toward + face * (STEEPEST - toward.dot(face))).normalized()
            hit = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
            passed = vec3(1.0)
            root = 0
            start = 0.0
            layers = 0
            while root >= 0:
                other = trace(nodes, leaves, root, origin + toward * start, toward, hit.t - start, False)
                if root == 0:
                    hit = other
                    root = sheer_root
                elif other.triangle >= 0 and layers < MAX_LAYERS:
                    layer = sheerness(triangles, materials, texels, images, other.triangle, other.u, other.v, toward)
                    passed *= ti.select(layer.panes == 1, layer.share, vec3(1.0))
                    start += other.t + STEP_M
                    layers += 1
                else:
                    root = -1
            reflection = outlook(env, toward, 0.002 + roughness * roughness)
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
                stored = stored_light(places, index, light, triangles, hit, surface.face)
                stored.irradiance += load3(env, 3) * (stored.sun * ti.max(surface.normal.dot(load3(env, 0)), 0.0))
                even = mirrored_share(env, toward, surface.normal, surface)
                reflection = (surface.diffuse * (vec3(1.0) - even) + even) * stored.irradiance * INV_PI
                density = 0.0
                lamp = light_of[hit.triangle]
                if kind == GLOSSY and lamp >= portals:
                    density = density_in_row(near, lights, row, 1, portals, lamp, toward * hit.t, toward)
                reflection += surface.emission * power_share(weight.w, density)
            reflection *= passed
            if kind == GLOSSY:
                reflection = (
                    no_glare(cameras, eye, reflection * vec3(weight.x, weight.y, weight.z), load3(mirrors, out + 6))
                    + at_lamp
                )
            for i in ti.static(range(3)):
                mirrors[out + 11 + i] = reflection[i]


@ti.kernel
def spread(
    cameras: floats,
    guide: floats,
    kinds: ints,
    source: floats,
    target: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    down: ti.i32,
    step: ti.i32,
    stride: ti.i32,
    begin: ti.i32,
):
    """Average what glossy surfaces mirror, taps `step` apart; `source` has `stride` values a pixel, from `begin` on."""
    for pixel in range(count * width * height):
        if gloss(kinds[pixel]) == GLOSSY:
            x, y, _, eye = locate(pixel, width, height)
            plane = pixel_plane(cameras, eye, guide, pixel, x, y)
            total = vec3(0.0)
            weights = 0.0
            for k in range(-2, 3):
                dx = ti.select(down == 0, k * step, 0)
                dy = ti.select(down == 0, 0, k * step)
                if 0 <= x + dx < width and 0 <= y + dy < height:
                    other = pixel + dy * width + dx
                    if gloss(kinds[other]) == GLOSSY and source[other * stride + begin] != UNSEEN:
                        # Either way each class of pixels modulo the filter's period counts alike.
                        tap = ti.select(ti.abs(k) == 2, 0.5, 1.0)
                        if step > 1:
                            tap = ti.select(k == 0, 1.0, ti.select(ti.abs(k) == 2, 0.1666667, 0.6666667))
                        weight = fit(guide, plane, dx, dy, other) * tap
                        total += load3(source, other * stride + begin) * weight
                        weights += weight
            if weights > 0.0:
                total /= weights
            elif stride == MIRROR_STRIDE:
                total.x = UNSEEN
            for i in ti.static(range(3)):
                target[pixel * 3 + i] = total[i]


@ti.kernel
def spread_lanes(
    cameras: floats,
    guide: floats,
    kinds: ints,
    source: floats,
    target: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    down: ti.i32,
    step: ti.i32,
    stride: ti.i32,
    begin: ti.i32,
):
    """The same on a processor: sixteen pixels of a row at once."""
    groups = (width + 15) // 16
    for member in range(count * height * groups * 16):  # one thread takes 512 at least
        if member % 16 == 0:
            row = member // 16 // groups
            left = (member // 16 - row * groups) * 16
            picture = row // height
            y = row - picture * height
            eye = picture * CAMERA_STRIDE
            lane = ints16(LANES)
            x = lane + left
            is_inside = ti.select(x < width, ints16(1), ints16(0))
            pixel = row * width + ti.select(x < width, x, ints16(width - 1))
            wanted = ti.select((gather_ints(kinds, pixel) & 3) == GLOSSY, is_inside, ints16(0))
            if union(wanted) != 0:
                middle_x, middle_y = to_floats(x) + 0.5, vec16(ti.cast(y, ti.f32) + 0.5)
                at = pixel * GUIDE_STRIDE
                normal = Lanes3(x=gather(guide, at), y=gather(guide, at + 1), z=gather(guide, at + 2))
                t = gather(guide, at + 3)
                slope = dot3(normal, camera_rays(cameras, eye, middle_x, middle_y))
                slope_on = vec16(0.0)
                if cameras[eye + 19] != 0.0:
                    if down == 1:
                        slope_on = dot3(normal, camera_rays(cameras, eye, middle_x, middle_y + 1.0)) - slope
                    else:
                        slope_on = dot3(normal, camera_rays(cameras, eye, middle_x + 1.0, middle_y)) - slope
                else:
                    slope_on = (
                        normal.x * cameras[eye + down]
                        + normal.y * cameras[eye + 3 + down]
                        + normal.z * cameras[eye + 6 + down]
                    ) / cameras[eye + 12 + down]
                offset = slope * t
                tolerance = 1.0 / (0.004 + 0.004 * t)
                total = Lanes3(x=vec16(0.0), y=vec16(0.0), z=vec16(0.0))
                weights = vec16(0.0)
                for k in range(-2, 3):
                    tap = ti.select(ti.abs(k) == 2, 0.5, 1.0)
                    if step > 1:
                        tap = ti.select(k == 0, 1.0, ti.select(ti.abs(k) == 2, 0.1666667, 0.6666667))
                    beside = k * step
                    other = ti.select(down == 1, pixel + beside * width, pixel + beside)
                    is_there = ti.select((x + beside >= 0) & (x + beside < width), wanted, ints16(0))
                    if down == 1:
                        is_there = ti.select(0 <= y + beside < height, wanted, ints16(0))
                    other = ti.select(is_there != 0, other, pixel)
                    at = other * GUIDE_STRIDE
                    far = gather(guide, at + 3)
                    alignment = (
                        normal.x * gather(guide, at)
                        + normal.y * gather(guide, at + 1)
                        + normal.z * gather(guide, at + 2)
                    )
                    off = absolute((slope + ti.cast(beside, ti.f32) * slope_on) * far - offset) * tolerance
                    fits = smaller((alignment - MIN_ALIGNMENT) * 10.0, vec16(1.0)) * smaller(2.0 - off, vec16(1.0))
                    red = gather(source, other * stride + begin)
                    usable = (far < FAR) & (alignment > MIN_ALIGNMENT) & (off < 2.0) & (red != UNSEEN)
                    weight = ti.select(usable & (is_there != 0), fits * tap, vec16(0.0))
                    weight = ti.select((gather_ints(kinds, other) & 3) == GLOSSY, weight, vec16(0.0))
                    total.x += red * weight
                    total.y += gather(source, other * stride + begin + 1) * weight
                    total.z += gather(source, other * stride + begin + 2) * weight
                    weights += weight
                total = scaled3(total, 1.0 / larger(weights, vec16(1e-20)))
                if stride == MIRROR_STRIDE:
                    total.x = ti.select(weights > 0.0, total.x, vec16(UNSEEN))
                for i in range(16):
                    if wanted[i] != 0:
                        for channel in ti.static(range(3)):
                            target[(row * width + left + i) * 3 + channel] = lane3(total, i)[channel]


@ti.kernel
def combine(
    cameras: floats,
    shades: floats,
    mirrors: floats,
    kinds: ints,
    spread_out: floats,
    centers: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Add what pixels mirror to their `centers`, of glossy ones as it was spread out."""
    for pixel in range(count * width * height):
        out = pixel * MIRROR_STRIDE
        if gloss(kinds[pixel]) != ROUGH:
            _, _, _, eye = locate(pixel, width, height)
            if gloss(kinds[pixel]) == GLOSSY:
                for i in ti.static(range(3)):
                    mirrors[out + 11 + i] = spread_out[pixel * 3 + i]
            color = load3(shades, pixel * SHADE_STRIDE) + load3(mirrors, out + 6) * load3(mirrors, out + 11)
            shown = compress(color * load3(cameras, eye + 16))
            for i in ti.static(range(3)):
                centers[pixel * 3 + i] = shown[i]
