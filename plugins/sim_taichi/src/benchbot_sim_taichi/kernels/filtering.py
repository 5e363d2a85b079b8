# mypy: ignore-errors
"""Edge-aware average of interleaved light samples.

First 5 taps a pixel apart, the outermost at half weight, then 3 taps four pixels apart with weights 1 2 1; each
across and then down. Either gives each class of pixels modulo 4 (then 8) the same total weight, so that where
geometry is smooth all strata of the 8x8 tile count alike: 64, or 32 where pixels share.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import locate
from benchbot_sim_taichi.kernels.illumination import GLOSSY, GLOSSY_UNSEEN, LIGHT_PIXEL_STRIDE, NO_SAMPLE, ROUGH
from benchbot_sim_taichi.kernels.neighbours import fit, pixel_plane
from benchbot_sim_taichi.kernels.primary import GUIDE_STRIDE
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, vec3


@ti.func
def tap(distance, step):
    """Weight of a tap: trapezoid 2 wide when taps are neighbours, else tent 1 wide."""
    edge = ti.select(step == 1, 2, 1)
    return ti.select(distance > edge, 0.0, ti.select(distance == edge, 0.5, 1.0))


@ti.func
def binomial(distance):
    """1 4 6 4 1, over 6."""
    return ti.select(distance == 0, 1.0, ti.select(distance == 1, 0.6666667, 0.1666667))


@ti.kernel
def smooth(
    cameras: floats,
    guide: floats,
    source: floats,
    target: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    down: ti.i32,
    step: ti.i32,
):
    """Average taps `step` apart, across or `down`: 5 when they are neighbours, else 3; the sun's share only the former.

    Reflections in rough surfaces are smoothed two taps wide in either pass, those in mirrors and panes not at all.
    """
    for pixel in range(count * width * height):
        x, y, _, eye = locate(pixel, width, height)
        out = pixel * LIGHT_PIXEL_STRIDE
        kind = source[out + 7]
        irradiance = load3(source, out)
        sun = source[out + 3]
        reflection = load3(source, out + 4)
        if guide[pixel * GUIDE_STRIDE + 3] < FAR:
            is_glossy = GLOSSY_UNSEEN <= kind <= GLOSSY
            plane = pixel_plane(cameras, eye, guide, pixel, x, y)
            irradiance_sum = vec3(0.0)
            reflection_sum = vec3(0.0)
            sun_sum = 0.0
            weight_sum = 0.0
            mirror_sum = 0.0
            extent = ti.select(is_glossy or step == 1, 2, 1)
            for k in range(-extent, extent + 1):
                dx = ti.select(down == 0, k * step, 0)
                dy = ti.select(down == 0, 0, k * step)
                if 0 <= x + dx < width and 0 <= y + dy < height:
                    other = pixel + dy * width + dx
                    alike = fit(guide, plane, dx, dy, other)
                    at = other * LIGHT_PIXEL_STRIDE
                    if alike > 0.0:
                        weight = alike * tap(ti.abs(k), step)
                        if source[at + 3] != NO_SAMPLE:
                            irradiance_sum += load3(source, at) * weight
                            sun_sum += source[at + 3] * weight
                            weight_sum += weight
                            if kind == ROUGH and source[at + 7] == ROUGH:
                                reflection_sum += load3(source, at + 4) * weight
                                mirror_sum += weight
                        if is_glossy and source[at + 7] == GLOSSY:
                            mirror = ti.select(step == 1, weight, alike * binomial(ti.abs(k)))
                            reflection_sum += load3(source, at + 4) * mirror
                            mirror_sum += mirror
            if weight_sum > 1e-6:
                irradiance = irradiance_sum / weight_sum
                sun = ti.select(step == 1, sun_sum / weight_sum, sun)
            if mirror_sum > 1e-6:
                reflection = reflection_sum / mirror_sum
                kind = ti.select(is_glossy, GLOSSY, kind)
        for i in ti.static(range(3)):
            target[out + i] = irradiance[i]
            target[out + 4 + i] = reflection[i]
        target[out + 3] = sun
        target[out + 7] = kind
