"""Detection of scenes that no light enters, and lamps for them."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchbot_scenes.free_space import FreeSpace
from benchbot_scenes.scene import Instance, Material, SceneGeometry
from benchbot_scenes.slab import project_slab, rasterise
from benchbot_scenes.visibility import VOXEL_M, voxels

ROOF_M = 1.8
EYE_M = 1.05
MOST_VOXELS_A_SIDE = 400
LAMP_APART_M, LAMP_SIDE_M, LAMP_GAP_M = 3.2, 0.30, 0.05
MOST_LAMPS = 24
# About 2800 lm: radiance in units of 10,000 cd/m² on 0.09 m² (see the simulator's README, "Light").
LAMP = Material("ceiling lamp", (0.9, 0.9, 0.9), emission=(1.0, 0.9, 0.78), double_sided=True)


def roofed(geometry: SceneGeometry, space: FreeSpace) -> npt.NDArray[np.bool_]:
    """Say of each cell of a floor whether something is above it that is higher than 1.8 m."""
    high = project_slab(geometry.vertices[geometry.triangles].astype(np.float64), ROOF_M, np.inf)
    return rasterise(high, space.low_m, space.shape, space.cell_m)


def roofed_share(geometry: SceneGeometry, space: FreeSpace, region: npt.NDArray[np.bool_]) -> float:
    """The share of a region's cells that are `roofed`."""
    return float(roofed(geometry, space)[region].mean()) if region.any() else 0.0


def is_dark(geometry: SceneGeometry, start: tuple[float, float]) -> bool:
    """Return whether a scene has no light source, and no window or gap lets daylight in to the robot's start."""
    used = np.unique(geometry.triangle_material)
    if any(geometry.materials[number].is_emissive for number in used):
        return False
    return not _is_open(geometry, start)


def _is_open(geometry: SceneGeometry, start: tuple[float, float]) -> bool:
    """Return whether free space connects the robot's camera to the outside; panes of glass count as open."""
    extent = float(np.ptp(geometry.vertices, axis=0).max())
    filled = voxels(geometry, max(VOXEL_M, extent / MOST_VOXELS_A_SIDE))
    air = np.pad(filled.owner == 0, 1, constant_values=True)
    labels, _ = ndimage.label(air)
    cell = np.floor((np.array([*start, EYE_M]) - filled.low_m) / filled.size_m).astype(np.int64) + 1
    if (cell < 0).any() or (cell >= air.shape).any():
        return True
    return bool(labels[tuple(cell)] == labels[0, 0, 0])


def with_lamps(
    geometry: SceneGeometry, space: FreeSpace, region: npt.NDArray[np.bool_]
) -> tuple[SceneGeometry, tuple[str, ...]]:
    """The scene with flat lamps under its ceilings, above the free floor, and their names."""
    panels = []
    for x, y in _places(space, region):
        ceiling = _ceiling_m(geometry, x, y)
        if ceiling is not None:
            panels.append((x, y, ceiling - LAMP_GAP_M))
    if not panels:
        return geometry, ()
    half = LAMP_SIDE_M / 2
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)  # they shine downwards
    first = len(geometry.instances) + 1
    vertices = np.concatenate([corners + panel for panel in panels]).astype(np.float32)
    triangles = np.concatenate([faces + 4 * number for number in range(len(panels))]) + len(geometry.vertices)
    names = tuple(f"ceiling lamp {number + 1}" for number in range(len(panels)))
    lit = replace(
        geometry,
        vertices=np.concatenate([geometry.vertices, vertices]),
        normals=np.concatenate([geometry.normals, np.tile(np.array([0, 0, -1], np.float32), (len(vertices), 1))]),
        uvs=np.concatenate([geometry.uvs, np.zeros((len(vertices), 2), np.float32)]),
        triangles=np.concatenate([geometry.triangles, triangles.astype(np.int32)]),
        triangle_instance=np.concatenate(
            [geometry.triangle_instance, np.repeat(np.arange(first, first + len(panels), dtype=np.int32), 2)]
        ),
        triangle_material=np.concatenate(
            [geometry.triangle_material, np.full(2 * len(panels), len(geometry.materials), np.int32)]
        ),
        materials=(*geometry.materials, LAMP),
        instances=(
            *geometry.instances,
            *(Instance(first + number, name, None) for number, name in enumerate(names)),
        ),
    )
    return lit, names


def _places(space: FreeSpace, region: npt.NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Return positions for lamps: first where the clearance is largest, then wherever no lamp is near."""
    left = np.where(region, space.clearance_m, -1.0)
    cells = np.argwhere(region)
    places: list[tuple[float, float]] = []
    while len(places) < MOST_LAMPS:
        column, row = np.unravel_index(int(left.argmax()), left.shape)
        if left[column, row] < 0:
            break
        place = space.centre(int(column), int(row))
        places.append(place)
        away = np.hypot(*((cells - [column, row]) * space.cell_m).T)
        near = cells[away < LAMP_APART_M]
        left[near[:, 0], near[:, 1]] = -1.0
    return places


def _ceiling_m(geometry: SceneGeometry, x: float, y: float) -> float | None:
    """The lowest height above 1.8 m at which something lies above a place; None when nothing does."""
    corners = geometry.vertices[geometry.triangles].astype(np.float64)
    near = (corners[:, :, :2].min(axis=1) <= [x, y]).all(axis=1) & (corners[:, :, :2].max(axis=1) >= [x, y]).all(axis=1)
    first, second, third = corners[near].transpose(1, 0, 2)
    edge1, edge2, offset = second - first, third - first, np.array([x, y]) - first[:, :2]
    area = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (offset[:, 0] * edge2[:, 1] - offset[:, 1] * edge2[:, 0]) / area
        v = (edge1[:, 0] * offset[:, 1] - edge1[:, 1] * offset[:, 0]) / area
        height = first[:, 2] + u * edge1[:, 2] + v * edge2[:, 2]
    above = height[(u >= 0) & (v >= 0) & (u + v <= 1) & (height > ROOF_M)]
    return float(above.min()) if len(above) else None
