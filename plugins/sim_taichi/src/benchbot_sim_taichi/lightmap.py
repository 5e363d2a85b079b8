"""Light that belongs to surfaces: worked out once per scene and lighting, cached on disk, looked up by pictures."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import _ti, charts, disk_cache
from benchbot_sim_taichi.tables import DeviceScene

VERSION = 3
NODES_AT_ONCE = 2**17
ALIKE_STEPS = (4, 8)
FAR_STEPS = (4, 8, 16)
LOOSE_ROUNDS = 3
KINDS = ("places", "index", "light")


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


def load_or_bake(
    scene: SceneGeometry,
    device: DeviceScene,
    near: Any,
    cells: tuple[Any, Any, Any],
    key: str,
    cache_dir: Path,
    seed: int,
) -> Lightmap:
    """Return the light of a scene, from `cache_dir` if it was worked out before with the same `key`."""
    name = hashlib.sha256(repr((VERSION, scene.content_hash, key, seed)).encode()).hexdigest()
    path = cache_dir / f"lightmap-{name[:32]}.npz"
    stored = disk_cache.load(path)
    if stored is not None and stored.keys() == set(KINDS):
        return Lightmap(*(_ti.upload(stored[kind]) for kind in KINDS))
    baked = bake(scene, device, near, cells, seed)
    disk_cache.store(path, {kind: _ti.download(array) for kind, array in zip(KINDS, baked.arrays, strict=True)})
    return baked


def bake(scene: SceneGeometry, device: DeviceScene, near: Any, cells: tuple[Any, Any, Any], seed: int) -> Lightmap:
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
    chosen = _ti.upload(np.arange(count, dtype=np.int32))
    raw, other = (_ti.upload(np.zeros(count * kernels.RAW_STRIDE, np.float32)) for _ in range(2))
    scene_arrays = (*device.tree, device.sheer_root, *device.surfaces, *device.lights)
    nodes = (vertices, samples, charted, chosen)
    runs = [(first, min(NODES_AT_ONCE, count - first), seed) for first in range(0, count, NODES_AT_ONCE)]
    for run in runs:
        kernels.light_directly(*scene_arrays, near, *nodes, raw, *run)
    kernels.finish(raw, raw, charted, index, *links, light, count)
    for run in runs:
        kernels.gather(*scene_arrays, *cells, places, index, light, *nodes, raw, *run)
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
    return Lightmap(places, index, light)
