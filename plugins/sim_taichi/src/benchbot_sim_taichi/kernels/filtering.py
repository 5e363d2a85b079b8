# mypy: ignore-errors
"""Edge-aware average of interleaved light samples.

First 5 taps a pixel apart, the outermost at half weight, then 3 taps four pixels apart with weights 1 2 1; each
across and then down. Either gives each class of pixels modulo 4 (then 8) the same total weight, so that where
geometry is smooth all 64 strata of the 8x8 tile count alike.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.illumination import LIGHT_PIXEL_STRIDE, MIRROR_ROUGHNESS
from benchbot_sim_taichi.kernels.primary import GUIDE_STRIDE, PIXEL_STRIDE, camera_ray
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, vec3


@ti.func
def tap(distance, reach):
    """Weight of a tap: trapezoid when `reach` is 2, tent when it is 1."""
    return ti.select(distance > reach, 0.0, ti.select(distance == reach, 0.5, 1.0))


@ti.func
def binomial(distance):
    """1 4 6 4 1, over 6."""
    return ti.select(distance == 0, 1.0, ti.select(distance == 1, 0.6666667, 0.1666667))


@ti.kernel
def smooth(
    camera: floats,
    pixels: floats,
    guide: floats,
    source: floats,
    target: floats,
    width: ti.i32,
    height: ti.i32,
    reach: ti.i32,
    step: ti.i32,
    down: ti.i32,
):
    """Average taps -`reach` … `reach`, `step` apart, across or `down`; the sun's share only when unspaced.

    Reflections in rough surfaces are smoothed two taps wide in either pass, those in mirrors and panes not at all.
    """
    for pixel in range(width * height):
        x = pixel % width
        y = pixel // width
        out = pixel * LIGHT_PIXEL_STRIDE
        t = guide[pixel * GUIDE_STRIDE + 3]
        if t >= FAR:
            for i in ti.static(range(LIGHT_PIXEL_STRIDE)):
                target[out + i] = source[out + i]
        else:
            base = pixel * PIXEL_STRIDE
            normal = load3(guide, pixel * GUIDE_STRIDE)
            face = load3(pixels, base + 4)
            is_glossy = source[out + 7] >= 0.0 and pixels[base + 14] >= FAR and pixels[base + 13] > MIRROR_ROUGHNESS
            extent = ti.select(is_glossy, 2, reach)
            # Distance from this pixel's plane: depth times a number that is linear in the picture's coordinates.
            ray = camera_ray(camera, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
            slope = face.dot(ray)
            turn = ti.select(
                down == 0,
                face.dot(vec3(camera[0], camera[3], camera[6])) / camera[12],
                face.dot(vec3(camera[1], camera[4], camera[7])) / camera[13],
            )
            tolerance = 1.0 / (0.004 + 0.004 * t)
            irradiance = vec3(0.0)
            reflection = vec3(0.0)
            sun = 0.0
            weight_sum = 0.0
            mirror_sum = 0.0
            for k in range(-extent, extent + 1):
                distance = k * step
                sx = x + ti.select(down == 0, distance, 0)
                sy = y + ti.select(down == 0, 0, distance)
                if 0 <= sx < width and 0 <= sy < height:
                    other = (sy * width + sx) * GUIDE_STRIDE
                    other_t = guide[other + 3]
                    alignment = normal.dot(load3(guide, other))
                    off = ti.abs((slope + ti.cast(distance, ti.f32) * turn) * other_t - slope * t) * tolerance
                    if other_t < FAR and alignment > 0.85 and off < 2.0:
                        fit = ti.min((alignment - 0.85) * 10.0, 1.0) * ti.min(2.0 - off, 1.0)
                        at = (sy * width + sx) * LIGHT_PIXEL_STRIDE
                        weight = fit * tap(ti.abs(k), reach)
                        irradiance += load3(source, at) * weight
                        sun += source[at + 3] * weight
                        weight_sum += weight
                        if is_glossy and source[at + 7] >= 0.0:
                            mirror = ti.select(step == 1, weight, fit * binomial(ti.abs(k)))
                            reflection += load3(source, at + 4) * mirror
                            mirror_sum += mirror
            inv = 1.0 / ti.max(weight_sum, 1e-9)
            inv_mirror = 1.0 / ti.max(mirror_sum, 1e-9)
            for i in ti.static(range(3)):
                target[out + i] = irradiance[i] * inv
                target[out + 4 + i] = ti.select(mirror_sum > 1e-6, reflection[i] * inv_mirror, source[out + 4 + i])
            target[out + 3] = ti.select(step == 1, sun * inv, source[out + 3])
            target[out + 7] = source[out + 7]
