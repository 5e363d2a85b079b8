"""Depth and classes as pictures that people can read."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchbot.viewing import class_colors, ramp

WIDTH_PX = 640
UNKNOWN, BACKGROUND = (120, 120, 120), (58, 60, 66)


def small(image: Image.Image) -> Image.Image:
    """Return a picture, no wider than pages show it."""
    if image.width <= WIDTH_PX:
        return image
    return image.resize((WIDTH_PX, max(round(image.height * WIDTH_PX / image.width), 1)), Image.Resampling.LANCZOS)


def _stepped(array: NDArray[Any]) -> NDArray[Any]:
    step = -(-array.shape[1] // WIDTH_PX)
    return array[::step, ::step]


def depth_picture(depth: NDArray[np.float32]) -> tuple[Image.Image, float]:
    """Return a picture of depth in the colours of `ramp`, near is bright, and the depth in metres that is darkest."""
    depth = _stepped(depth)
    valid = np.isfinite(depth) & (depth > 0)
    far_m = float(np.ceil(np.percentile(depth[valid], 99))) if valid.any() else 1.0
    far_m = max(far_m, 1.0)
    levels = np.zeros(depth.shape, np.uint8)
    levels[valid] = 1 + np.clip(depth[valid] / far_m * 254, 0, 254).astype(np.uint8)
    colors = ramp().copy()
    colors[0] = (30, 30, 34)
    image = Image.fromarray(levels)
    image.putpalette(colors.tobytes())
    return image, far_m


def class_picture(numbers: NDArray[Any], classes: Mapping[str, int]) -> Image.Image:
    """Return a picture of class numbers in the colours of their names."""
    numbers = _stepped(numbers)
    colors = class_colors(classes)
    palette = np.full((256, 3), UNKNOWN, np.uint8)
    palette[0] = BACKGROUND
    for name, number in classes.items():
        if 0 <= number < 256:
            palette[number] = BACKGROUND if name == "background" else colors[name]
    image = Image.fromarray(np.clip(numbers, 0, 255).astype(np.uint8))
    image.putpalette(palette.tobytes())
    return image
