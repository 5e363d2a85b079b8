"""Light that belongs to surfaces: worked out once per scene and lighting, cached on disk, looked up by pictures."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchbot_scenes.scene import FloatArray, SceneGeometry
from benchbot_sim_taichi import _ti, charts, disk_cache, progress
from benchbot_sim_taichi.colorimetry import LUMINANCE
from benchbot_sim_taichi.irradiance import cache_key
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.tables import DeviceScene

VERSION = 5
NODES_AT_ONCE = 2**17
ALIKE_STEPS: tuple[int, ...] = ()
FAR_STEPS: tuple[int, ...] = (2,)
LOOSE_ROUNDS = 3


@dataclass(frozen=True)
class Lightmap:
    """`places` and `index` of `charts`, and the `light` of its nodes (two words each), as kernels read them."""

    places: Any
    index: Any
    light: Any

    @property
    def arrays(self) -> tuple[Any, Any, Any]:
        """All three, in the order in which kernels take them."""
        return self.places, self.index, self.light


Cells = tuple[Any, Any, Any]
"""Grid, cells and layout of `irradiance`, on the device."""


def load_or_bake(
    scene: SceneGeometry,
    lighting: Lighting,
    device: DeviceScene,
    cells: Cells,
    near: Any,
    cache_dir: Path,
    seed: int,
) -> Lightmap:
    """Return the light of a scene, from `cache_dir` if it was worked out before."""
    path = cache_dir / f"lightmap-{cache_key(VERSION, scene, lighting, seed)}.npz"
    names = ("places", "index", "light")

    def made() -> disk_cache.Arrays:
        baked = bake(scene, device, cells, near, seed)
        return {name: _ti.download(array) for name, array in zip(names, baked.arrays, strict=True)}

    kept = disk_cache.load_or_make(path, set(names), made)
    return Lightmap(*(_ti.upload(kept[name]) for name in names))


def bake(scene: SceneGeometry, device: DeviceScene, cells: Cells, near: Any, seed: int) -> Lightmap:
    """Find the nodes, trace rays from them, and smooth what they found."""
    from benchbot_sim_taichi.kernels import bake as kernels

    found = charts.find(scene)
    places, index = _ti.upload(found.places), _ti.upload(found.index)
    count = found.count
    light = _ti.upload(np.zeros(max(2 * count, 2), np.int32))
    if count == 0:
        return Lightmap(places, index, light)
    charted = _ti.upload(found.nodes)
    links = _ti.upload(found.first_link), _ti.upload(found.links)
    vertices, samples = _ti.upload(scene.vertices[scene.triangles].ravel()), _ti.upload(found.samples)
    raw, other = (_ti.upload(np.zeros(count * kernels.RAW_STRIDE, np.float32)) for _ in range(2))
    scene_arrays = (*device.tree, device.sheer_root, *device.surfaces, *device.lights)
    nodes = (vertices, samples, charted)
    for run in _runs(count, "the simulator lights surfaces"):
        kernels.light_directly(*scene_arrays, near, *nodes, raw, *run, seed)
    kernels.finish(raw, raw, charted, index, *links, light, count)
    kernels.find_glow(*device.surfaces, device.lights[0], *nodes, raw, other, count)
    patches = _patches(_ti.download(other)[: 3 * count].reshape(-1, 3), found.area_m2)
    for run in _runs(count, "the simulator lights surfaces by way of others"):
        kernels.gather(*scene_arrays, *cells, places, index, light, *nodes, raw, *patches, *run, seed)
    for down in (0, 1):
        kernels.smooth(raw, charted, index, other, count, down, 1, 0, 10)
        raw, other = other, raw
    for step in ALIKE_STEPS:
        for down in (0, 1):
            kernels.smooth_alike(raw, charted, index, other, count, down, step)
            raw, other = other, raw
    for _ in range(LOOSE_ROUNDS):
        kernels.smooth_loose(raw, charted, *links, other, count)
        raw, other = other, raw
    narrow = _ti.upload(_ti.download(raw).copy())
    for step in FAR_STEPS:
        for down in (0, 1):
            kernels.smooth(raw, charted, index, other, count, down, step, 6, 10)
            raw, other = other, raw
    kernels.finish(narrow, raw, charted, index, *links, light, count)
    _ti.save_kernels()
    return Lightmap(places, index, light)


def _patches(radiance: FloatArray, area_m2: FloatArray) -> tuple[Any, Any, Any, int]:
    """Return the nodes in the sun, as `kernels.bake.gather` reads them, and their number; `radiance` is (N, 3)."""
    power = (radiance @ LUMINANCE) * area_m2
    lit = np.flatnonzero(power > 0.0)
    if not len(lit):
        return _ti.upload(np.zeros(1, np.int32)), *(_ti.upload(np.zeros(3, np.float32)) for _ in range(2)), 0
    total = power[lit].sum(dtype=np.float64)
    shares = np.cumsum(power[lit], dtype=np.float64) / total
    colors = radiance[lit] * (area_m2[lit] * total / power[lit])[:, None]
    arrays = (lit.astype(np.int32), shares.astype(np.float32), colors.astype(np.float32).ravel())
    return *(_ti.upload(array) for array in arrays), len(lit)


def _runs(count: int, what: str) -> Iterator[tuple[int, int]]:
    """Yield the first node and the number of each launch, and tell how far it is, in tenths."""
    tenth = -1
    for first in range(0, count, NODES_AT_ONCE):
        if 10 * first // count > tenth:
            tenth = 10 * first // count
            progress.tell(f"{what}: {10 * tenth} % of {count:,} points")
        yield first, min(NODES_AT_ONCE, count - first)
