"""Noise and colour arithmetic; every field repeats without a seam."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, spatial

Field = NDArray[np.float64]
Color = tuple[float, float, float]


def hex_color(code: str) -> Color:
    """sRGB in 0–1 of a web colour such as `#c8a27a`."""
    red, green, blue = (int(code[start : start + 2], 16) / 255.0 for start in (1, 3, 5))
    return red, green, blue


def linear_color(code: str) -> Color:
    """Return linear sRGB in 0–1 of a web colour (IEC 61966-2-1), as in material factors."""
    red, green, blue = (
        channel / 12.92 if channel <= 0.04045 else ((channel + 0.055) / 1.055) ** 2.4 for channel in hex_color(code)
    )
    return red, green, blue


def cloud(
    shape: tuple[int, int], rng: np.random.Generator, feature_px: tuple[float, float], roughness: float = 0.0
) -> Field:
    """Gaussian noise (H, W) of zero mean and unit variance with features of `feature_px` (rows, columns).

    `roughness` from 0 (one size of feature) to 1 (as much detail at each octave below it).
    """
    spectrum = np.fft.rfft2(rng.standard_normal(shape))
    rows = np.fft.fftfreq(shape[0])[:, None] * feature_px[0]
    columns = np.fft.rfftfreq(shape[1])[None, :] * feature_px[1]
    radius = np.hypot(rows, columns)
    envelope = np.exp(-((radius * 1.6) ** 2)) + roughness * (1.0 + (radius * 1.6) ** 2) ** -1.1
    envelope[0, 0] = 0.0
    field = np.fft.irfft2(spectrum * envelope, s=shape)
    return np.asarray(field / field.std(), dtype=np.float64)


def blur(field: Field, sigma_px: float | tuple[float, float]) -> Field:
    """Gaussian blur across the seams."""
    return np.asarray(ndimage.gaussian_filter(field, sigma_px, mode="wrap"), dtype=np.float64)


def cells(shape: tuple[int, int], points: Field) -> tuple[Field, NDArray[np.intp]]:
    """Distance in pixels to the nearest of the points (N, 2: row, column), and which one it is."""
    tree = spatial.cKDTree(points, boxsize=shape)
    grid = np.moveaxis(np.indices(shape, dtype=np.float64), 0, -1)
    distance, index = tree.query(grid)
    return np.asarray(distance, dtype=np.float64), np.asarray(index, dtype=np.intp)


def smoothstep(low: float, high: float, value: Field) -> Field:
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t), dtype=np.float64)


def gradient(value: Field, stops: Sequence[tuple[float, Color]]) -> Field:
    """Colors (…, 3) of the values between the stops."""
    positions = [position for position, _ in stops]
    return np.stack([np.interp(value, positions, [color[k] for _, color in stops]) for k in range(3)], axis=-1)


def mix(below: Field | Color, above: Field | Color, weight: Field) -> Field:
    """`below` where the weight is 0, `above` where it is 1."""
    lower, upper = np.asarray(below), np.asarray(above)
    return np.asarray(lower + (upper - lower) * weight[..., None], dtype=np.float64)
