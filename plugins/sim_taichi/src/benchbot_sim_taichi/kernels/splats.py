# mypy: ignore-errors
"""Pictures of Gaussian splats.

Each Gaussian is projected by an affine approximation of the camera, lens included, about its middle (EWA: Zwicker,
Pfister, van Baar and Gross, "EWA volume splatting", 2001). They are blended front to back in tiles (Kerbl et al., "3D
Gaussian splatting for real-time radiance field rendering", 2023, whose constants these are). In a row of a tile, the
lanes of a vector are its pixels.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import LANES, ints16, larger, largest, smaller, to_floats, vec16
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import floats, ints, vec3
from benchbot_sim_taichi.splat_tables import SEEN_STRIDE, SPAN_STRIDE, SPLAT_STRIDE, TILE_HEIGHT, TILE_WIDTH

NEAR_M = 0.2
"""Nearer middles are not drawn: the approximation has no meaning there."""
LOW_PASS_PIXELS2 = 0.3
"""Variance that is added in the picture, so that no Gaussian falls between pixels."""
LEAST_ALPHA, MOST_ALPHA = 1.0 / 255.0, 0.99
OPAQUE = 1e-4
"""Less light than this that passes makes no difference to a byte."""
DEEPEST = -6.0
"""Exponents below this are of less than `LEAST_ALPHA`."""

INFINITE_M = float("inf")


@ti.func
def lens_at(cameras: ti.template(), at, x, y):
    """Where a lens shows a point of the image plane (2), and the derivatives of that by the point (2 x 2).

    `distortion.Distortion.distort`, with k1, k2, p1, p2, k3 from `at` on.
    """
    k1, k2, p1, p2, k3 = cameras[at], cameras[at + 1], cameras[at + 2], cameras[at + 3], cameras[at + 4]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    growth = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))
    shown = ti.Vector(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    )
    xx = radial + x * x * growth + 2.0 * p1 * y + 6.0 * p2 * x
    xy = x * y * growth + 2.0 * p1 * x + 2.0 * p2 * y
    yy = radial + y * y * growth + 6.0 * p1 * y + 2.0 * p2 * x
    return shown, ti.Vector([xx, xy, yy])


@ti.kernel
def project(
    splats: floats,
    cameras: floats,
    eye: ti.i32,
    bounds: floats,
    seen: floats,
    spans: ints,
    keys: ints,
    count: ti.i32,
    columns: ti.i32,
    rows: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Find where each splat is in a picture, and in which tiles; `keys` has the bits of its depth, 0 if it is in none.

    `bounds` (left, right, top, bottom) of the image plane: the camera is linearised within them, as far off it is too
    wild.
    """
    for i in range(count):
        at = i * SPLAT_STRIDE
        away = load3(splats, at) - load3(cameras, eye + 9)
        place = vec3(0.0)
        for k in ti.static(range(3)):
            place[k] = cameras[eye + k] * away.x + cameras[eye + 3 + k] * away.y + cameras[eye + 6 + k] * away.z
        key = 0
        if place.z > NEAR_M:
            x, y = place.x / place.z, place.y / place.z
            near_x = ti.math.clamp(x, bounds[0], bounds[1])
            near_y = ti.math.clamp(y, bounds[2], bounds[3])
            shown = ti.Vector([near_x, near_y])
            bent = ti.Vector([1.0, 0.0, 1.0])
            if cameras[eye + 19] != 0.0:
                shown, bent = lens_at(cameras, eye + 20, near_x, near_y)
            fx, fy = cameras[eye + 12], cameras[eye + 13]
            mean_x = (shown[0] + bent[0] * (x - near_x) + bent[1] * (y - near_y)) * fx + cameras[eye + 14]
            mean_y = (shown[1] + bent[1] * (x - near_x) + bent[2] * (y - near_y)) * fy + cameras[eye + 15]
            # How the picture's place changes with the camera's x, y and z, then with the map's.
            down = vec3(bent[0], bent[1], -(bent[0] * near_x + bent[1] * near_y)) * (fx / place.z)
            over = vec3(bent[1], bent[2], -(bent[1] * near_x + bent[2] * near_y)) * (fy / place.z)
            by_x, by_y = vec3(0.0), vec3(0.0)
            for k in ti.static(range(3)):
                row = load3(cameras, eye + 3 * k)
                by_x[k] = row.dot(down)
                by_y[k] = row.dot(over)
            sxx, sxy, sxz = splats[at + 3], splats[at + 4], splats[at + 5]
            syy, syz, szz = splats[at + 6], splats[at + 7], splats[at + 8]
            spread_x = vec3(
                sxx * by_x.x + sxy * by_x.y + sxz * by_x.z,
                sxy * by_x.x + syy * by_x.y + syz * by_x.z,
                sxz * by_x.x + syz * by_x.y + szz * by_x.z,
            )
            spread_y = vec3(
                sxx * by_y.x + sxy * by_y.y + sxz * by_y.z,
                sxy * by_y.x + syy * by_y.y + syz * by_y.z,
                sxz * by_y.x + syz * by_y.y + szz * by_y.z,
            )
            xx = by_x.dot(spread_x) + LOW_PASS_PIXELS2
            xy = by_x.dot(spread_y)
            yy = by_y.dot(spread_y) + LOW_PASS_PIXELS2
            determinant = xx * yy - xy * xy
            opacity = splats[at + 9]
            # Squared standard deviations from the middle at which alpha is the least that is drawn.
            reach = 2.0 * ti.log(opacity / LEAST_ALPHA)
            if determinant > 0.0 and reach > 0.0 and bent[0] * bent[2] > bent[1] * bent[1]:
                half_x, half_y = ti.sqrt(reach * xx), ti.sqrt(reach * yy)
                if (
                    mean_x + half_x > 0.0
                    and mean_x - half_x < width
                    and mean_y + half_y > 0.0
                    and mean_y - half_y < height
                ):
                    key = ti.bit_cast(place.z, ti.i32)
                    first = ti.max(mean_x - half_x, 0.0) / TILE_WIDTH
                    last = ti.min(mean_x + half_x, ti.cast(width, ti.f32)) / TILE_WIDTH
                    upper = ti.max(mean_y - half_y, 0.0) / TILE_HEIGHT
                    lower = ti.min(mean_y + half_y, ti.cast(height, ti.f32)) / TILE_HEIGHT
                    spans[i * SPAN_STRIDE] = ti.cast(first, ti.i32)
                    spans[i * SPAN_STRIDE + 1] = ti.min(ti.cast(last, ti.i32), columns - 1)
                    spans[i * SPAN_STRIDE + 2] = ti.cast(upper, ti.i32)
                    spans[i * SPAN_STRIDE + 3] = ti.min(ti.cast(lower, ti.i32), rows - 1)
                    along = away.normalized()
                    out = i * SEEN_STRIDE
                    seen[out] = mean_x
                    seen[out + 1] = mean_y
                    seen[out + 2] = -0.5 * yy / determinant
                    seen[out + 3] = xy / determinant
                    seen[out + 4] = -0.5 * xx / determinant
                    seen[out + 5] = half_y
                    seen[out + 6] = opacity
                    for channel in ti.static(range(3)):
                        slope = load3(splats, at + 13 + 3 * channel)
                        seen[out + 7 + channel] = ti.max(splats[at + 10 + channel] + slope.dot(along), 0.0)
                    # Of what is at a pixel, the expected depth changes with it.
                    ahead = vec3(cameras[eye + 2], cameras[eye + 5], cameras[eye + 8])
                    with_x, with_y = ahead.dot(spread_x), ahead.dot(spread_y)
                    seen[out + 10] = place.z
                    seen[out + 11] = (with_x * yy - with_y * xy) / determinant
                    seen[out + 12] = (with_y * xx - with_x * xy) / determinant
        keys[i] = key


@ti.kernel
def count_in_tiles(
    order: ints, spans: ints, counts: ints, visible: ti.i32, pieces: ti.i32, columns: ti.i32, tiles: ti.i32
):
    """Count how many splats each piece of `order` has in each tile: (pieces, tiles)."""
    for piece in range(pieces):
        for tile in range(tiles):
            counts[piece * tiles + tile] = 0
        for rank in range(visible * piece // pieces, visible * (piece + 1) // pieces):
            span = order[rank] * SPAN_STRIDE
            for row in range(spans[span + 2], spans[span + 3] + 1):
                for column in range(spans[span], spans[span + 1] + 1):
                    counts[piece * tiles + row * columns + column] += 1


@ti.kernel
def fill_tiles(
    order: ints, spans: ints, starts: ints, lists: ints, visible: ti.i32, pieces: ti.i32, columns: ti.i32, tiles: ti.i32
):
    """List the splats of each tile, nearest first; `starts` (pieces, tiles) are where each piece goes on."""
    for piece in range(pieces):
        for rank in range(visible * piece // pieces, visible * (piece + 1) // pieces):
            splat = order[rank]
            span = splat * SPAN_STRIDE
            for row in range(spans[span + 2], spans[span + 3] + 1):
                for column in range(spans[span], spans[span + 1] + 1):
                    at = piece * tiles + row * columns + column
                    lists[starts[at]] = splat
                    starts[at] += 1


@ti.func
def exponential(x):
    """The exponential of lanes from `DEEPEST` to 0, to 5e-5 of it: a sixteenth's Taylor series, to the 16th power."""
    x *= 1.0 / 16.0
    part = 1.0 + x * (1.0 + x * (1.0 / 2.0 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0)))))
    part *= part
    part *= part
    part *= part
    return part * part


@ti.kernel
def blend(
    seen: floats,
    lists: ints,
    begins: ints,
    colors: ints,
    medians: floats,
    at_pixel: ti.i32,
    columns: ti.i32,
    rows: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Blend the splats of each pixel: `colors` of three bytes, red the lowest, before black.

    `medians` are depths in metres behind which half of the light is gone, infinite where it never is: what the last
    splat before is expected to have at the pixel.
    """
    for line in range(columns * rows * TILE_HEIGHT):
        tile = line // TILE_HEIGHT
        y = tile // columns * TILE_HEIGHT + line % TILE_HEIGHT
        left = tile % columns * TILE_WIDTH
        if y < height:
            middle_y = ti.cast(y, ti.f32) + 0.5
            middle_x = to_floats(ints16(LANES)) + (ti.cast(left, ti.f32) + 0.5)
            passing, median = vec16(1.0), vec16(0.0)
            red, green, blue = vec16(0.0), vec16(0.0), vec16(0.0)
            entry, end = begins[tile], begins[tile + 1]
            while entry < end:
                at = lists[entry] * SEEN_STRIDE
                entry += 1
                dy = middle_y - seen[at + 1]
                if ti.abs(dy) < seen[at + 5]:
                    dx = middle_x - seen[at]
                    power = dx * (dx * seen[at + 2] + seen[at + 3] * dy) + seen[at + 4] * dy * dy
                    alpha = exponential(larger(power, vec16(DEEPEST))) * seen[at + 6]
                    alpha = smaller(alpha, vec16(MOST_ALPHA))
                    alpha = ti.select(alpha < LEAST_ALPHA, vec16(0.0), alpha)
                    # That of the last one that half of the light has reached.
                    depth = dx * seen[at + 11] + (seen[at + 10] + seen[at + 12] * dy)
                    nearer = ti.select(passing > 0.5, depth, median)
                    median = ti.select(passing * alpha > 0.0, nearer, median)
                    share = passing * alpha
                    red += share * seen[at + 7]
                    green += share * seen[at + 8]
                    blue += share * seen[at + 9]
                    passing = passing - share
                    if entry % 4 == 0 and largest(passing) < OPAQUE:
                        entry = end
            for lane in range(16):
                if left + lane < width:
                    pixel = at_pixel + y * width + left + lane
                    medians[pixel] = ti.select(passing[lane] > 0.5, INFINITE_M, median[lane])
                    packed = 0
                    for channel in ti.static(range(3)):
                        light = (red, green, blue)[channel][lane]
                        packed |= ti.cast(ti.min(light, 1.0) * 255.0 + 0.5, ti.i32) << (8 * channel)
                    colors[pixel] = packed


@ti.kernel
def put_in_front(
    colors: ints,
    medians: floats,
    words: ints,
    is_changed: ints,
    instances: ti.i32,
    slack_m: ti.f32,
    depth_at: ti.i32,
    instance_at: ti.i32,
    rgb_at: ti.i32,
    rgb_words: ti.i32,
    count: ti.i32,
    pixels: ti.i32,
):
    """Take colours of frames' `words` where a changed object is before the splats, or less than `slack_m` behind."""
    for index in range(count * pixels):
        picture = index // pixels
        instance = words[instance_at + index]
        depth_m = ti.bit_cast(words[depth_at + index], ti.f32)
        if instance < instances and is_changed[instance] != 0 and depth_m < medians[index] + slack_m:
            color = 0
            for channel in ti.static(range(3)):
                byte = (index - picture * pixels) * 3 + channel
                word = words[rgb_at + picture * rgb_words + byte // 4]
                color |= (word >> (byte % 4 * 8) & 255) << (8 * channel)
            colors[index] = color
