"""Edges in pictures, on a processor: several samples for the pixels that hold more than one surface."""

from collections.abc import Callable
from typing import Any

import numpy as np

EDGES_AT_ONCE = 2**15  # 480 bytes of working memory each


def resolve(
    lit: tuple[Any, ...],
    cameras: Any,
    seen: tuple[Any, ...],
    centers: Any,
    radiance: Any,
    size: tuple[int, int, int],
    buffer: Callable[..., Any],
) -> None:
    """Fill `radiance` from `centers`, looking more closely at pixels that hold several surfaces.

    `buffer` gives working memory of a name, a size and a type.
    """
    from benchbot_sim_taichi.kernels import first_hits, packet, paint, paint_tiles
    from benchbot_sim_taichi.kernels import resolve as resolving

    guide, *mirrored = seen
    tiles = first_hits.squares(*size)
    marks = buffer("marks", tiles * packet.RAYS, np.int32)
    resolving.find_edges(centers, guide, *mirrored[::2], marks, radiance, tiles, *size[1:])
    edges = resolving.edges_of(marks[: tiles * packet.RAYS], size[0])
    for first in range(0, len(edges), EDGES_AT_ONCE):
        pixels = edges[first : first + EDGES_AT_ONCE]
        samples, tiles = len(pixels) * first_hits.SAMPLES, len(pixels) // first_hits.PIXELS_AT_ONCE
        hits = buffer("edge_hits", tiles * first_hits.HITS_STRIDE)
        strides = {"shades": paint.SHADE_STRIDE, "mirrors": paint.MIRROR_STRIDE}
        sampled = [buffer(f"edge_{name}", samples * stride) for name, stride in strides.items()]
        sampled.append(buffer("edge_kinds", samples, np.int32))
        first_hits.meet(*lit[:3], cameras, pixels, hits, tiles, *size[1:])
        unused = (centers, marks, 0, 0)
        paint_tiles.paint_tiles(*lit, cameras, pixels, hits, guide, *sampled, *unused, tiles, *size[1:])
        resolving.blend_samples(cameras, pixels, *sampled, *mirrored, centers, radiance, *size[1:])
