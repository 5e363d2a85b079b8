"""Pictures, depth, instance ids and laser ranges of a scene."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi import _ti, camera_response, device_scene, irradiance
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.scene import SceneGeometry

MIDDLE_GREY = 0.16
WHITE_BALANCE_STRENGTH = 0.6


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera, in pixels.

    Pixel (u, v) covers [u, u + 1) x [v, v + 1) of the continuous image plane, so its centre is at (u + 0.5, v + 0.5)
    and a centred camera has `cx = width / 2`. (ROS and OpenCV count pixel centres at integers: their cx is ours minus
    0.5.)
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def from_horizontal_fov(cls, width: int, height: int, hfov_deg: float) -> "Intrinsics":
        """Square pixels, optical axis through the centre."""
        focal = width / (2.0 * np.tan(np.radians(hfov_deg) / 2.0))
        return cls(width, height, float(focal), float(focal), width / 2.0, height / 2.0)


@dataclass(frozen=True)
class Frame:
    """All channels of one exposure, taken from the same primary hit per pixel.

    `rgb` (H, W, 3) uint8 sRGB; `depth_m` (H, W) float32 planar Z in metres (REP-118), +inf where nothing was hit;
    `instance` (H, W) int32, an `Instance.index` or 0 where nothing was hit.
    """

    rgb: npt.NDArray[np.uint8]
    depth_m: npt.NDArray[np.float32]
    instance: npt.NDArray[np.int32]


class Renderer:
    """A ray tracer bound to one scene and its lighting.

    `cache_dir` keeps compiled kernels, the tree and the indirect light between runs (None: the user's cache folder).
    Equal scene, lighting, seed and camera give equal bytes.
    """

    def __init__(
        self,
        scene: SceneGeometry,
        lighting: Lighting,
        *,
        cache_dir: Path | None = None,
        arch: str = "cpu",
        seed: int = 0,
    ) -> None:
        cache_dir = cache_dir or _ti.default_cache_dir()
        _ti.start(arch, cache_dir)
        self._buffers: dict[str, tuple[int, Any]] = {}
        self._seed = seed & 0x7FFFFFFF
        self._scene, self._lighting, self._cache_dir = scene, lighting, cache_dir
        self.device = device_scene.upload(scene, lighting, cache_dir)

    @cached_property
    def irradiance(self) -> irradiance.Irradiance:
        """The scene's indirect light, worked out (seconds) or loaded when the first picture asks for it."""
        return irradiance.load_or_solve(self._scene, self._lighting, self.device, self._cache_dir, self._seed)

    @cached_property
    def exposure(self) -> npt.NDArray[np.float64]:
        """Gain (3,) of red, green and blue that all pictures of this scene share."""
        return _exposure(self.irradiance, self._lighting.exposure)

    @cached_property
    def _cells(self) -> tuple[Any, Any, Any]:
        light = self.irradiance
        return _ti.upload(light.grid), _ti.upload(light.cells), _ti.upload(light.layout)

    def render(self, camera_to_map: npt.NDArray[np.floating], intrinsics: Intrinsics, *, rgb: bool = True) -> Frame:
        """Take one picture; `camera_to_map` is the (4, 4) pose of the optical frame (x right, y down, z forward).

        Without `rgb` the picture stays black and only depth and instances are worked out.
        """
        from benchbot_sim_taichi.kernels import filtering, illumination, primary, resolve
        from benchbot_sim_taichi.kernels.traversal import FAR

        width, height = intrinsics.width, intrinsics.height
        camera = _ti.upload(self.camera_record(camera_to_map, intrinsics, exposed=rgb))
        depth, instance = np.empty(width * height, np.float32), np.empty(width * height, np.int32)
        pixels = self._buffer("pixels", width * height * primary.PIXEL_STRIDE if rgb else 1)
        guide = self._buffer("guide", width * height * primary.GUIDE_STRIDE if rgb else 1)
        device, size = self.device, (width, height)
        primary.see(
            *device.tree, device.sheer_root, *device.surfaces, camera, pixels, guide, depth, instance, *size, int(rgb)
        )
        depth[depth >= FAR] = np.inf
        shape = (height, width)
        if not rgb:
            return Frame(np.zeros((*shape, 3), np.uint8), depth.reshape(shape), instance.reshape(shape))
        light = self._buffer("light", width * height * illumination.LIGHT_PIXEL_STRIDE)
        smooth = self._buffer("smooth", width * height * illumination.LIGHT_PIXEL_STRIDE)
        tree, cells, seed = device.tree, self._cells, self._seed
        seen = (camera, pixels, guide)
        illumination.light_indirectly(*tree, device.surfaces[0], *cells, *seen, light, *size, seed)
        illumination.light_directly(*tree, *device.lights, *seen, light, *size, seed)
        illumination.reflect(*tree, *device.surfaces, device.lights[0], *cells, camera, pixels, light, *size, seed)
        for step in (1, 4):
            filtering.smooth(camera, guide, light, smooth, *size, 0, step)
            filtering.smooth(camera, guide, smooth, light, *size, 1, step)
        radiance = self._buffer("radiance", width * height * 3)
        centers = self._buffer("centers", width * height * 3)
        resolve.shade_centers(device.lights[0], camera, pixels, light, centers, *size)
        resolve.resolve(
            *tree,
            device.sheer_root,
            *device.surfaces,
            device.lights[0],
            *cells,
            *seen,
            light,
            centers,
            radiance,
            *size,
        )
        picture = camera_response.develop(radiance, width, height)
        return Frame(picture.reshape(*shape, 3), depth.reshape(shape), instance.reshape(shape))

    def cast(
        self, origins: npt.NDArray[np.floating], directions: npt.NDArray[np.floating], range_max_m: float
    ) -> npt.NDArray[np.float32]:
        """Distances (N,) in metres along (N, 3) rays, +inf where nothing lies within `range_max_m`."""
        from benchbot_sim_taichi.kernels import primary

        start = np.asarray(origins, np.float32).reshape(-1, 3)
        along = np.asarray(directions, np.float64).reshape(-1, 3)
        length = np.linalg.norm(along, axis=1, keepdims=True)
        usable = np.isfinite(length) & (length > 0)
        along = np.divide(along, length, out=np.zeros_like(along), where=usable)
        distances = np.empty(len(start), np.float32)
        if len(start):
            primary.cast_rays(
                *self.device.tree,
                self.device.sheer_root,
                np.ascontiguousarray(start).ravel(),
                along.astype(np.float32).ravel(),
                float(range_max_m),
                distances,
                len(start),
            )
        distances[distances >= range_max_m] = np.inf
        return distances

    def camera_record(
        self, camera_to_map: npt.NDArray[np.floating], intrinsics: Intrinsics, *, exposed: bool = True
    ) -> npt.NDArray[np.float32]:
        """(19,), as kernels take it: rotation by rows, position, fx, fy, cx, cy, exposure of red, green and blue."""
        pose = np.asarray(camera_to_map, np.float64)
        lens = (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy)
        exposure = self.exposure if exposed else np.ones(3)
        return np.concatenate([pose[:3, :3].ravel(), pose[:3, 3], lens, exposure]).astype(np.float32)

    def _buffer(self, name: str, size: int) -> Any:
        """Working memory that stays between frames; it holds nothing that a frame reads before it writes."""
        if self._buffers.get(name, (0, None))[0] < size:
            self._buffers[name] = (size, _ti.upload(np.zeros(size, np.float32)))
        return self._buffers[name][1]


def _exposure(light: irradiance.Irradiance, declared: float | None) -> npt.NDArray[np.float64]:
    """Gain of red, green and blue, once for all frames so that pictures do not flicker.

    Unless declared, the scene's median radiance becomes middle grey. White balance: the mean irradiance is taken for
    white, but only partly, as a photographer leaves evening light warm.
    """
    mean, irradiance_rgb = light.mean_light()
    gain = declared or (MIDDLE_GREY / mean if mean > 0 else 1.0)
    if irradiance_rgb.min() <= 0:
        return np.full(3, gain)
    balance = (irradiance.LUMINANCE @ irradiance_rgb / irradiance_rgb) ** WHITE_BALANCE_STRENGTH
    balanced: npt.NDArray[np.float64] = gain * balance / (irradiance.LUMINANCE @ balance)
    return balanced
