"""Embree, asked what a camera sees."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi.renderer import Intrinsics

Seen = tuple[np.ndarray, np.ndarray]


class Embree:
    """The same scene, kept."""

    def __init__(self, scene: SceneGeometry) -> None:
        self._scene, self._device = scene, EmbreeDevice()
        self._target = EmbreeScene(self._device, robust=True)
        TriangleMesh(self._target, scene.vertices, scene.triangles)

    def see(self, pose: np.ndarray, camera: Intrinsics, shift: tuple[float, float] = (0.0, 0.0)) -> Seen:
        """Planar depth and instance of every pixel; rays have unit depth, so that distances along them are planar."""
        column, row = np.meshgrid(np.arange(camera.width) + 0.5 + shift[0], np.arange(camera.height) + 0.5 + shift[1])
        rays = np.stack([(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, np.ones_like(row)], axis=-1)
        directions = np.ascontiguousarray(rays.reshape(-1, 3) @ pose[:3, :3].T, np.float32)
        origins = np.tile(pose[:3, 3].astype(np.float32), (len(directions), 1))
        hit = self._target.run(origins, directions, output=True, dists=np.full(len(origins), 1e30, np.float32))
        found = hit["primID"] >= 0
        instance = np.where(found, self._scene.triangle_instance[hit["primID"]], 0)
        return np.where(found, hit["tfar"], np.inf).reshape(row.shape), instance.reshape(row.shape)

    def cast(self, origin: tuple[float, float, float], directions: np.ndarray) -> np.ndarray:
        """Distances (N,) from one point, +inf where there is nothing."""
        along = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
        origins = np.tile(np.array(origin, np.float32), (len(along), 1))
        hit = self._target.run(origins, along, output=True, dists=np.full(len(along), 1e30, np.float32))
        return np.where(hit["primID"] >= 0, hit["tfar"], np.inf)
