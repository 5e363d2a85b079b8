"""Splats as kernels read them, and the sizes of what they keep for each."""

import numpy as np

from benchbot_scenes.splats import FloatArray, Splats, covariances

SPLAT_STRIDE = 22
SEEN_STRIDE = 13
SPAN_STRIDE = 4
TILE_WIDTH, TILE_HEIGHT = 16, 8
_AT_ONCE = 2**18


def splat_records(splats: Splats) -> FloatArray:
    """(N * 22,): position, covariance (xx, xy, xz, yy, yz, zz), opacity, colour, slopes of red, green and blue."""
    records = np.empty((splats.count, SPLAT_STRIDE), np.float32)
    records[:, 0:3] = splats.positions_m
    records[:, 9] = splats.opacities
    records[:, 10:13] = splats.colors
    records[:, 13:22] = splats.color_slopes.reshape(-1, 9)
    rows, columns = np.triu_indices(3)
    for first in range(0, splats.count, _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        records[part, 3:9] = covariances(splats.part(part))[:, rows, columns]
    return records.ravel()
