"""Light that surfaces exchange, computed once per scene and lighting and cached on disk.

Each cell of `surface_cells` sends cosine-distributed rays once and remembers which cells they met; bounces then only
follow those links, as in a Monte Carlo radiosity solution (Cohen and Wallace, "Radiosity and realistic image
synthesis", 1993).
"""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, IntArray, SceneGeometry
from benchbot_sim_taichi import _ti, disk_cache, light_grid, lightmap, surface_cells
from benchbot_sim_taichi.colorimetry import LUMINANCE
from benchbot_sim_taichi.kernels import cell_kinds
from benchbot_sim_taichi.kernels import cells as kernels
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.tables import DeviceScene

VERSION = 35
RAYS_PER_CELL = 256
POINTS_PER_CELL = 32
BOUNCES = 24
INDOORS_MAX_OPENNESS = 0.3
INDOORS_MIN_SHARE = 0.1
SMOOTHING_STEPS = (1,)
LINKS_AT_ONCE = 2**25


@dataclass(frozen=True)
class Irradiance:
    """Cells as `kernels.cells` reads them, and the grid that finds them; `near` is `light_grid`'s."""

    grid: IntArray
    cells: FloatArray
    layout: FloatArray
    near: FloatArray

    def mean_light(self) -> tuple[float, npt.NDArray[np.float64]]:
        """Median luminance that leaves surfaces, and mean irradiance (3,); indoors alone where there is an indoors."""
        values = self.cells.reshape(-1, surface_cells.CELL_STRIDE).astype(np.float64)
        exposed = values[values[:, 23] > 0.5]
        values = exposed if len(exposed) else values
        indoors = values[:, 21] < INDOORS_MAX_OPENNESS
        if indoors.mean() > INDOORS_MIN_SHARE:
            values = values[indoors]
        luminance = values[:, 15:18] @ LUMINANCE
        lit = luminance[luminance > 0.02 * luminance.mean()]  # leaves out the insides of furniture
        mean = float(np.median(lit)) if len(lit) else 0.0
        return mean, values[:, 6:9].mean(axis=0)


def load_or_solve(
    scene: SceneGeometry, lighting: Lighting, device: DeviceScene, cache_dir: Path, seed: int
) -> tuple[Irradiance, lightmap.DirectLight | None]:
    """Return the irradiance of a scene, from `cache_dir` if it was computed before; otherwise see `solve`."""
    path = path_of(scene, lighting, cache_dir, seed)
    names = {field.name for field in fields(Irradiance)}
    direct = None

    def made() -> disk_cache.Arrays:
        nonlocal direct
        solved, direct = solve(scene, device, seed)
        return asdict(solved)

    return Irradiance(**disk_cache.load_or_make(path, names, made)), direct


def path_of(scene: SceneGeometry, lighting: Lighting, cache_dir: Path, seed: int) -> Path:
    """Return the file that keeps the irradiance of a scene."""
    return cache_dir / f"irradiance-{lightmap.cache_key(VERSION, scene, lighting, seed)}.npz"


def solve(scene: SceneGeometry, device: DeviceScene, seed: int) -> tuple[Irradiance, lightmap.DirectLight | None]:
    """Find the cells, light them, link them, and let light bounce until it has settled.

    Light is sent on from nodes that lie closer together than cells, since what is beside a lamp is lit unevenly. Their
    direct light is returned too, unless there are no surfaces.
    """
    found = surface_cells.find(scene)
    near = light_grid.find(device, found.layout, *surface_cells.places(found, scene))
    if found.count == 0:
        return Irradiance(found.grid, np.zeros(surface_cells.CELL_STRIDE, np.float32), found.layout, near), None
    lights_near = _ti.upload(near)
    lit = lightmap.light_directly(scene, device, lights_near, seed)
    vertices = lit.scattered[0]
    found, values, apart = _by_kinds(found, device, vertices, seed)
    count = found.count
    cells, grid, layout = _ti.upload(values), _ti.upload(found.grid), _ti.upload(found.layout)
    samples, first = _ti.upload(found.samples), _ti.upload(found.first)
    direct = _ti.upload(np.zeros(count * 3, np.float32))
    kernels.light_cells(
        *device.tree,
        device.sheer_root,
        *device.surfaces,
        *device.lights,
        lights_near,
        vertices,
        samples,
        first,
        _ti.upload(apart),
        direct,
        cells,
        count,
        POINTS_PER_CELL,
        float(found.layout[7]),
        seed,
    )
    rays = min(RAYS_PER_CELL, max(LINKS_AT_ONCE // count, 16))
    links, tints = _ti.upload(np.zeros(count * rays, np.int32)), _ti.upload(np.zeros(count * rays, np.int32))
    gathered = _ti.upload(np.zeros(count * kernels.GATHERED_STRIDE, np.float32))
    exposed = _ti.upload(np.zeros(int(found.first[-1]), np.float32))
    kernels.link_cells(
        *device.tree,
        device.sheer_root,
        *device.surfaces,
        device.lights[0],
        device.lights[2],
        vertices,
        samples,
        first,
        grid,
        cells,
        layout,
        links,
        tints,
        exposed,
        *lit.lightmap.arrays,
        gathered,
        count,
        rays,
        seed,
    )
    before, after = _ti.upload(np.zeros(count * 3, np.float32)), _ti.upload(np.zeros(count * 3, np.float32))
    for _ in range(BOUNCES):
        kernels.bounce_cells(first, links, tints, exposed, gathered, before, after, count, rays)
        before, after = after, before
    kernels.weigh_cells(cells, gathered, count)
    for step in SMOOTHING_STEPS:
        kernels.smooth_cells(*device.tree, grid, cells, layout, before, after, _ti.upload(found.keys), count, step)
        before, after = after, before
    kernels.finish_cells(cells, direct, before, count)
    return Irradiance(found.grid, _ti.download(cells), found.layout, near), lit


def _by_kinds(
    found: surface_cells.SurfaceCells, device: DeviceScene, vertices: Any, seed: int
) -> tuple[surface_cells.SurfaceCells, FloatArray, IntArray]:
    """Split cells by the kinds of their samples; returns also their dark values, and which are set apart."""
    kinds = _ti.upload(np.zeros(int(found.first[-1]), np.int32))
    samples = _ti.upload(found.samples)
    scene_arrays = (*device.tree, device.sheer_root, *device.surfaces, device.lights[0], device.lights[2])
    cell_kinds.find_kinds(*scene_arrays, vertices, samples, kinds, int(found.first[-1]), seed)
    cell_kinds.find_sides(
        *device.tree, device.surfaces[0], vertices, samples, _ti.upload(found.first), kinds, found.count
    )
    kind_of = _ti.download(kinds)
    buried = kind_of == surface_cells.BURIED
    if not buried.all():
        # Right behind lamps, where no ray from a room gets, these are hundreds of times as bright as what is beside.
        found, kind_of = surface_cells.without(found, buried), kind_of[~buried]
    split, kind, following = surface_cells.split(found, kind_of)
    values = np.zeros((split.count, surface_cells.CELL_STRIDE), np.float32)
    values[:, 24], values[:, 25] = following, kind
    apart = (kind == surface_cells.OUTDOORS) | (np.arange(split.count) >= found.count)
    return split, values.ravel(), apart.astype(np.int32)
