"""From radiance to sRGB bytes: exposure, white balance, bloom, tone curve, transfer function."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.colorimetry import LUMINANCE
from benchbot_sim_taichi.frames import DeviceFrames

FloatArray = npt.NDArray[np.float32]

BLOOM_SHARE = 0.02
BLOOM_BRIGHTEST = 12.0  # of what is scattered: windows do not drown their frames
BLOOM_CELL_PIXELS = 8
BLOOM_WIDTHS = (0.012, 0.05)  # standard deviations, as shares of the picture's width
BLOOM_REACH = 4  # standard deviations
BRIGHTEST = 80.0  # where the picture is white, nearly 9 stops above middle grey
CURVE_STEPS = 2**14  # finer than a byte everywhere
GREY = 0.18
CONTRAST = 1.3  # powers of radiance below middle grey, and above
SHOULDER = 0.11
KNEE = 3.0  # how sharp the bend between both is
WHITENED = (0.45, 0.85)  # from where on bright colours turn white, and how much of the way
MIDDLE_GREY = 0.16
DIM = 0.005  # 50 cd/m2: below, a picture is to look darker than by day
DIMMING = 0.25  # stops that it gets darker with each stop of light
WHITE_BALANCE_STRENGTH = 0.85
DARKEST = 5e-5  # 0.5 cd/m2, what 1/30 s at f/2 and ISO 3200 can lift to middle grey


def exposure(
    luminance: float, irradiance: npt.NDArray[np.float64], declared: float | None = None
) -> npt.NDArray[np.float64]:
    """Gain of red, green and blue (3,), once for all pictures of a scene so that they do not flicker.

    Unless `declared`, the scene's median luminance decides. White balance: the mean `irradiance` (3,) is taken for
    white, but not wholly, as cameras leave evening light warm.
    """
    gain = declared or automatic_gain(luminance)
    if irradiance.min() <= 0:
        return np.full(3, gain)
    balance = (LUMINANCE @ irradiance / irradiance) ** WHITE_BALANCE_STRENGTH
    balanced: npt.NDArray[np.float64] = gain * balance / (LUMINANCE @ balance)
    return balanced


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
    kernels.shrink(radiance, small, count, width, height, BLOOM_CELL_PIXELS, BLOOM_BRIGHTEST)
    kernels.scatter_down(small, lens, scattered, count, columns, rows, reach)
    kernels.scatter_across(scattered, lens, bloom, count, columns, rows, reach)
    size = (count, width, height)
    expose = kernels.expose if _ti.is_on_gpu() else kernels.expose_lanes
    expose(radiance, bloom, *curves(), words, rgb_at, *size, BLOOM_CELL_PIXELS, BLOOM_SHARE)


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


def tone(brightness: FloatArray) -> FloatArray:
    """Tone curve from exposed radiance to 0 … 1: a power law each for shadows and highlights, and a knee between.

    0.18 stays; a third of the range is for what is over two stops brighter, as behind windows. Powers in parts, as
    in Hable, "Filmic tonemapping with piecewise power curves", 2017; the smaller of both, made smooth.
    """
    x = np.clip(np.asarray(brightness, np.float64), 1e-9, BRIGHTEST)
    shoulder = (x / BRIGHTEST) ** SHOULDER
    grey = GREY * (1.0 - (GREY / (GREY / BRIGHTEST) ** SHOULDER) ** KNEE) ** (-1.0 / KNEE)
    shadows = grey * (x / GREY) ** CONTRAST
    curve = (shadows**-KNEE + shoulder**-KNEE) ** (-1.0 / KNEE)
    shown: FloatArray = np.minimum(curve, 1.0).astype(np.float32)
    return shown


def whitening(tones: FloatArray) -> FloatArray:
    """Return how far towards white colours go whose brightest channel is shown as `tones`."""
    first, most = WHITENED
    share = np.clip((tones - first) / (1.0 - first), 0.0, 1.0)
    whitened: FloatArray = (most * share * share * (3.0 - 2.0 * share)).astype(np.float32)
    return whitened


def filmic(radiance: FloatArray) -> FloatArray:
    """Exposed radiance (…, 3) as linear sRGB within 0 … 1.

    The curve is that of the brightest channel, whose ratios to the others stay: channels with a curve each turn sunlit
    wood yellow. Only towards white colours pale, as in film and in AgX (Sobotka, 2019).
    """
    brightest = np.maximum(radiance.max(axis=-1, keepdims=True), 1e-6)
    tones = tone(brightest)
    share = whitening(tones)
    shown: FloatArray = tones * (np.clip(radiance / brightest, 0.0, 1.0) * (1.0 - share) + share)
    return shown


def exposed(shown: FloatArray) -> FloatArray:
    """Inverse of `filmic`."""
    tones = shown.max(axis=-1, keepdims=True)
    steps = np.linspace(0.0, 1.0, CURVE_STEPS) ** 2 * BRIGHTEST
    brightest = np.interp(tones, tone(steps.astype(np.float32)), steps)
    share = whitening(tones)
    ratio = (shown / np.maximum(tones, 1e-6) - share) / (1.0 - share)
    radiance: FloatArray = (brightest * np.clip(ratio, 0.0, 1.0)).astype(np.float32)
    return radiance


def srgb_bytes(linear: FloatArray) -> npt.NDArray[np.uint8]:
    """Transfer function of IEC 61966-2-1 on values in 0 … 1."""
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)


@functools.cache
def curves() -> tuple[Any, Any]:
    """The look-up tables of `filmic` for kernels: factors and sums of colours, and bytes.

    The first has a factor and a summand (2 each) for even steps of the root of the brightest channel's radiance, to
    `BRIGHTEST`; the second bytes for even steps of the root of linear sRGB.
    """
    steps = np.linspace(0, 1, CURVE_STEPS, dtype=np.float32) ** 2
    brightest = np.maximum(steps * np.float32(BRIGHTEST), np.float32(1e-6))
    tones = tone(brightest)
    share = whitening(tones)
    factors = np.stack([tones / brightest * (1.0 - share), tones * share], axis=1)
    return _ti.upload(factors.astype(np.float32).ravel()), _ti.upload(srgb_bytes(steps))


@functools.cache
def _lens(width: int) -> tuple[Any, int]:
    """Return the glare's kernel: both Gaussians' weights by distance in cells, and the largest distance."""
    sigmas = np.maximum(np.array(BLOOM_WIDTHS) * width / BLOOM_CELL_PIXELS, 0.5)
    distance = np.arange(int(np.ceil(BLOOM_REACH * sigmas.max())) + 1)
    weights = np.exp(-0.5 * (distance[:, None] / sigmas) ** 2)
    return _ti.upload(weights.astype(np.float32).ravel()), len(distance) - 1
