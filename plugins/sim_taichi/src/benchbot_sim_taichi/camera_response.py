"""From exposed radiance to sRGB bytes: bloom, filmic tone curve, transfer function."""

from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi import _ti

FloatArray = npt.NDArray[np.float32]

BLOOM_SHARE = 0.03
BLOOM_CELL_PIXELS = 8
BLOOM_WIDTHS = (0.012, 0.05)  # standard deviations, as shares of the picture's width
EXPOSURE_SCALE = 0.7
BRIGHTEST = 12.0  # the tone curve is white before
CURVE_STEPS = 2**14  # finer than a byte everywhere


def develop(radiance: Any, width: int, height: int) -> npt.NDArray[np.uint8]:
    """Linear sRGB radiance (3 per pixel, exposed so that 0.18 is middle grey) to sRGB bytes (3 per pixel)."""
    from benchbot_sim_taichi.kernels import develop as kernels

    rows, columns = -(-height // BLOOM_CELL_PIXELS), -(-width // BLOOM_CELL_PIXELS)
    small = np.empty(rows * columns * 3, np.float32)
    kernels.shrink(radiance, small, width, height, BLOOM_CELL_PIXELS, BRIGHTEST)
    bloom = _scatter(small.reshape(rows, columns, 3), width / BLOOM_CELL_PIXELS)
    picture = np.empty(width * height * 3, np.uint8)
    kernels.expose(
        radiance, _ti.upload(bloom.ravel()), _CURVE, picture, width, height, BLOOM_CELL_PIXELS, BLOOM_SHARE, BRIGHTEST
    )
    return picture


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


_CURVE = srgb_bytes(filmic(np.linspace(0, 1, CURVE_STEPS, dtype=np.float32) ** 2 * np.float32(BRIGHTEST)))


def _scatter(small: FloatArray, width: float) -> FloatArray:
    """Spread light as a lens does: the mean of two Gaussians, at low resolution."""
    blurred = np.zeros_like(small)
    for share in BLOOM_WIDTHS:
        sigma = max(share * width, 0.5)
        vertical, horizontal = _gaussian(small.shape[0], sigma), _gaussian(small.shape[1], sigma)
        across = np.einsum("ab,bwc->awc", vertical, small, optimize=True)
        blurred += np.einsum("dw,awc->adc", horizontal, across, optimize=True) / len(BLOOM_WIDTHS)
    return blurred


def _gaussian(cells: int, sigma: float) -> FloatArray:
    """(cells, cells) blur that keeps the sum inside the picture."""
    offset = np.arange(cells)[:, None] - np.arange(cells)[None, :]
    matrix = np.exp(-0.5 * (offset / sigma) ** 2)
    blur: FloatArray = (matrix / matrix.sum(axis=1, keepdims=True)).astype(np.float32)
    return blur
