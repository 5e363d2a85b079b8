"""Light sources as flat arrays: sun and sky, and the triangles that light enters through or comes from."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.scene import FloatArray, IntArray, SceneGeometry
from benchbot_sim_taichi.tables import triangle_areas

LIGHT_STRIDE = 20
SUN_ANGULAR_RADIUS_DEG = 0.2666  # mean, seen from the Earth
PORTAL_MIN_AREA_M2 = 0.01


@dataclass(frozen=True)
class LightTable:
    """`records`: corner, two edges, normal (zero: both sides), cumulated share, share over area, emission, portal flag.

    The first `portals` records are window panes, whose emission is the sky behind them; the rest are lamps. Shares
    are of the total power, each kind for itself.
    """

    records: FloatArray
    portals: int
    lamps: int


def environment_record(lighting: Lighting) -> FloatArray:
    """(20,): direction to the sun, its irradiance, sky zenith, horizon and ground, cosine of the sun's radius."""
    record = np.zeros(20, np.float32)
    record[0:3] = lighting.sun.direction
    record[3:6] = lighting.sun.irradiance
    record[6:9] = lighting.sky.zenith
    record[9:12] = lighting.sky.horizon
    record[12:15] = lighting.sky.ground
    record[15] = math.cos(math.radians(SUN_ANGULAR_RADIUS_DEG))
    return record


def light_table(scene: SceneGeometry, portal_triangles: IntArray) -> LightTable:
    """Window panes (found by the caller) and emissive triangles."""
    areas = triangle_areas(scene.vertices, scene.triangles)
    emission = np.array([m.emission for m in scene.materials], np.float64)[scene.triangle_material]
    lamp_triangles = np.flatnonzero((emission.max(axis=1) > 0) & (areas > 1e-10))
    portals = _records(scene, portal_triangles, areas[portal_triangles], np.ones((len(portal_triangles), 3)))
    portals[:, 9:12] = 0.0
    portals[:, 17] = 1.0
    power = emission[lamp_triangles].mean(axis=1) * areas[lamp_triangles]
    lamps = _records(scene, lamp_triangles, power, emission[lamp_triangles])
    records = np.concatenate([portals, lamps])
    if len(records) == 0:
        records = np.zeros((1, LIGHT_STRIDE), np.float32)
    return LightTable(records.ravel(), len(portals), len(lamps))


def _records(
    scene: SceneGeometry,
    triangles: npt.NDArray[np.integer],
    power: npt.NDArray[np.float64],
    emission: npt.NDArray[np.float64],
) -> FloatArray:
    records = np.zeros((len(triangles), LIGHT_STRIDE), np.float32)
    if len(triangles) == 0:
        return records
    corner = scene.vertices[scene.triangles[triangles]].astype(np.float64)
    edge1, edge2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    cross = np.cross(edge1, edge2)
    area = 0.5 * np.linalg.norm(cross, axis=1)
    normal = cross / (2 * area[:, None])
    share = power / power.sum()
    records[:, 0:3] = corner[:, 0]
    records[:, 3:6] = edge1
    records[:, 6:9] = edge2
    records[:, 9:12] = np.where(is_sheet(scene, triangles, normal * area[:, None])[:, None], 0.0, normal)
    records[:, 12] = np.cumsum(share)
    records[-1, 12] = 1.0
    records[:, 13] = share / area
    records[:, 14:17] = emission
    return records


def is_sheet(
    scene: SceneGeometry, triangles: npt.NDArray[np.integer], oriented_area: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Whether each triangle belongs to a sheet: the oriented areas of a closed surface add up to nothing."""
    instance = scene.triangle_instance[triangles]
    count = int(instance.max()) + 1
    total = np.stack([np.bincount(instance, oriented_area[:, i], count) for i in range(3)], axis=1)
    size = np.bincount(instance, np.linalg.norm(oriented_area, axis=1), count)
    is_open = np.linalg.norm(total, axis=1) > 0.1 * np.maximum(size, 1e-12)
    sheets: npt.NDArray[np.bool_] = is_open[instance]
    return sheets
