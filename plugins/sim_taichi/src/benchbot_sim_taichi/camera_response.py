"""From radiance to sRGB bytes: exposure, bloom, filmic tone curve, transfer function."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.frames import DeviceFrames

FloatArray = npt.NDArray[np.float32]

BLOOM_SHARE = 0.03
BLOOM_CELL_PIXELS = 8
BLOOM_WIDTHS = (0.012, 0.05)  # standard deviations, as shares of the picture's width
BLOOM_REACH = 4  # standard deviations
EXPOSURE_SCALE = 0.7
BRIGHTEST = 12.0  # the tone curve is white before
CURVE_STEPS = 2**14  # finer than a byte everywhere
MIDDLE_GREY = 0.16
DIM = 0.005  # 50 cd/m2: below, a picture is to look darker than by day
DIMMING = 0.25  # stops that it gets darker with each stop of light
DARKEST = 5e-5  # 0.5 cd/m2, what 1/30 s at f/2 and ISO 3200 can lift to middle grey


def automatic_gain(luminance: float) -> float:
    """Exposure of a scene of this median luminance (one unit is 10,000 cd/m2).

    Middle grey in any daylight; below `DIM` less, for night to look like night, as the eye's key falls with
    luminance (Krawczyk, Myszkowski and Seidel, "Lightness perception in tone reproduction", 2005); no more than a real
    camera's longest exposure.
    """
    if luminance <= 0.0:
        return MIDDLE_GREY / DARKEST
    dimmed: float = min(luminance / DIM, 1.0) ** DIMMING
    return MIDDLE_GREY * dimmed / max(luminance, DARKEST)


def develop(
    radiance: Any, words: Any, rgb_at: int, count: int, width: int, height: int, buffer: Callable[[str, int], Any]
) -> None:
    """Linear sRGB radiance (3 per pixel, exposed so that 0.18 is middle grey) to sRGB bytes in `words`.

    See `frames.DeviceFrames` for their order. `buffer` gives working memory of a name and a size.
    """
    from benchbot_sim_taichi.kernels import develop as kernels

    rows, columns = -(-height // BLOOM_CELL_PIXELS), -(-width // BLOOM_CELL_PIXELS)
    cells = count * rows * columns
    small, scattered, bloom = buffer("small", cells * 3), buffer("scattered", cells * 6), buffer("bloom", cells * 3)
    lens, reach = _lens(width)
    kernels.shrink(radiance, small, count, width, height, BLOOM_CELL_PIXELS, BRIGHTEST)
    kernels.scatter_down(small, lens, scattered, count, columns, rows, reach)
    kernels.scatter_across(scattered, lens, bloom, count, columns, rows, reach)
    size = (count, width, height)
    kernels.expose(radiance, bloom, curve(), words, rgb_at, *size, BLOOM_CELL_PIXELS, BLOOM_SHARE, BRIGHTEST)


def develop_on_host(radiance: FloatArray) -> npt.NDArray[np.uint8]:
    """(H, W, 3) sRGB bytes of one picture's (H, W, 3) radiance, as `path_trace` gives it."""
    height, width = radiance.shape[:2]
    frames = DeviceFrames.allocate(1, width, height, has_rgb=True)
    develop(
        _ti.upload(radiance.astype(np.float32).ravel()),
        frames.words,
        frames.rgb_at(0),
        1,
        width,
        height,
        lambda _, size: _ti.upload(np.zeros(size, np.float32)),
    )
    return frames.to_host()[0].rgb


def filmic(radiance: FloatArray) -> FloatArray:
    """Tone curve with toe and shoulder; 0.18 stays near 0.18.

    Narkowicz's fit of ACES ("ACES filmic tone mapping curve", 2015).
    """
    x = radiance * np.float32(EXPOSURE_SCALE)
    curve = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
    return np.clip(curve, 0.0, 1.0).astype(np.float32)


def srgb_bytes(linear: FloatArray) -> npt.NDArray[np.uint8]:
    """Transfer function of IEC 61966-2-1 on values in 0 … 1."""
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)


@functools.cache
def curve() -> Any:
    """Bytes for even steps of the root of radiance, from black to `BRIGHTEST`."""
    return _ti.upload(srgb_bytes(filmic(np.linspace(0, 1, CURVE_STEPS, dtype=np.float32) ** 2 * np.float32(BRIGHTEST))))


@functools.cache
def _lens(width: int) -> tuple[Any, int]:
    """Return the glare's kernel: both Gaussians' weights by distance in cells, and the largest distance."""
    sigmas = np.maximum(np.array(BLOOM_WIDTHS) * width / BLOOM_CELL_PIXELS, 0.5)
    distance = np.arange(int(np.ceil(BLOOM_REACH * sigmas.max())) + 1)
    weights = np.exp(-0.5 * (distance[:, None] / sigmas) ** 2)
    return _ti.upload(weights.astype(np.float32).ravel()), len(distance) - 1
