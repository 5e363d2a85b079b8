"""Splats of a scene that stand for a scan of it: made from pictures that the ray tracer takes, without training.

Pixels go back to where they were seen, and all of one cell of space become one Gaussian: their mean place and colour,
flat along the surface. What a trained scan has besides, colours that change with the view and transparent blur, these
have not.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.splats import FloatArray, Splats
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.scenes.tests.importing.trained import FLATNESS, SPREAD, facing

OPACITY = 0.95
STEEPEST = 0.1
"""Cosine below which a surface is seen too flat to be of use."""


@dataclass(frozen=True)
class Scan:
    """Points (N, 3) that were seen, with normals towards the camera and display-referred colours."""

    points_m: FloatArray
    normals: FloatArray
    colors: FloatArray


def scan(renderer: Renderer, poses: npt.NDArray[np.floating], lens: Intrinsics) -> Scan:
    """Return what the cameras (N, 4, 4) see."""
    return Scan(*(np.concatenate(part) for part in zip(*(_seen(renderer, pose, lens) for pose in poses), strict=True)))


def splats_of(seen: Scan, cell_m: float) -> Splats:
    """Return one Gaussian for each cell of `cell_m` in which anything was seen."""
    points, normals, colors = seen.points_m, seen.normals, seen.colors
    cells = np.floor(points / cell_m).astype(np.int64) + 2**20
    keys = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    _, cell = np.unique(keys, return_inverse=True)
    count = np.bincount(cell)

    def mean(values: FloatArray) -> npt.NDArray[np.float64]:
        return np.stack([np.bincount(cell, values[:, axis]) for axis in range(3)], axis=1) / count[:, None]

    mean_normals = mean(normals)
    mean_normals /= np.maximum(np.linalg.norm(mean_normals, axis=1, keepdims=True), 1e-9)
    sizes = np.array([1.0, 1.0, FLATNESS]) * SPREAD * cell_m
    return Splats(
        positions_m=mean(points).astype(np.float32),
        rotations=facing(mean_normals).astype(np.float32),
        scales_m=np.tile(sizes, (len(count), 1)).astype(np.float32),
        opacities=np.full(len(count), OPACITY, np.float32),
        colors=mean(colors).astype(np.float32),
        color_slopes=np.zeros((len(count), 3, 3), np.float32),
    )


def around(pose: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    """(12, 4, 4) optical frames at the place of a level one: all around, level, up and down."""
    turns = []
    for yaw in np.radians([0.0, 90.0, 180.0, 270.0]):
        for pitch in np.radians([0.0, 45.0, -45.0]):
            across = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
            up = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
            turns.append(across @ up)
    frames = np.tile(np.asarray(pose, np.float64), (len(turns), 1, 1))
    frames[:, :3, :3] = pose[:3, :3] @ np.stack(turns)
    return frames


def _seen(
    renderer: Renderer, pose: npt.NDArray[np.floating], lens: Intrinsics
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points, normals towards the camera, and colours of a picture's pixels."""
    frame = renderer.render(pose, lens)
    column, row = np.meshgrid(np.arange(lens.width) + 0.5, np.arange(lens.height) + 0.5)
    rays = np.stack([(column - lens.cx) / lens.fx, (row - lens.cy) / lens.fy, np.ones_like(row)], axis=-1)
    with np.errstate(invalid="ignore"):
        points = (rays * frame.depth_m[..., None]) @ pose[:3, :3].T + pose[:3, 3]
        normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        along = rays @ pose[:3, :3].T
        cosine = (normals * along).sum(axis=-1) / np.linalg.norm(along, axis=-1)
        is_seen = np.isfinite(frame.depth_m) & (np.abs(cosine) > STEEPEST)
    normals = -normals * np.sign(cosine)[..., None]
    return (
        points[is_seen].astype(np.float32),
        normals[is_seen].astype(np.float32),
        (frame.rgb[is_seen] / 255.0).astype(np.float32),
    )
