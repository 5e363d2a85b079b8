"""Pictures of a scene's Gaussian splats."""

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.splats import Splats
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.frames import DeviceFrames
from benchbot_sim_taichi.intrinsics import Intrinsics, camera_records
from benchbot_sim_taichi.splat_tables import SEEN_STRIDE, SPAN_STRIDE, TILE_HEIGHT, TILE_WIDTH, splat_records

PIECES = 256
"""Splats are sorted into tiles in this many pieces: the same for any number of threads."""
MARGIN_SHARE = 0.15
"""The camera is linearised within its picture and so much of its size on each side, as 3DGS does."""
SLACK_M = 0.05
"""Changed objects count as in front of splats that are less than this before them: those may show the object itself."""
_BORDER = 33

Buffer = Callable[..., Any]


class SplatDrawing:
    """Splats where kernels read them; `buffer` gives working memory of a name, a size and a type."""

    def __init__(self, splats: Splats, buffer: Buffer) -> None:
        self._count = splats.count
        self._records = _ti.upload(splat_records(splats))
        self._buffer = buffer

    def show(
        self,
        records: npt.NDArray[np.float32],
        lenses: Sequence[Intrinsics],
        frames: DeviceFrames,
        first: int,
        changed: Collection[int],
    ) -> None:
        """Fill in the colours of pictures `first` … of `frames`, seen by cameras `records` with their lenses.

        Where there are `changed` instances, which are not as they were scanned, the frames have the colours, depths and
        instances of triangles already: changed objects stay where they are in front.
        """
        from benchbot_sim_taichi.kernels import glance, splats

        size = (frames.width, frames.height)
        pixels = frames.width * frames.height
        colors, medians = self._draw(records, lenses, size)
        if changed:
            is_changed = np.zeros(max(changed) + 1, np.int32)
            is_changed[list(changed)] = 1
            places = (frames.depth_at(first), frames.instance_at(first), frames.rgb_at(first))
            rgb_words = frames.rgb_at(1) - frames.rgb_at(0)
            shown = (frames.words, _ti.upload(is_changed), len(is_changed), SLACK_M)
            splats.put_in_front(colors, medians, *shown, *places, rgb_words, len(records), pixels)
        glance.pack(colors, frames.words, frames.rgb_at(first), len(records), pixels)

    def depth_m(self, camera_to_map: npt.NDArray[np.floating], intrinsics: Intrinsics) -> npt.NDArray[np.float32]:
        """Return planar depths (H, W) in metres behind which half of the light is gone, infinite where it never is."""
        record = camera_records(np.asarray(camera_to_map, np.float64)[None], intrinsics)[None]
        _, medians = self._draw(record, [intrinsics], (intrinsics.width, intrinsics.height))
        depth = _ti.download(medians)[: intrinsics.width * intrinsics.height]
        return depth.reshape(intrinsics.height, intrinsics.width).copy()

    def _draw(
        self, records: npt.NDArray[np.float32], lenses: Sequence[Intrinsics], size: tuple[int, int]
    ) -> tuple[Any, Any]:
        """Colours and median depths of some pictures."""
        from benchbot_sim_taichi.kernels import splats

        width, height = size
        columns, rows = -(-width // TILE_WIDTH), -(-height // TILE_HEIGHT)
        tiles = columns * rows
        cameras = _ti.upload(np.ascontiguousarray(records).ravel())
        colors = self._buffer("splat_colors", len(records) * width * height, np.int32)
        medians = self._buffer("splat_medians", len(records) * width * height)
        seen = self._buffer("splats_seen", self._count * SEEN_STRIDE)
        spans = self._buffer("splat_spans", self._count * SPAN_STRIDE, np.int32)
        keys = self._buffer("splat_keys", self._count, np.int32)
        for number in range(len(records)):
            eye = number * records.shape[1]
            bounds = _ti.upload(_bounds(lenses[number]))
            grid = (columns, rows, width, height)
            splats.project(self._records, cameras, eye, bounds, seen, spans, keys, self._count, *grid)
            lists, begins = self._tiled(keys, spans, columns, tiles)
            splats.blend(seen, lists, begins, colors, medians, number * width * height, *grid)
        return colors, medians

    def _tiled(self, keys: Any, spans: Any, columns: int, tiles: int) -> tuple[Any, Any]:
        """The splats of all tiles, nearest first in each, and where each tile's begin."""
        from benchbot_sim_taichi.kernels import splats

        order = _nearest_first(_ti.download(keys)[: self._count])
        visible = len(order)
        ranked = _ti.upload(order if visible else np.zeros(1, np.int32))
        counts = self._buffer("splat_counts", PIECES * tiles, np.int32)
        splats.count_in_tiles(ranked, spans, counts, visible, PIECES, columns, tiles)
        by_tile = _ti.download(counts)[: PIECES * tiles].reshape(PIECES, tiles).T
        ends = np.cumsum(by_tile, dtype=np.int64).reshape(tiles, PIECES)
        starts = np.ascontiguousarray((ends - by_tile).T.astype(np.int32)).ravel()
        begins = np.append(starts[:tiles], ends[-1, -1]).astype(np.int32)
        lists = self._buffer("splat_lists", max(int(begins[-1]), 1), np.int32)
        splats.fill_tiles(ranked, spans, _ti.upload(starts), lists, visible, PIECES, columns, tiles)
        return lists, _ti.upload(begins)


def _nearest_first(keys: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Indices of keys that are not 0, smallest first; the lower index first where keys are equal.

    NumPy sorts 16 bits by radix, in a fifth of the time that 32 bits take.
    """
    visible = np.flatnonzero(keys).astype(np.int32)
    found = keys[visible]
    order = np.argsort((found & 0xFFFF).astype(np.uint16), kind="stable")
    order = order[np.argsort((found >> 16).astype(np.uint16)[order], kind="stable")]
    nearest: npt.NDArray[np.int32] = visible[order]
    return nearest


def _bounds(lens: Intrinsics) -> npt.NDArray[np.float32]:
    """Left, right, top and bottom of what a camera sees at unit depth, and a margin."""
    across, down = np.linspace(0.0, lens.width, _BORDER), np.linspace(0.0, lens.height, _BORDER)
    x = np.concatenate([across, across, np.zeros_like(down), np.full_like(down, lens.width)])
    y = np.concatenate([np.zeros_like(across), np.full_like(across, lens.height), down, down])
    x, y = (x - lens.cx) / lens.fx, (y - lens.cy) / lens.fy
    if lens.distortion is not None:
        x, y = lens.distortion.undistort(x, y)
    margin_x, margin_y = MARGIN_SHARE * np.ptp(x), MARGIN_SHARE * np.ptp(y)
    edges = (x.min() - margin_x, x.max() + margin_x, y.min() - margin_y, y.max() + margin_y)
    return np.array(edges, np.float32)
