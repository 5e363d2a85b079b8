"""What every renderer is asked in one scene: a picture, and rays from where that picture's pixels lie."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.rays import scene as rooms
from benchmarks.rays.kernels import nearest

Floats = npt.NDArray[np.float32]
FAR_M = 1e4
OFFSET_M = 1e-3
LAMP_BELOW_M = 1e-3


@dataclass(frozen=True)
class Rays:
    """`origins` and `directions` (N, 3); shadow rays have length 1 at the lamp, all others are unit."""

    origins: Floats
    directions: Floats


@dataclass(frozen=True)
class Workload:
    """A camera and its rays, in the order of its pixels (shadow and bounce rays only where something was hit)."""

    scene: SceneGeometry
    camera: Intrinsics
    pose: npt.NDArray[np.float64]
    primary: Rays
    shadow: Rays
    bounce: Rays

    @property
    def pixels(self) -> int:
        """Pixels of the picture."""
        return self.camera.width * self.camera.height

    @property
    def small(self) -> Intrinsics:
        """The same view with a quarter of the pixels, for path tracing."""
        return Intrinsics.from_horizontal_fov(self.camera.width // 2, self.camera.height // 2, 90.0)

    @property
    def lamp(self) -> npt.NDArray[np.float64]:
        """The point (3,) that the one shadow ray of a `frame` goes to."""
        return lamp_point()


def lamp_point() -> npt.NDArray[np.float64]:
    """Just below the middle of the lamp."""
    low, high = np.array(rooms.LAMP_LOW_M), np.array(rooms.LAMP_HIGH_M)
    return np.array([*(low + high)[:2] / 2, low[2] - LAMP_BELOW_M])


def prepare(scene: SceneGeometry, renderer: Renderer, width: int, height: int, seed: int = 0) -> Workload:
    """Ask where the camera's rays land; from there one ray goes to the lamp and one anywhere (cosine-distributed)."""
    random = np.random.default_rng(seed)
    camera = Intrinsics.from_horizontal_fov(width, height, 90.0)
    pose = look((5.3, 0.7, 1.6), 139.0, -14.0)
    primary = camera_rays(pose, camera)
    hit: tuple[Floats, Any] = nearest(renderer, primary.origins, primary.directions, FAR_M)
    distance, triangle = hit
    found = triangle >= 0
    corner = scene.vertices[scene.triangles[triangle[found]]].astype(np.float64)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    facing = np.einsum("ij,ij->i", normal, primary.directions[found])
    normal *= np.where(facing > 0, -1.0, 1.0)[:, None]
    point = primary.origins[found] + primary.directions[found] * distance[found, None] + normal * OFFSET_M
    low, high = np.array(rooms.LAMP_LOW_M), np.array(rooms.LAMP_HIGH_M)
    target = random.uniform(low, high, (len(point), 3))
    target[:, 2] = low[2] - LAMP_BELOW_M
    anywhere = random.normal(size=point.shape)
    anywhere /= np.linalg.norm(anywhere, axis=1, keepdims=True)
    scattered = normal + 0.999 * anywhere  # cosine-distributed: a point of the unit sphere that the surface touches
    scattered /= np.linalg.norm(scattered, axis=1, keepdims=True)
    return Workload(scene, camera, pose, primary, _rays(point, target - point), _rays(point, scattered))


def look(position: tuple[float, float, float], yaw_deg: float, pitch_deg: float) -> npt.NDArray[np.float64]:
    """(4, 4) pose in the map frame of an optical frame (x right, y down, z forward)."""
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    forward = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = position
    return pose


def camera_rays(pose: npt.NDArray[np.float64], camera: Intrinsics) -> Rays:
    """Unit rays through the middles of the pixels, row by row."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    image = np.stack([(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, np.ones_like(row)], axis=-1)
    directions = image.reshape(-1, 3) @ pose[:3, :3].T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return _rays(np.tile(pose[:3, 3], (len(directions), 1)), directions)


def _rays(origins: npt.NDArray[np.float64], directions: npt.NDArray[np.float64]) -> Rays:
    return Rays(np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32))
