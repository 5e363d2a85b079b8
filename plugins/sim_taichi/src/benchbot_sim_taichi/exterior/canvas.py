"""A panorama to paint on, the light of what is painted, and noise."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating]

COLUMNS = 3600
TEXEL = 2 * math.pi / COLUMNS
NOISE_STEPS = 256


@dataclass(frozen=True)
class Light:
    """Sun, irradiance (N, 3) of upright surfaces by azimuth, (3,) of level ones by the sky, and 1 by night."""

    sun: Array
    sun_irradiance: Array
    sides: Array
    above: Array
    night: float

    def on(self, normal: Array) -> Array:
        """(…, 3) irradiance over pi of surfaces with unit normals (…, 3), of what is around and of the sun."""
        turn = np.arctan2(normal[..., 1], normal[..., 0]) / (2 * math.pi) * len(self.sides)
        left = np.floor(turn).astype(int)
        share = (turn - left)[..., None]
        side = self.sides[left % len(self.sides)] * (1 - share) + self.sides[(left + 1) % len(self.sides)] * share
        up = np.clip(normal[..., 2:], 0.0, 1.0)
        around = side * (1 - up) + self.above * up
        sunlit = self.sun_irradiance * np.clip(normal @ self.sun, 0.0, 1.0)[..., None]
        total: Array = (around + sunlit) / math.pi
        return total


@dataclass(frozen=True)
class Canvas:
    """A panorama that things are painted on; `slope` is the tangent of each row's elevation.

    `horizon` (COLUMNS, 3) is the colour of haze, `haze` its extinction per metre.
    """

    radiance: npt.NDArray[np.float32]
    slope: Array
    eye_m: float
    horizon: Array
    haze: float
    noise: Array

    @property
    def azimuth(self) -> Array:
        """Of the middle of each column."""
        middles: Array = ((np.arange(COLUMNS) + 0.5) * TEXEL).astype(np.float32)
        return middles

    def hazy(
        self, radiance: Array, distance_m: Array | float, columns: npt.NDArray[np.integer] | slice = slice(None)
    ) -> Array:
        """Radiance (…, columns, 3) through the air of a distance."""
        passed = np.exp(-self.haze * np.asarray(distance_m, np.float32))[..., None]
        seen: Array = radiance * passed + self.horizon[columns] * (1.0 - passed)
        return seen

    def rows(self, low_m: float, high_m: float, nearest_m: float, farthest_m: float) -> slice:
        """Rows that show heights above the ground between two distances."""
        slopes = [(height - self.eye_m) / at for height in (low_m, high_m) for at in (nearest_m, farthest_m)]
        first, last = np.searchsorted(self.slope, [min(slopes), max(slopes)])
        return slice(max(int(first) - 1, 0), min(int(last) + 1, len(self.slope)))

    def blend(self, rows: slice, columns: npt.NDArray[np.integer], color: Array, cover: Array) -> None:
        """Put `color` (rows, columns, 3) over what is there, as much as `cover` (rows, columns) says."""
        there = self.radiance[rows, columns]
        self.radiance[rows, columns] = there + cover[..., None].astype(np.float32) * (color - there)


def columns_around(azimuth: float, half_angle: float) -> npt.NDArray[np.integer]:
    """Columns whose middles lie so close to an azimuth."""
    first = math.floor((azimuth - half_angle) / TEXEL)
    return np.arange(first, math.ceil((azimuth + half_angle) / TEXEL) + 1) % COLUMNS


def pulse(offset: Array, width: float, texel: Array | float) -> Array:
    """Share of a texel of the size `texel` at `offset` that a stripe of a width takes."""
    share: Array = np.clip((0.5 * width - np.abs(offset)) / texel + 0.5, 0.0, 1.0)
    return share


def softened(offset: Array, width: float, texel: Array, pitch: float) -> Array:
    """Like `pulse`, of stripes that repeat, whose mean is what large texels show."""
    mean = np.clip(texel / pitch - 0.25, 0.0, 1.0)
    share: Array = pulse(offset, width, texel) * (1.0 - mean) + mean * width / pitch
    return share


def hashed(number: npt.NDArray[np.integer]) -> Array:
    """Even chances 0 … 1 of integers."""
    mixed = number.astype(np.uint32) * np.uint32(2654435761)
    mixed ^= mixed >> np.uint32(15)
    mixed *= np.uint32(2246822519)
    mixed ^= mixed >> np.uint32(13)
    return mixed.astype(np.float64) / 2.0**32


def noise_image(random: np.random.Generator) -> Array:
    """(256, 256) even chances, the values of value noise."""
    return random.random((NOISE_STEPS, NOISE_STEPS), dtype=np.float32)


def sample(noise: Array, x: Array, y: Array) -> Array:
    """Value noise at places, interpolated smoothly and repeating."""
    x, y = np.broadcast_arrays(np.asarray(x, np.float32), np.asarray(y, np.float32))
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = x - x0, y - y0
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    left, low = x0.astype(np.int64) & (NOISE_STEPS - 1), y0.astype(np.int64) & (NOISE_STEPS - 1)
    right, high = (left + 1) & (NOISE_STEPS - 1), (low + 1) & (NOISE_STEPS - 1)
    bottom = noise[low, left] * (1 - fx) + noise[low, right] * fx
    top = noise[high, left] * (1 - fx) + noise[high, right] * fx
    value: Array = bottom * (1 - fy) + top * fy
    return value


def stretched(image: Array, rows: Array, columns: Array) -> Array:
    """Interpolate an image (H, W, 3) at rows and columns, which repeat."""
    low = np.clip(np.floor(rows).astype(int), 0, len(image) - 2)
    part = np.clip(rows - low, 0, 1).astype(np.float32)[:, None, None]
    tall = image[low] * (1 - part) + image[low + 1] * part
    left = np.floor(columns).astype(int)
    part = (columns - left).astype(np.float32)[None, :, None]
    width = image.shape[1]
    wide: Array = tall[:, left % width] * (1 - part) + tall[:, (left + 1) % width] * part
    return wide


def smoothstep(low: float, high: float, value: Array) -> Array:
    """0 below, 1 above, smooth between."""
    share = np.clip((value - low) / (high - low), 0.0, 1.0)
    smooth: Array = share * share * (3 - 2 * share)
    return smooth
