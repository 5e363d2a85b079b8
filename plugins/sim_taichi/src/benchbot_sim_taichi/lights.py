"""Light sources as flat arrays: sun and sky, and the triangles that light enters through or comes from."""

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, IntArray, SceneGeometry
from benchbot_sim_taichi import disk_cache
from benchbot_sim_taichi.exterior import panorama
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
OUTLOOK_AT = SKY_AT + SKY_STEPS * SKY_STEPS * 3
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


def environment_record(lighting: Lighting, cache_dir: Path | None = None) -> FloatArray:
    """Direction to the sun, its irradiance, ground below the horizon, cosine of the sun's radius, and tables.

    Value 16 is 1 where there are surroundings, 17 the sun's solid angle; 6 to 11 are not used. From `ALBEDO_AT` on:
    `reflectance.albedo_table`. From `SKY_AT` on: the upper hemisphere's radiance (64 * 64 * 3) over the disc of equal
    areas, on whose points (x, y) / sqrt(1 + z) of unit directions the grid from -1 to 1 lies. From `OUTLOOK_AT` on, if
    there: the panorama, as `exterior.panorama.packed` leaves it. It is kept in `cache_dir`, if given.
    """
    record = np.zeros(ALBEDO_AT, np.float32)
    record[0:3] = lighting.sun.direction
    record[3:6] = lighting.sun.irradiance
    record[12:15] = lighting.sky.ground_radiance()
    cosine = math.cos(math.radians(SUN_ANGULAR_RADIUS_DEG))
    record[15] = cosine
    record[17] = 2 * math.pi * (1 - cosine)
    if lighting.exterior.kind == "none":
        sky = lighting.sky.sky_radiance(_sky_directions()[0]).astype(np.float32)
        return np.concatenate([record, albedo_table(), sky.ravel()])
    surroundings = _surroundings(lighting, cache_dir)
    record[12:15] = surroundings["ground"]
    record[16] = 1.0
    return np.concatenate([record, albedo_table(), surroundings["sky"].ravel(), surroundings["texels"]])


def _surroundings(lighting: Lighting, cache_dir: Path | None) -> dict[str, npt.NDArray[Any]]:
    """Return the panorama's texels, and what it is on average: radiance of the ground and table of the sky."""
    named = repr((panorama.VERSION, lighting.sun, lighting.sky, lighting.exterior))
    path = None if cache_dir is None else cache_dir / f"outlook-{hashlib.sha256(named.encode()).hexdigest()[:32]}.npz"
    stored = None if path is None else disk_cache.load(path)
    if stored is not None and stored.keys() == {"ground", "sky", "texels"}:
        return stored
    radiance = panorama.paint(lighting)
    made = {
        "ground": panorama.mean_ground(radiance).astype(np.float32),
        "sky": panorama.mean_above(radiance, *_sky_directions()).astype(np.float32),
        "texels": panorama.packed(radiance),
    }
    if path is not None:
        disk_cache.store(path, made)
    return made


def _sky_directions() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the unit directions (N, 3) of the sky's table, and half the steps of their heights (N,)."""
    across = np.linspace(-1.0, 1.0, SKY_STEPS)
    disc = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    length = np.linalg.norm(disc, axis=1, keepdims=True)
    disc *= np.minimum(1.0, 1.0 / np.maximum(length, 1e-9))
    height = 1.0 - (disc**2).sum(axis=1)
    direction = np.column_stack([disc * np.sqrt(1.0 + height)[:, None], np.maximum(height, 0.0)])
    return direction, np.maximum(np.linalg.norm(disc, axis=1), 1.0 / SKY_STEPS) * 2.0 / SKY_STEPS


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
