"""Images with their mip levels, packed into one array of 32-bit texels.

A texel holds red, green and blue in ten bits each and alpha in two. Colour is stored as the square root of its linear
value, which spends the bits nearly as sRGB does and is undone by one multiplication; data (normals, roughness) is
stored as it is.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import ImageArray

IMAGE_STRIDE = 4
MAX_LEVELS = 13


@dataclass(frozen=True)
class TexelStore:
    """`texels` (N,) int32; `table` (4 per image) int32: first texel, width, height, number of levels."""

    texels: npt.NDArray[np.int32]
    table: npt.NDArray[np.int32]


def srgb_to_linear(values: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    """Inverse of the sRGB transfer function (IEC 61966-2-1) on values in 0 … 1."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def pack(images: tuple[ImageArray, ...], color_images: set[int]) -> TexelStore:
    """Pack all images; those in `color_images` are sRGB, the others data."""
    decode = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
    texels: list[npt.NDArray[np.int32]] = []
    table = np.zeros((max(len(images), 1), IMAGE_STRIDE), np.int32)
    total = 0
    for index, image in enumerate(images):
        level = image.astype(np.float32) / 255.0
        is_color = index in color_images
        if is_color:
            level[..., :3] = decode[image[..., :3]]
        height, width = level.shape[:2]
        levels = 0
        start = total
        while True:
            encoded = _encode(level, is_color)
            texels.append(encoded)
            total += len(encoded)
            levels += 1
            if level.shape[:2] == (1, 1) or levels == MAX_LEVELS:
                break
            level = _halve(level)
        table[index] = (start, width, height, levels)
    packed = np.concatenate(texels) if texels else np.zeros(1, np.int32)
    return TexelStore(packed, table.ravel())


def _halve(level: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Box-filter to half the size, odd rows and columns being repeated first."""
    height, width = level.shape[:2]
    padded = np.pad(level, ((0, height % 2 if height > 1 else 0), (0, width % 2 if width > 1 else 0), (0, 0)), "edge")
    if height > 1:
        padded = (padded[0::2] + padded[1::2]) * np.float32(0.5)
    if width > 1:
        padded = (padded[:, 0::2] + padded[:, 1::2]) * np.float32(0.5)
    return padded


def _encode(level: npt.NDArray[np.float32], is_color: bool) -> npt.NDArray[np.int32]:
    rgb = np.sqrt(level[..., :3]) if is_color else level[..., :3]
    bits = np.round(np.clip(rgb, 0, 1) * 1023).astype(np.uint32)
    alpha = np.round(np.clip(level[..., 3], 0, 1) * 3).astype(np.uint32)
    packed = bits[..., 0] | bits[..., 1] << 10 | bits[..., 2] << 20 | alpha << 30
    return packed.astype(np.uint32).view(np.int32).ravel()
