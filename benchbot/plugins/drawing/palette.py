"""The colours of all maps and pictures: roles on a light and on a dark background, object classes, and depth."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

Color = tuple[int, int, int]
Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class Palette:
    """The colours of a map by their roles.

    `paper` is what lies outside of the floor; `truth_solid` fills true objects that are drawn without an outline.
    """

    paper: Color
    floor: Color
    wall: Color
    grid: Color
    ink: Color
    faint: Color
    truth_fill: Color
    truth_line: Color
    truth_solid: Color
    path: Color
    path_start: Color
    planned: Color
    estimate: Color
    missed: Color
    extra: Color


LIGHT = Palette(
    paper=(232, 234, 236), floor=(250, 250, 249), wall=(128, 128, 122), grid=(232, 234, 237), ink=(38, 42, 48),
    faint=(128, 134, 142), truth_fill=(221, 223, 226), truth_line=(150, 155, 162), truth_solid=(190, 196, 188),
    path=(22, 66, 120),
    path_start=(140, 178, 214), planned=(168, 176, 188), estimate=(29, 90, 143), missed=(165, 42, 26),
    extra=(138, 90, 0),
)  # fmt: skip
DARK = Palette(
    paper=(18, 20, 24), floor=(40, 44, 51), wall=(176, 182, 190), grid=(57, 60, 64), ink=(231, 230, 226),
    faint=(166, 169, 173), truth_fill=(48, 51, 54), truth_line=(120, 128, 120), truth_solid=(120, 128, 120),
    path=(86, 180, 255),
    path_start=(22, 66, 120), planned=(116, 126, 142), estimate=(134, 185, 230), missed=(255, 145, 125),
    extra=(230, 180, 80),
)  # fmt: skip
ROBOT: Color = (255, 196, 0)
LASER: Color = (226, 84, 92)
UNLABELLED: Color = (46, 48, 52)
INVALID: Color = (58, 44, 48)
TRUTH_OUTLINE, ESTIMATE_OUTLINE = (255, 236, 160), (120, 215, 255)
"""Of boxes that are drawn into what a camera saw."""

SHADES = " .:-=+*#%@"
"""From dark to light, where there is no colour."""

# After Paul Tol's "muted" scheme, made for colour-blind eyes (SRON/EPS/TN/09-002, issue 3.2), light colours darkened.
PRINT_CLASSES: tuple[Color, ...] = (
    (51, 34, 136), (204, 102, 119), (17, 119, 51), (170, 68, 153), (221, 170, 51), (68, 170, 153),
    (136, 34, 85), (238, 102, 51), (0, 119, 187), (128, 128, 30), (148, 86, 44), (0, 145, 170),
)  # fmt: skip

# After the schemes "light" and "bright": they stand out on black and on white.
SCREEN_CLASSES: tuple[Color, ...] = (
    (119, 170, 221), (238, 136, 102), (221, 204, 85), (255, 140, 160), (68, 187, 153), (170, 130, 230),
    (160, 190, 50), (102, 204, 238), (204, 80, 90), (200, 160, 110), (70, 120, 200), (40, 140, 80),
    (230, 100, 190), (150, 150, 40), (130, 90, 60), (240, 180, 60), (100, 220, 130), (150, 110, 150),
    (90, 150, 160), (250, 200, 180), (180, 60, 140), (110, 110, 220), (200, 220, 160), (170, 70, 30),
)  # fmt: skip

# Viridis, which colour-blind eyes read and whose lightness alone tells the order (https://bids.github.io/colormap).
_VIRIDIS = (
    (68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141),
    (39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37),
)  # fmt: skip


@lru_cache(maxsize=1)
def ramp() -> Pixels:
    """Return the ramp of depth, uint8 (256, 3): near is bright, far is dark."""
    anchors = np.array(_VIRIDIS[::-1], float)
    places = np.linspace(0, len(anchors) - 1, 256)
    channels = [np.interp(places, np.arange(len(anchors)), anchors[:, channel]) for channel in range(3)]
    return np.stack(channels, 1).round().astype(np.uint8)


def class_colors(
    names: Iterable[str],
    colors: tuple[Color, ...] = SCREEN_CLASSES,
    neighbours: Mapping[str, Collection[str]] | None = None,
) -> dict[str, Color]:
    """Return a colour for each class: a name keeps its own as far as others leave it, whatever order they come in.

    With more classes than colours, `neighbours`, which stand next to one another, differ as far as that is possible.
    """
    found: dict[str, int] = {}
    for name in sorted(set(names)):
        own = crc32(name.encode("utf-8", "replace")) % len(colors)
        slots = [(own + step) % len(colors) for step in range(len(colors))]
        beside = [found[other] for other in (neighbours or {}).get(name, ()) if other in found]
        used = list(found.values())
        if len(set(used)) < len(colors):
            found[name] = next(slot for slot in slots if slot not in used)
        elif beside:
            found[name] = min(slots, key=lambda slot: (beside.count(slot), used.count(slot)))
        else:
            found[name] = own
    return {name: colors[slot] for name, slot in found.items()}


def between(first: Color, second: Color, share: float) -> Color:
    """Return the mix of two colours; `share` is that of the second."""
    r, g, b = (round(a + (b - a) * share) for a, b in zip(first, second, strict=True))
    return r, g, b


def to_hex(color: Color) -> str:
    """Return a colour as CSS and matplotlib write it."""
    return "#{:02x}{:02x}{:02x}".format(*color)
