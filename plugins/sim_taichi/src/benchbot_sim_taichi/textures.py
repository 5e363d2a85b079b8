"""Images with their mip levels, packed into one array of 32-bit texels.

A texel holds red, green and blue in ten bits each and alpha in two. Colour is stored as the square root of its linear
value, which spends the bits nearly as sRGB does and is undone by one multiplication; data (normals, roughness) is
stored as it is.
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import ImageArray

IMAGE_STRIDE = 4
MAX_LEVELS = 13
ALPHA = 3
FILTER_WIDTH = 0.7
"""Width of a texel of the level that is sampled, of a ray's: bilinear weights reach over two texels."""


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
    plain = np.arange(256, dtype=np.float32) / np.float32(255.0)
    linear = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
    texels: list[npt.NDArray[np.int32]] = []
    table = np.zeros((max(len(images), 1), IMAGE_STRIDE), np.int32)
    total = 0
    for index, image in enumerate(images):
        is_color = index in color_images
        of_byte = [linear if is_color else plain] * 3 + [plain]
        planes = np.ascontiguousarray(image.transpose(2, 0, 1))
        # Three of four texels are of the first level, whose values are those of a byte.
        codes = [_code(values, channel, is_color) for channel, values in enumerate(of_byte)]
        encoded = reduce(np.bitwise_or, (code[plane] for code, plane in zip(codes, planes, strict=True)))
        level = [values[plane] for values, plane in zip(of_byte, planes, strict=True)]
        levels, start = 1, total
        while True:
            texels.append(encoded.view(np.int32).ravel())
            total += encoded.size
            if encoded.shape == (1, 1) or levels == MAX_LEVELS:
                break
            level = [_halve(plane) for plane in level]
            encoded = reduce(np.bitwise_or, (_code(plane, channel, is_color) for channel, plane in enumerate(level)))
            levels += 1
        height, width = image.shape[:2]
        table[index] = (start, width, height, levels)
    packed = np.concatenate(texels) if texels else np.zeros(1, np.int32)
    return TexelStore(packed, table.ravel())


def _halve(plane: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Box-filter one channel to half the size, odd rows and columns being repeated first."""
    height, width = plane.shape
    if height > 1:
        plane = np.concatenate([plane, plane[-1:]]) if height % 2 else plane
        plane = (plane[0::2] + plane[1::2]) * np.float32(0.5)
    if width > 1:
        plane = np.concatenate([plane, plane[:, -1:]], axis=1) if width % 2 else plane
        plane = (plane[:, 0::2] + plane[:, 1::2]) * np.float32(0.5)
    return plane


def _code(values: npt.NDArray[np.float32], channel: int, is_color: bool) -> npt.NDArray[np.uint32]:
    """Return the bits that values, 0 … 1, of red, green, blue or alpha have in a texel."""
    bits = np.sqrt(values) if is_color and channel < ALPHA else values
    steps = np.rint(bits * np.float32(3 if channel == ALPHA else 1023)).astype(np.uint32)
    return steps << np.uint32(10 * channel)
