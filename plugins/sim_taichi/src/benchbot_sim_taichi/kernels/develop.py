# mypy: ignore-errors
"""The last steps of a picture: bloom, tone curve, transfer function, bytes."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.camera_response import BRIGHTEST
from benchbot_sim_taichi.frames import PIXELS_PER_GROUP, WORDS_PER_GROUP
from benchbot_sim_taichi.kernels.lanes import (
    LANES,
    Lanes3,
    gather,
    ints16,
    larger,
    smaller,
    to_floats,
    to_ints,
    vec16,
)
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import floats, ints, vec3

bytes_ = ti.types.ndarray(dtype=ti.u8, ndim=1)


@ti.kernel
def shrink(
    radiance: floats, small: floats, count: ti.i32, width: ti.i32, height: ti.i32, cell: ti.i32, brightest: ti.f32
):
    """Means of squares of `cell` pixels, each pixel at most `brightest`."""
    columns = (width + cell - 1) // cell
    rows = (height + cell - 1) // cell
    for index in range(count * columns * rows):
        picture = index // (columns * rows)
        inside = index - picture * (columns * rows)
        left = inside % columns * cell
        top = inside // columns * cell
        total = vec3(0.0)
        pixels = 0.0
        for k in range(cell * cell):
            x = left + k % cell
            y = top + k // cell
            if x < width and y < height:
                total += ti.min(load3(radiance, ((picture * height + y) * width + x) * 3), brightest)
                pixels += 1.0
        for i in ti.static(range(3)):
            small[index * 3 + i] = total[i] / pixels


@ti.kernel
def scatter_down(
    small: floats, lens: floats, scattered: floats, count: ti.i32, columns: ti.i32, rows: ti.i32, reach: ti.i32
):
    """Two blurs of each column, one after the other (6 per cell); `lens` has both weights of every distance."""
    for index in range(count * columns * rows):
        y = index // columns % rows
        narrow = vec3(0.0)
        wide = vec3(0.0)
        narrow_sum = 0.0
        wide_sum = 0.0
        for d in range(-ti.min(reach, y), ti.min(reach, rows - 1 - y) + 1):
            value = load3(small, (index + d * columns) * 3)
            narrow += value * lens[ti.abs(d) * 2]
            wide += value * lens[ti.abs(d) * 2 + 1]
            narrow_sum += lens[ti.abs(d) * 2]
            wide_sum += lens[ti.abs(d) * 2 + 1]
        for i in ti.static(range(3)):
            scattered[index * 6 + i] = narrow[i] / narrow_sum
            scattered[index * 6 + 3 + i] = wide[i] / wide_sum


@ti.kernel
def scatter_across(
    scattered: floats, lens: floats, bloom: floats, count: ti.i32, columns: ti.i32, rows: ti.i32, reach: ti.i32
):
    """The same along rows, and the mean of both blurs."""
    for index in range(count * columns * rows):
        x = index % columns
        narrow = vec3(0.0)
        wide = vec3(0.0)
        narrow_sum = 0.0
        wide_sum = 0.0
        for d in range(-ti.min(reach, x), ti.min(reach, columns - 1 - x) + 1):
            narrow += load3(scattered, (index + d) * 6) * lens[ti.abs(d) * 2]
            wide += load3(scattered, (index + d) * 6 + 3) * lens[ti.abs(d) * 2 + 1]
            narrow_sum += lens[ti.abs(d) * 2]
            wide_sum += lens[ti.abs(d) * 2 + 1]
        for i in ti.static(range(3)):
            bloom[index * 3 + i] = 0.5 * (narrow[i] / narrow_sum + wide[i] / wide_sum)


@ti.func
def bloom_at(bloom: ti.template(), picture, x, y, columns, rows):
    """Interpolate between the middles of cells; `x` and `y` are in cells."""
    x = ti.math.clamp(x - 0.5, 0.0, ti.cast(columns - 1, ti.f32))
    y = ti.math.clamp(y - 0.5, 0.0, ti.cast(rows - 1, ti.f32))
    x0 = ti.min(ti.cast(x, ti.i32), ti.max(columns - 2, 0))
    y0 = ti.min(ti.cast(y, ti.i32), ti.max(rows - 2, 0))
    x1 = ti.min(x0 + 1, columns - 1)
    fx = x - ti.cast(x0, ti.f32)
    fy = y - ti.cast(y0, ti.f32)
    upper = (picture * rows + y0) * columns
    lower = (picture * rows + ti.min(y0 + 1, rows - 1)) * columns
    top = load3(bloom, (upper + x0) * 3) * (1.0 - fx) + load3(bloom, (upper + x1) * 3) * fx
    bottom = load3(bloom, (lower + x0) * 3) * (1.0 - fx) + load3(bloom, (lower + x1) * 3) * fx
    return top * (1.0 - fy) + bottom * fy


@ti.func
def developed(color, tones: ti.template(), curve: ti.template()):
    """The three bytes of exposed radiance, red the lowest, by the tables of `camera_response.curves`."""
    brightest = ti.math.clamp(color.max(), 0.0, BRIGHTEST)
    last = ti.cast(tones.shape[0] // 2 - 1, ti.f32)
    at = ti.cast(ti.sqrt(brightest * (1.0 / BRIGHTEST)) * last + 0.5, ti.i32) * 2
    shown = ti.math.clamp(color * tones[at] + tones[at + 1], 0.0, 1.0)
    packed = 0
    for i in ti.static(range(3)):
        place = ti.cast(ti.sqrt(shown[i]) * ti.cast(curve.shape[0] - 1, ti.f32) + 0.5, ti.i32)
        packed |= ti.cast(curve[place], ti.i32) << (8 * i)
    return packed


@ti.kernel
def expose(
    radiance: floats,
    bloom: floats,
    tones: floats,
    curve: bytes_,
    words: ints,
    rgb_at: ti.i32,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    cell: ti.i32,
    bloom_share: ti.f32,
):
    """Mix in the bloom and look the bytes up: `developed`.

    The 12 bytes of each 4 pixels make 3 of the `words` from `rgb_at` on; every picture starts a new word.
    """
    columns = (width + cell - 1) // cell
    rows = (height + cell - 1) // cell
    groups = (width * height + PIXELS_PER_GROUP - 1) // PIXELS_PER_GROUP
    for group in range(count * groups):
        picture = group // groups
        packed = ti.Vector([0, 0, 0])
        for k in ti.static(range(PIXELS_PER_GROUP)):
            pixel = (group - picture * groups) * PIXELS_PER_GROUP + k
            if pixel < width * height:
                x = (ti.cast(pixel % width, ti.f32) + 0.5) / ti.cast(cell, ti.f32)
                y = (ti.cast(pixel // width, ti.f32) + 0.5) / ti.cast(cell, ti.f32)
                color = load3(radiance, (picture * width * height + pixel) * 3) * (1.0 - bloom_share)
                color += bloom_at(bloom, picture, x, y, columns, rows) * bloom_share
                bytes_of_pixel = developed(color, tones, curve)
                for i in ti.static(range(3)):
                    packed[(k * 3 + i) // 4] |= ((bytes_of_pixel >> (8 * i)) & 255) << ((k * 3 + i) % 4 * 8)
        for i in ti.static(range(WORDS_PER_GROUP)):
            words[rgb_at + group * WORDS_PER_GROUP + i] = packed[i]


@ti.func
def bloom_lanes(bloom: ti.template(), picture, x, y, columns, rows):
    """See `bloom_at`."""
    x = smaller(larger(x - 0.5, vec16(0.0)), vec16(ti.cast(columns - 1, ti.f32)))
    y = smaller(larger(y - 0.5, vec16(0.0)), vec16(ti.cast(rows - 1, ti.f32)))
    x0 = smaller(ti.floor(x), vec16(ti.cast(ti.max(columns - 2, 0), ti.f32)))
    y0 = smaller(ti.floor(y), vec16(ti.cast(ti.max(rows - 2, 0), ti.f32)))
    fx, fy = x - x0, y - y0
    corner = (to_ints(x0) + (to_ints(y0) + picture * rows) * columns) * 3
    right, below = ti.select(columns > 1, 3, 0), ti.select(rows > 1, columns * 3, 0)
    mixed = Lanes3(x=vec16(0.0), y=vec16(0.0), z=vec16(0.0))
    for k in range(2):
        at = corner + k * below
        weight = ti.select(k == 1, fy, 1.0 - fy)
        mixed.x += (gather(bloom, at) * (1.0 - fx) + gather(bloom, at + right) * fx) * weight
        mixed.y += (gather(bloom, at + 1) * (1.0 - fx) + gather(bloom, at + right + 1) * fx) * weight
        mixed.z += (gather(bloom, at + 2) * (1.0 - fx) + gather(bloom, at + right + 2) * fx) * weight
    return mixed


@ti.kernel
def expose_lanes(
    radiance: floats,
    bloom: floats,
    tones: floats,
    curve: bytes_,
    words: ints,
    rgb_at: ti.i32,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    cell: ti.i32,
    bloom_share: ti.f32,
):
    """The same on a processor: sixteen pixels at once, one after the other in a picture's rows."""
    pixels = width * height
    columns, rows = (width + cell - 1) // cell, (height + cell - 1) // cell
    words_of_picture = (pixels + PIXELS_PER_GROUP - 1) // PIXELS_PER_GROUP * WORDS_PER_GROUP
    groups = (pixels + 15) // 16
    last_tone = ti.cast(tones.shape[0] // 2 - 1, ti.f32)
    last_step = ti.cast(curve.shape[0] - 1, ti.f32)
    for member in range(count * groups * 16):  # one thread takes 512 at least
        if member % 16 == 0:
            picture = member // 16 // groups
            begin = member - picture * groups * 16
            row = begin // width
            x, y = ints16(LANES) + (begin - row * width), ints16(row)
            for _ in range((15 + width) // width):
                y = ti.select(x >= width, y + 1, y)
                x = ti.select(x >= width, x - width, x)
            pixel = ti.select(y < height, ints16(LANES) + begin, ints16(pixels - 1)) + picture * pixels
            across = (to_floats(x) + 0.5) / ti.cast(cell, ti.f32)
            down = (to_floats(y) + 0.5) / ti.cast(cell, ti.f32)
            scattered = bloom_lanes(bloom, picture, across, down, columns, rows)
            color = Lanes3(
                x=gather(radiance, pixel * 3) * (1.0 - bloom_share) + scattered.x * bloom_share,
                y=gather(radiance, pixel * 3 + 1) * (1.0 - bloom_share) + scattered.y * bloom_share,
                z=gather(radiance, pixel * 3 + 2) * (1.0 - bloom_share) + scattered.z * bloom_share,
            )
            brightest = smaller(larger(larger(color.x, larger(color.y, color.z)), vec16(0.0)), vec16(BRIGHTEST))
            at = to_ints(ti.sqrt(brightest * (1.0 / BRIGHTEST)) * last_tone + 0.5) * 2
            factor, summand = gather(tones, at), gather(tones, at + 1)
            red, green, blue = (
                place_on_curve(color.x * factor + summand, last_step),
                place_on_curve(color.y * factor + summand, last_step),
                place_on_curve(color.z * factor + summand, last_step),
            )
            out = picture * words_of_picture + begin // PIXELS_PER_GROUP * WORDS_PER_GROUP
            for group in range(4):
                packed = ti.Vector([0, 0, 0])
                for k in ti.static(range(PIXELS_PER_GROUP)):
                    lane = group * PIXELS_PER_GROUP + k
                    places = ti.Vector([red[lane], green[lane], blue[lane]])
                    for i in ti.static(range(3)):
                        byte = ti.cast(curve[places[i]], ti.i32)
                        packed[(k * 3 + i) // 4] |= byte << ((k * 3 + i) % 4 * 8)
                if begin + group * PIXELS_PER_GROUP < pixels:
                    for i in ti.static(range(WORDS_PER_GROUP)):
                        words[rgb_at + out + group * WORDS_PER_GROUP + i] = packed[i]


@ti.func
def place_on_curve(light, last_step):
    """Where the bytes of linear sRGB are in their table."""
    return to_ints(ti.sqrt(smaller(larger(light, vec16(0.0)), vec16(1.0))) * last_step + 0.5)
