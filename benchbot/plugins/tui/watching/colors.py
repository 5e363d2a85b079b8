"""The colours of pictures and maps: a ramp for depth, one colour for each class, and those of states."""

from collections.abc import Iterable
from functools import lru_cache
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

Color = tuple[int, int, int]
Pixels = NDArray[np.uint8]

SHADES = " .:-=+*#%@"
"""From dark to light, where there is no colour."""

UNLABELLED: Color = (46, 48, 52)
INVALID: Color = (58, 44, 48)

# Viridis, which colour-blind eyes read and whose lightness alone tells the order (https://bids.github.io/colormap).
_VIRIDIS = (
    (68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141),
    (39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37),
)  # fmt: skip

# After Paul Tol's "light" and "bright" schemes (SRON/EPS/TN/09-002, issue 3.2): they stand out on black and on white.
_CLASSES: tuple[Color, ...] = (
    (119, 170, 221), (238, 136, 102), (221, 204, 85), (255, 140, 160), (68, 187, 153), (170, 130, 230),
    (160, 190, 50), (102, 204, 238), (204, 80, 90), (200, 160, 110), (70, 120, 200), (40, 140, 80),
    (230, 100, 190), (150, 150, 40), (130, 90, 60), (240, 180, 60), (100, 220, 130), (150, 110, 150),
    (90, 150, 160), (250, 200, 180), (180, 60, 140), (110, 110, 220), (200, 220, 160), (170, 70, 30),
)  # fmt: skip


@lru_cache(maxsize=1)
def ramp() -> Pixels:
    """Return the ramp of depth, uint8 (256, 3): near is bright, far is dark."""
    anchors = np.array(_VIRIDIS[::-1], float)
    places = np.linspace(0, len(anchors) - 1, 256)
    channels = [np.interp(places, np.arange(len(anchors)), anchors[:, channel]) for channel in range(3)]
    return np.stack(channels, 1).round().astype(np.uint8)


def class_colors(names: Iterable[str]) -> dict[str, Color]:
    """Return a colour for each class: a name keeps its own as far as others leave it, whatever order they come in."""
    found: dict[str, Color] = {}
    taken: set[int] = set()
    for name in sorted(set(names)):
        slot = crc32(name.encode()) % len(_CLASSES)
        if len(taken) < len(_CLASSES):
            while slot in taken:
                slot = (slot + 1) % len(_CLASSES)
            taken.add(slot)
        found[name] = _CLASSES[slot]
    return found
