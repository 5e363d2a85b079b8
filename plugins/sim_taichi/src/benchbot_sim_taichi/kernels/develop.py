# mypy: ignore-errors
"""The last step of a picture: bloom added, tone curve, transfer function, bytes."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import floats, vec3

bytes_ = ti.types.ndarray(dtype=ti.u8, ndim=1)


@ti.kernel
def shrink(radiance: floats, small: floats, width: ti.i32, height: ti.i32, cell: ti.i32, brightest: ti.f32):
    """Means of squares of `cell` pixels, each pixel at most `brightest`."""
    columns = (width + cell - 1) // cell
    rows = (height + cell - 1) // cell
    for index in range(columns * rows):
        total = vec3(0.0)
        count = 0.0
        for k in range(cell * cell):
            x = index % columns * cell + k % cell
            y = index // columns * cell + k // cell
            if x < width and y < height:
                total += ti.min(load3(radiance, (y * width + x) * 3), brightest)
                count += 1.0
        for i in ti.static(range(3)):
            small[index * 3 + i] = total[i] / count


@ti.kernel
def expose(
    radiance: floats,
    bloom: floats,
    curve: bytes_,
    picture: bytes_,
    width: ti.i32,
    height: ti.i32,
    cell: ti.i32,
    bloom_share: ti.f32,
    brightest: ti.f32,
):
    """Mix in the bloom, interpolated, and look the bytes up: `curve` has even steps of the root of radiance."""
    columns = (width + cell - 1) // cell
    rows = (height + cell - 1) // cell
    for pixel in range(width * height):
        x = (ti.cast(pixel % width, ti.f32) + 0.5) / ti.cast(cell, ti.f32) - 0.5
        y = (ti.cast(pixel // width, ti.f32) + 0.5) / ti.cast(cell, ti.f32) - 0.5
        x = ti.math.clamp(x, 0.0, ti.cast(columns - 1, ti.f32))
        y = ti.math.clamp(y, 0.0, ti.cast(rows - 1, ti.f32))
        x0 = ti.min(ti.cast(x, ti.i32), ti.max(columns - 2, 0))
        y0 = ti.min(ti.cast(y, ti.i32), ti.max(rows - 2, 0))
        x1 = ti.min(x0 + 1, columns - 1)
        y1 = ti.min(y0 + 1, rows - 1)
        fx = x - ti.cast(x0, ti.f32)
        fy = y - ti.cast(y0, ti.f32)
        top = load3(bloom, (y0 * columns + x0) * 3) * (1.0 - fx) + load3(bloom, (y0 * columns + x1) * 3) * fx
        bottom = load3(bloom, (y1 * columns + x0) * 3) * (1.0 - fx) + load3(bloom, (y1 * columns + x1) * 3) * fx
        color = load3(radiance, pixel * 3) * (1.0 - bloom_share) + (top * (1.0 - fy) + bottom * fy) * bloom_share
        steps = ti.cast(curve.shape[0] - 1, ti.f32)
        for i in ti.static(range(3)):
            place = ti.sqrt(ti.math.clamp(color[i] / brightest, 0.0, 1.0)) * steps
            picture[pixel * 3 + i] = curve[ti.cast(place + 0.5, ti.i32)]
