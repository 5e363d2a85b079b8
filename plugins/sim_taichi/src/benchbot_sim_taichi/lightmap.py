"""Light that belongs to surfaces: worked out once per scene and lighting, cached on disk, looked up by pictures."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchbot_scenes.scene import FloatArray, SceneGeometry
from benchbot_sim_taichi import _ti, charts, disk_cache, light_grid, progress
from benchbot_sim_taichi.colorimetry import LUMINANCE
from benchbot_sim_taichi.kernels.lightmap import LIGHT_WORDS
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.lights import LIGHT_STRIDE
from benchbot_sim_taichi.tables import DeviceScene

VERSION = 23
NODES_AT_ONCE = 2**17
ROUNDS = ((8, 5, 1), (24, 16, 0))
"""Rays and patches per node, and whether cells say what surfaces send on by way of others. The second round asks the
nodes of the first, as cells mix what lies within 10 cm: curtains, window frames and what is behind them."""
NEAR_STEPS = ((1, 0.07, 0), (2, 0.1, 1), (4, 0.05, 1))
"""How far apart nodes are averaged, how different they may be, and whether also in light (`smoothing.distinction`).
What lies behind furniture would else take light from what is seen beside it; but a node's own light is noise at first,
by which half-shadows would be torn."""
FAR_STEPS = ((2, 0.1, 0), (4, 0.1, 0))  # the same of light from afar, which changes slowly
CHANCE_STEPS = ((1, 0.1, 1), (2, 0.1, 1), (4, 0.1, 1), (8, 0.1, 1))  # of what is found by chance, and light vectors
LOOSE_ROUNDS = 3
CLUSTER_M = 0.5


@dataclass(frozen=True)
class Lightmap:
    """`places` and `index` of `charts`, and the `light` of its nodes (three words each), as kernels read them."""

    places: Any
    index: Any
    light: Any

    @property
    def arrays(self) -> tuple[Any, Any, Any]:
        """All three, in the order in which kernels take them."""
        return self.places, self.index, self.light


@dataclass(frozen=True)
class DirectLight:
    """Light straight from windows, lamps and the sun: the `lightmap` of it, and nodes as kernels read them.

    `raw` is what was found at each node (`kernels.bake`), `scattered` where nodes lie, as all kernels take it, `links`
    which of them lie beside each other. Of a scene without surfaces there are no nodes.
    """

    lightmap: Lightmap
    found: charts.Charts
    scattered: tuple[Any, Any, Any]
    links: tuple[Any, Any]
    raw: Any


Cells = tuple[Any, Any, Any]
"""Grid, cells and layout of `irradiance`, on the device."""


def load_or_bake(
    scene: SceneGeometry,
    lighting: Lighting,
    device: DeviceScene,
    cells: Cells,
    near: Any,
    direct: DirectLight | None,
    cache_dir: Path,
    seed: int,
) -> Lightmap:
    """Return the light of a scene, from `cache_dir` if it was worked out before; see `bake`."""
    path = path_of(scene, lighting, cache_dir, seed)
    names = ("places", "index", "light")

    def made() -> disk_cache.Arrays:
        baked = bake(scene, device, cells, near, direct, seed)
        return {name: _ti.download(array) for name, array in zip(names, baked.arrays, strict=True)}

    kept = disk_cache.load_or_make(path, set(names), made)
    return Lightmap(*(_ti.upload(kept[name]) for name in names))


def path_of(scene: SceneGeometry, lighting: Lighting, cache_dir: Path, seed: int) -> Path:
    """Return the file that keeps the light of a scene."""
    return cache_dir / f"lightmap-{cache_key(VERSION, scene, lighting, seed)}.npz"


def cache_key(version: int, scene: SceneGeometry, lighting: Lighting, seed: int) -> str:
    """Return a name of what is worked out from these, on the kind of device that kernels run on."""
    light = (lighting.sun, lighting.sky, lighting.exterior)
    described = repr((version, _ti.device_kind(), scene.content_hash, *light, seed))
    return hashlib.sha256(described.encode()).hexdigest()[:32]


def none(scene: SceneGeometry) -> Lightmap:
    """Return a light in which no surface of a scene is lit."""
    places = np.full((len(scene.triangles), 2, charts.PLACE_STRIDE), -1.0, np.float32)
    return Lightmap(
        _ti.upload(places.ravel()), _ti.upload(np.full(1, -1, np.int32)), _ti.upload(np.zeros(LIGHT_WORDS, np.int32))
    )


def light_directly(scene: SceneGeometry, device: DeviceScene, near: Any, seed: int) -> DirectLight:
    """Find the nodes, and the light that comes to them straight from windows, lamps and the sun."""
    from benchbot_sim_taichi.kernels import bake as kernels
    from benchbot_sim_taichi.kernels import smoothing

    found = charts.find(scene)
    count = found.count
    light = _ti.upload(np.zeros(LIGHT_WORDS * max(count, 1), np.int32))
    direct = DirectLight(
        lightmap=Lightmap(_ti.upload(found.places), _ti.upload(found.index), light),
        found=found,
        scattered=(
            _ti.upload(scene.vertices[scene.triangles].ravel()),
            _ti.upload(found.samples),
            _ti.upload(found.nodes),
        ),
        links=(_ti.upload(found.first_link), _ti.upload(found.links)),
        raw=_ti.upload(np.zeros(max(count, 1) * kernels.RAW_STRIDE, np.float32)),
    )
    scene_arrays = (*device.tree, device.sheer_root, *device.surfaces, *device.lights, device.light_of)
    for run in _runs(count, "the simulator lights surfaces"):
        kernels.light_directly(*scene_arrays, near, *direct.scattered, direct.raw, *run, seed)
    if count:
        index, charted = direct.lightmap.index, direct.scattered[2]
        smoothing.finish(direct.raw, direct.raw, charted, index, *direct.links, light, count)
    return direct


def bake(
    scene: SceneGeometry, device: DeviceScene, cells: Cells, near: Any, direct: DirectLight | None, seed: int
) -> Lightmap:
    """Add light by way of other surfaces to `direct` light, which is worked out unless given, and smooth both.

    The lightmap of `direct` is overwritten.
    """
    from benchbot_sim_taichi.kernels import glow, indirect
    from benchbot_sim_taichi.kernels.bake import RAW_STRIDE

    direct = direct or light_directly(scene, device, near, seed)
    found, nodes = direct.found, direct.scattered
    count = found.count
    if count == 0:
        return direct.lightmap
    other = _ti.upload(np.zeros(count * RAW_STRIDE, np.float32))
    scene_arrays = (*device.tree, device.sheer_root, *device.surfaces, *device.lights)
    glow.find_glow(*device.surfaces, device.lights[0], *nodes, direct.raw, other, count)
    patches = _patches(scene, device, _ti.download(cells[2]), found, _ti.download(other)[: 3 * count].reshape(-1, 3))
    for number, how in enumerate(ROUNDS, 1):
        raw = _ti.upload(_ti.download(direct.raw).copy())
        for run in _runs(count, f"the simulator lights surfaces by way of others ({number} of {len(ROUNDS)})"):
            indirect.gather(*scene_arrays, *cells, *direct.lightmap.arrays, *nodes, raw, *patches, *how, *run, seed)
        _smooth(direct, raw, other)
    _ti.save_kernels()
    return direct.lightmap


def _smooth(direct: DirectLight, raw: Any, other: Any) -> None:
    """Average the light of nodes with that of nodes beside them, and store it; both arrays are overwritten."""
    from benchbot_sim_taichi.kernels import bake as kernels
    from benchbot_sim_taichi.kernels import smoothing

    index, light, charted, links = direct.lightmap.index, direct.lightmap.light, direct.scattered[2], direct.links
    count = direct.found.count
    for how in NEAR_STEPS:
        for down in (0, 1):
            smoothing.smooth(raw, charted, index, other, count, down, *how, 0, 10)
            raw, other = other, raw
    for _ in range(LOOSE_ROUNDS):
        smoothing.smooth_loose(raw, charted, *links, other, count)
        raw, other = other, raw
    narrow = _ti.upload(_ti.download(raw).copy())
    for steps, first, last in ((FAR_STEPS, 6, 10), (CHANCE_STEPS, 12, kernels.RAW_STRIDE)):
        for how in steps:
            for down in (0, 1):
                smoothing.smooth(raw, charted, index, other, count, down, *how, first, last)
                raw, other = other, raw
    smoothing.finish(narrow, raw, charted, index, *links, light, count)


def _patches(
    scene: SceneGeometry, device: DeviceScene, layout: FloatArray, found: charts.Charts, radiance: FloatArray
) -> tuple[Any, Any, Any, Any, Any, int]:
    """Return the nodes in the sun, as `kernels.indirect.gather` reads them; `radiance` (N, 3) is what they send.

    They are gathered in clusters that are close by and face the same way. A grid as that of `light_grid`, whose lights
    the clusters are, knows which of them matter where.
    """
    power = (radiance @ LUMINANCE) * found.area_m2
    lit = np.flatnonzero(power > 0.0)
    if not len(lit):
        one = np.zeros(1, np.int32)
        floats = np.zeros(1, np.float32)
        return *(_ti.upload(array) for array in (one, one, floats, floats, floats)), 0
    positions, normals = found.places_in(scene)
    axis = np.abs(normals[lit]).argmax(axis=1)
    way = 2 * axis + (normals[lit, axis] < 0)
    key = np.column_stack([np.floor(positions[lit] / CLUSTER_M).astype(np.int64), way])
    cluster = np.unique(key, axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(cluster, kind="stable")
    lit, cluster = lit[order], cluster[order]
    first = np.searchsorted(cluster, np.arange(cluster[-1] + 2))
    total = np.add.reduceat(power[lit], first[:-1], dtype=np.float64)
    before = np.cumsum(power[lit], dtype=np.float64)
    shares = (before - (before[first[:-1]] - power[lit[first[:-1]]])[cluster]) / total[cluster]
    colors = radiance[lit] * (found.area_m2[lit] * total[cluster] / power[lit])[:, None]
    lights = _as_lamps(positions[lit], normals[lit], radiance[lit], found.area_m2[lit], power[lit], first)
    of_clusters = replace(device, lights=(device.lights[0], _ti.upload(lights.ravel()), 0, len(lights)))
    grid = light_grid.find(of_clusters, layout, positions, normals)
    arrays = (
        first.astype(np.int32),
        lit.astype(np.int32),
        shares.astype(np.float32),
        colors.astype(np.float32).ravel(),
    )
    return *(_ti.upload(array) for array in (*arrays, grid)), len(lights)


def _as_lamps(
    positions: FloatArray, normals: FloatArray, radiance: FloatArray, area_m2: FloatArray, power: Any, first: Any
) -> FloatArray:
    """Return records as of `lights.LightTable`, one for all nodes from each `first` one to the next."""
    start = first[:-1]
    weight = (power / np.repeat(np.add.reduceat(power, start), np.diff(first)))[:, None]
    middle, normal = np.add.reduceat(positions * weight, start), np.add.reduceat(normals * weight, start)
    size_m = np.sqrt(np.add.reduceat(((positions - np.repeat(middle, np.diff(first), axis=0)) ** 2) * weight, start))
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    area = np.add.reduceat(area_m2, start)
    records = np.zeros((len(start), LIGHT_STRIDE), np.float32)
    # Two edges that all of its spread is in, whichever way it lies: points on them are all that is asked of them.
    one, other = size_m * [1.0, 0.0, 1.0], size_m * [0.0, 1.0, -1.0]
    records[:, 0:3] = middle - (one + other) / 2
    records[:, 3:6], records[:, 6:9], records[:, 9:12] = one, other, normal
    records[:, 12] = np.cumsum(np.add.reduceat(power, start)) / power.sum()
    records[-1, 12] = 1.0
    records[:, 13] = area
    records[:, 14:17] = np.add.reduceat(radiance * area_m2[:, None], start) / area[:, None]
    return records


def _runs(count: int, what: str) -> Iterator[tuple[int, int]]:
    """Yield the first node and the number of each launch, and tell how far it is, in tenths."""
    tenth = -1
    for first in range(0, count, NODES_AT_ONCE):
        if 10 * first // count > tenth:
            tenth = 10 * first // count
            progress.tell(f"{what}: {10 * tenth} % of {count:,} points")
        yield first, min(NODES_AT_ONCE, count - first)
