"""Light sources as flat arrays: sun and sky, and the triangles that light enters through or comes from."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, IntArray, SceneGeometry
from benchbot_sim_taichi.daylight import Daylight
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.reflectance import ALBEDO_STEPS, albedo_table
from benchbot_sim_taichi.tables import triangle_areas
from benchbot_sim_taichi.textures import srgb_to_linear

LIGHT_STRIDE = 20
SUN_ANGULAR_RADIUS_DEG = 0.2666  # mean, seen from the Earth
PORTAL_MIN_AREA_M2 = 0.01
ALBEDO_AT = 20
SKY_AT = ALBEDO_AT + ALBEDO_STEPS * ALBEDO_STEPS * 2
SKY_STEPS = 64
TEXTURE_POINTS = 16


@dataclass(frozen=True)
class LightTable:
    """`records`: corner, two edges, normal (zero: both sides), cumulated share, area in m², emission, portal flag.

    The first `portals` records are window panes, whose emission is the sky behind them; the rest are lamps, textured
    ones with each triangle's mean. Shares are of the total power, each kind for itself. `of_triangle` (T,) is each
    triangle's record, -1 where there is none.
    """

    records: FloatArray
    portals: int
    lamps: int
    of_triangle: IntArray


def environment_record(lighting: Lighting) -> FloatArray:
    """Direction to the sun, its irradiance, sky zenith, horizon and ground, cosine of the sun's radius, and two tables.

    Value 16 is 1 where the sky is a table, 17 the sun's solid angle. From `ALBEDO_AT` on: `reflectance.albedo_table`.
    From `SKY_AT` on, if there: the upper hemisphere's radiance (64 * 64 * 3) over the disc of equal areas, on whose
    points (x, y) / sqrt(1 + z) of unit directions the grid from -1 to 1 lies.
    """
    record = np.zeros(ALBEDO_AT, np.float32)
    record[0:3] = lighting.sun.direction
    record[3:6] = lighting.sun.irradiance
    cosine = math.cos(math.radians(SUN_ANGULAR_RADIUS_DEG))
    record[15] = cosine
    record[17] = 2 * math.pi * (1 - cosine)
    if not isinstance(lighting.sky, Daylight):
        record[6:9] = lighting.sky.zenith
        record[9:12] = lighting.sky.horizon
        record[12:15] = lighting.sky.ground
        return np.concatenate([record, albedo_table()])
    record[12:15] = lighting.sky.ground_radiance()
    record[16] = 1.0
    across = np.linspace(-1.0, 1.0, SKY_STEPS)
    disc = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    length = np.linalg.norm(disc, axis=1, keepdims=True)
    disc *= np.minimum(1.0, 1.0 / np.maximum(length, 1e-9))
    height = 1.0 - (disc**2).sum(axis=1)
    direction = np.column_stack([disc * np.sqrt(1.0 + height)[:, None], np.maximum(height, 0.0)])
    sky = lighting.sky.sky_radiance(direction).astype(np.float32)
    return np.concatenate([record, albedo_table(), sky.ravel()])


def light_table(scene: SceneGeometry, portal_triangles: IntArray) -> LightTable:
    """Window panes (found by the caller) and emissive triangles."""
    areas = triangle_areas(scene.vertices, scene.triangles)
    emission = _emission(scene)
    lamp_triangles = np.flatnonzero((emission.max(axis=1) > 0) & (areas > 1e-10))
    portals = _records(scene, portal_triangles, areas[portal_triangles], np.ones((len(portal_triangles), 3)))
    portals[:, 9:12] = 0.0
    portals[:, 17] = 1.0
    power = emission[lamp_triangles].mean(axis=1) * areas[lamp_triangles]
    lamps = _records(scene, lamp_triangles, power, emission[lamp_triangles])
    records = np.concatenate([portals, lamps])
    of_triangle = np.full(len(scene.triangles), -1, np.int32)
    of_triangle[portal_triangles] = np.arange(len(portals))
    of_triangle[lamp_triangles] = len(portals) + np.arange(len(lamps))
    if len(records) == 0:
        records = np.zeros((1, LIGHT_STRIDE), np.float32)
    return LightTable(records.ravel(), len(portals), len(lamps), of_triangle)


def _emission(scene: SceneGeometry) -> npt.NDArray[np.float64]:
    """(T, 3) radiance of each triangle, the mean over its texture where it has one."""
    emission = np.array([m.emission for m in scene.materials], np.float64)[scene.triangle_material]
    index = np.arange(TEXTURE_POINTS)
    u, v = (index + 0.5) / TEXTURE_POINTS, (0.5 + index * 0.6180339887498949) % 1.0
    root = np.sqrt(u)
    weight = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    for number, material in enumerate(scene.materials):
        if material.emission_image is None or not material.is_emissive:
            continue
        triangles = np.flatnonzero(scene.triangle_material == number)
        image = scene.images[material.emission_image]
        uv = np.einsum("pc,tcx->tpx", weight, scene.uvs[scene.triangles[triangles]].astype(np.float64)) % 1.0
        height, width = image.shape[:2]
        column = np.minimum((uv[..., 0] * width).astype(np.int64), width - 1)
        row = np.minimum((uv[..., 1] * height).astype(np.int64), height - 1)
        emission[triangles] *= srgb_to_linear(image[row, column, :3] / 255.0).mean(axis=1)
    return emission


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
    records[:, 0:3] = corner[:, 0]
    records[:, 3:6] = edge1
    records[:, 6:9] = edge2
    records[:, 9:12] = np.where(is_sheet(scene, triangles, normal * area[:, None])[:, None], 0.0, normal)
    records[:, 12] = np.cumsum(power / power.sum())
    records[-1, 12] = 1.0
    records[:, 13] = area
    records[:, 14:17] = emission
    return records


def is_sheet(
    scene: SceneGeometry, triangles: npt.NDArray[np.integer], oriented_area: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Return a mask of the triangles in open sheets: the oriented areas of a closed surface add up to zero."""
    instance = scene.triangle_instance[triangles]
    count = int(instance.max()) + 1
    total = np.stack([np.bincount(instance, oriented_area[:, i], count) for i in range(3)], axis=1)
    size = np.bincount(instance, np.linalg.norm(oriented_area, axis=1), count)
    is_open = np.linalg.norm(total, axis=1) > 0.1 * np.maximum(size, 1e-12)
    sheets: npt.NDArray[np.bool_] = is_open[instance]
    return sheets
