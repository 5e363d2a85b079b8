"""Pictures, depth, instance ids and laser ranges of a scene."""

import copy
import math
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from benchbot.plugin import cache_dir as users_cache_dir
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import (
    _ti,
    arrangement,
    camera_response,
    device_scene,
    edges,
    irradiance,
    lamps,
    light_grid,
    light_process,
    lightmap,
    parting,
    path_trace,
)
from benchbot_sim_taichi.frames import DeviceFrames, Frame, FrameBatch
from benchbot_sim_taichi.intrinsics import Intrinsics, camera_records, common_size
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import FAST, REALTIME, Quality
from benchbot_sim_taichi.splats import SplatDrawing
from benchbot_sim_taichi.tables import CAMERA_STRIDE

__all__ = ["DeviceFrames", "Frame", "FrameBatch", "Intrinsics", "Renderer"]

PIXELS_AT_ONCE = 2**20  # 240 bytes of working memory each, 292 on a GPU
GLANCED_PIXELS_AT_ONCE = 2**24  # 4 bytes each


class Renderer:
    """A ray tracer bound to one scene and its lighting.

    `cache_dir` keeps compiled kernels, the tree and the indirect light between runs (None: the user's cache folder).
    Equal scene, lighting, quality, seed and camera give equal bytes; the quality changes nothing but `rgb`.
    """

    _has_compiled: ClassVar[bool] = False  # what takes pictures, in this process

    def __init__(
        self,
        scene: SceneGeometry,
        lighting: Lighting,
        *,
        cache_dir: Path | None = None,
        device: str = "cpu",
        seed: int = 0,
        quality: Quality = REALTIME,
    ) -> None:
        cache_dir = cache_dir or users_cache_dir()
        _ti.start(device, cache_dir)
        self._buffers: dict[str, tuple[int, Any]] = {}
        self._scratch = _ti.Scratch()
        self._seed = seed & 0x7FFFFFFF
        self._quality = quality
        self._scene, self._lighting = parting.parted(lamps.switched(scene, lighting.lamps)), lighting
        self._cache_dir = cache_dir
        self.device = device_scene.upload(self._scene, lighting, cache_dir)
        self._arranged: arrangement.Arrangement | None = None
        self._direct: lightmap.DirectLight | None = None  # from when cells are lit until the lightmap needs it
        self._changed: set[int] = set()  # objects that stand elsewhere, or are new: no splats show them
        self._is_lit_up = False
        self._kept: DeviceFrames | None = None  # of the last single picture on a GPU, where memory takes long to get

    @cached_property
    def irradiance(self) -> irradiance.Irradiance:
        """The scene's indirect light, worked out (seconds) or loaded when the first picture asks for it."""
        if self._arranged is not None:  # what is kept on disk is that of scenes as they were loaded
            self.device = device_scene.relit(self.device, self._scene)
            light, self._direct = irradiance.solve(self._scene, self.device, self._seed)
        else:
            light, self._direct = irradiance.load_or_solve(
                self._scene, self._lighting, self.device, self._cache_dir, self._seed
            )
        return light

    @cached_property
    def exposure(self) -> npt.NDArray[np.float64]:
        """Gain (3,) of red, green and blue that all pictures of this scene share."""
        return camera_response.exposure(*self.irradiance.mean_light(), self._lighting.exposure)

    @cached_property
    def splats(self) -> SplatDrawing | None:
        """What draws the scene's splats, if it has any."""
        return None if self._scene.splats is None else SplatDrawing(self._scene.splats, self._buffer)

    @cached_property
    def _cells(self) -> tuple[Any, Any, Any]:
        light = self.irradiance
        return _ti.upload(light.grid), _ti.upload(light.cells), _ti.upload(light.layout)

    @cached_property
    def near_lights(self) -> Any:
        """The importance of lights by position, as `kernels.light_grid` reads it."""
        return _ti.upload(self.irradiance.near)

    @cached_property
    def lightmap(self) -> lightmap.Lightmap:
        """The light of all surfaces, worked out (seconds) or loaded when the first picture asks for it."""
        cells, near = self._cells, self.near_lights  # first: they look for lamps anew
        light = (cells, near, self._direct)
        self._direct = None
        if self._arranged is not None:
            return lightmap.bake(self._scene, self.device, *light, self._seed)
        return lightmap.load_or_bake(self._scene, self._lighting, self.device, *light, self._cache_dir, self._seed)

    @property
    def scene(self) -> SceneGeometry:
        """The current scene, with switched lamps; triangles of removed objects have no area."""
        return self._scene

    def move(self, instance: int, transform: npt.NDArray[np.floating]) -> None:
        """Move an object by the rigid `transform` (4, 4) of its original position; it takes milliseconds.

        Depth and ids are right at once; the light on objects and the exposure stay those of before until `relight`,
        unless a lamp or a pane moves. Raises BenchbotError for what is no object or no pose.
        """
        before = self._arrangement()
        self._arrange(before, arrangement.move(before, instance, transform), before.triangles_of(instance))
        self._changed.add(instance)

    def remove(self, instance: int) -> None:
        """Take an object away; otherwise as `move`."""
        before = self._arrangement()
        self._arrange(before, arrangement.remove(before, instance), before.triangles_of(instance))

    def add(self, mesh: SceneGeometry, transform: npt.NDArray[np.floating]) -> tuple[int, ...]:
        """Put the objects of `mesh` into the scene, moved by `transform`; otherwise as `move`.

        Returns the numbers that they have here, in the order of its instances. Its lamps are on. All light is worked
        out anew, as by `relight`.
        """
        before = self._arrangement()
        after, numbers = arrangement.add(before, mesh, transform)
        self._arrange(before, after, np.arange(len(before.scene.triangles), len(after.scene.triangles)))
        self.relight()
        self._changed.update(numbers)
        return numbers

    def relight(self) -> None:
        """Have all light and the exposure worked out anew (seconds, not kept on disk) when the next picture asks."""
        for stored in ("irradiance", "exposure", "_cells", "near_lights", "lightmap"):
            self.__dict__.pop(stored, None)

    def _arrangement(self) -> arrangement.Arrangement:
        return self._arranged or device_scene.arrangement_of(self._scene, self.device)

    def _arrange(
        self, arranged: arrangement.Arrangement, after: arrangement.Arrangement, changed: npt.NDArray[np.int64]
    ) -> None:
        before = self.device
        self.device = device_scene.rearranged(before, arranged, after, changed)
        self._arranged, self._scene, self._direct = after, after.scene, None
        if self.device.lights is not before.lights:
            self.relight()

    def render(self, camera_to_map: npt.NDArray[np.floating], intrinsics: Intrinsics, *, rgb: bool = True) -> Frame:
        """Take one picture; `camera_to_map` is the (4, 4) pose of the optical frame (x right, y down, z forward).

        Without `rgb` the picture stays black and only depth and instances are worked out.
        """
        return self.render_batch(np.asarray(camera_to_map)[None], intrinsics, rgb=rgb)[0]

    def render_batch(
        self, camera_poses: npt.NDArray[np.floating], intrinsics: Intrinsics | Sequence[Intrinsics], *, rgb: bool = True
    ) -> FrameBatch:
        """Take the pictures of N cameras together; (N, 4, 4) poses as in `render`, and the same bytes as from there.

        `intrinsics` are all cameras' or one for each, all of one width and height. Raises BenchbotError when shapes
        and sizes do not agree.
        """
        poses = np.asarray(camera_poses, np.float64)
        kept = self._kept if self._kept and self._kept.is_of(len(poses), *common_size(poses, intrinsics), rgb) else None
        frames = self.render_on_device(poses, intrinsics, rgb=rgb, out=kept)
        if _ti.is_on_gpu() and len(poses) == 1:
            self._kept = frames
        return frames.to_host()

    def render_on_device(
        self,
        camera_poses: npt.NDArray[np.floating],
        intrinsics: Intrinsics | Sequence[Intrinsics],
        *,
        rgb: bool = True,
        out: DeviceFrames | None = None,
    ) -> DeviceFrames:
        """Like `render_batch`, but leave the pictures on the device.

        `out` are frames of as many pictures of the same size and channels, to be overwritten and returned: memory on a
        device takes as long to get as some thousand small pictures to take.
        """
        poses = np.asarray(camera_poses, np.float64)
        width, height = common_size(poses, intrinsics)
        splats = self.splats if rgb else None
        is_shaded = rgb and (splats is None or bool(self._changed))
        if is_shaded and self._quality == REALTIME and not self._is_lit_up:
            self._light_up()
        frames = DeviceFrames.allocate(len(poses), width, height, has_rgb=rgb, out=out)
        records = camera_records(poses, intrinsics, self.exposure if is_shaded else 1.0).reshape(-1, CAMERA_STRIDE)
        take, pixels_at_once = self._take, PIXELS_AT_ONCE
        if not is_shaded:
            take, pixels_at_once = self._look, GLANCED_PIXELS_AT_ONCE
        elif self._quality == FAST:
            take, pixels_at_once = self._glance, GLANCED_PIXELS_AT_ONCE
        elif self._quality == REALTIME:
            take = self._paint
        at_once = max(pixels_at_once // max(width * height, 1), 1)
        lenses = [intrinsics] * len(poses) if isinstance(intrinsics, Intrinsics) else intrinsics
        for first in range(0, len(poses), at_once):
            part = slice(first, first + at_once)
            take(records[part], frames, first)
            if splats is not None:
                splats.show(records[part], lenses[part], frames, first, self._changed)
        return frames

    def _light_up(self) -> None:
        """Compile what takes pictures while another process works out the light, where that saves time.

        It saves none once this process has compiled: another would start and load kernels that are here.
        """
        self._is_lit_up = True
        is_first, Renderer._has_compiled = not Renderer._has_compiled, True
        kept = (self._scene, self._lighting, self._cache_dir, self._seed)
        if is_first and self._arranged is None and light_process.is_of_use(*kept):
            with light_process.lighting_up(*kept):
                dark = copy.copy(self)
                dark._buffers = {}
                dark.exposure = np.ones(3)
                nowhere = np.zeros((0, 3))
                dark.near_lights = _ti.upload(light_grid.find(self.device, np.ones(8, np.float32), nowhere, nowhere))
                dark.lightmap = lightmap.none(self._scene)
                dark.render(np.eye(4), Intrinsics(16, 16, 8.0, 8.0, 8.0, 8.0))

    def _glance(self, records: npt.NDArray[np.float32], frames: DeviceFrames, first: int) -> None:
        """Take pictures `first` … of `frames` in one launch of one kernel, their colours from stored light alone."""
        from benchbot_sim_taichi.kernels import first_hits, glance, glance_tiles

        size = (len(records), frames.width, frames.height)
        cameras = self._buffer("cameras", records.size)
        _ti.write(cameras, records.ravel())
        hits = self._first_hits(cameras, size)
        device = self.device
        scene = (*device.tree, device.sheer_root, *device.surfaces)
        colors = self._buffer("colors", math.prod(size), np.int32)
        light = (device.lights[0], *self._cells, *camera_response.curves())
        places = (frames.depth_at(first), frames.instance_at(first))
        has_sheer = device.sheer_root >= 0
        if _ti.is_on_gpu():
            glance.glance(*scene, *light, cameras, hits, frames.words, colors, *places, *size, has_sheer)
        else:
            written = (frames.words, colors, *places, first_hits.squares(*size), *size[1:])
            glance_tiles.glance_tiles(*scene, *light, cameras, first_hits.SQUARES, hits, *written)
        glance.pack(colors, frames.words, frames.rgb_at(first), len(records), frames.width * frames.height)

    def _look(self, records: npt.NDArray[np.float32], frames: DeviceFrames, first: int) -> None:
        """Find depth and instances of pictures `first` … of `frames`, seen by cameras `records`."""
        cameras = self._buffer("cameras", records.size)
        _ti.write(cameras, records.ravel())
        hits = self._first_hits(cameras, (len(records), frames.width, frames.height))
        self._see(cameras, hits, frames, first, len(records))

    def _see(self, cameras: Any, hits: Any, frames: DeviceFrames, first: int, count: int) -> None:
        """Find depth and instances of pictures `first` … of `frames`."""
        from benchbot_sim_taichi.kernels import glance

        device = self.device
        scene = (*device.tree, device.sheer_root, *device.surfaces)
        places = (frames.depth_at(first), frames.instance_at(first))
        size = (count, frames.width, frames.height)
        glance.see(*scene, cameras, hits, frames.words, *places, *size, device.sheer_root >= 0)

    def _first_hits(self, cameras: Any, size: tuple[int, int, int]) -> Any:
        """Return the buffer of the cameras' first hits: filled here on a processor, by its reader on a GPU."""
        from benchbot_sim_taichi.kernels import first_hits

        if _ti.is_on_gpu():  # packets suit vector instructions, not its threads
            return self._buffer("hits", 1)
        hits = self._buffer("hits", first_hits.hits_size(*size))
        first_hits.meet_squares(*self.device.tree, self.device.sheer_root, cameras, hits, *size)
        return hits

    def _take(self, records: npt.NDArray[np.float32], frames: DeviceFrames, first: int) -> None:
        """Take pictures `first` … of `frames` by following paths."""
        size = (len(records), frames.width, frames.height)
        cameras = _ti.upload(records.ravel())
        hits = self._first_hits(cameras, size)
        self._see(cameras, hits, frames, first, len(records))
        shown = None
        if path_trace.is_denoised(self._quality):
            shown = path_trace.features(self.device, cameras, hits, len(records), size[1:])
        place = (self.device, self.near_lights)
        paths = path_trace.expose(*place, records, size[1:], self._quality, shown, self._seed)
        camera_response.develop(_ti.upload(paths.ravel()), frames.words, frames.rgb_at(first), *size, self._buffer)

    def _paint(self, records: npt.NDArray[np.float32], frames: DeviceFrames, first: int) -> None:
        """Take pictures `first` … of `frames` in one launch of each kernel, their light looked up on surfaces."""
        from benchbot_sim_taichi.kernels import first_hits, paint, paint_tiles, reflections, resolve

        width, height = frames.width, frames.height
        size = (len(records), width, height)
        pixels = math.prod(size)
        cameras = self._buffer("cameras", records.size)
        _ti.write(cameras, records.ravel())
        device, on_gpu = self.device, _ti.is_on_gpu()
        hits = self._first_hits(cameras, size)
        guide = self._buffer("guide", pixels * paint.GUIDE_STRIDE)
        shades = self._buffer("shades", pixels * paint.SHADE_STRIDE)
        mirrors = self._buffer("mirrors", pixels * paint.MIRROR_STRIDE)
        kinds = self._buffer("kinds", pixels, np.int32)
        centers, radiance, beside = (self._buffer(name, pixels * 3) for name in ("centers", "radiance", "beside"))
        seen, mirrored = (guide, shades, mirrors, kinds), (mirrors, kinds)
        scene = (*device.tree, device.sheer_root, *device.surfaces)
        lit = (*scene, device.lights[0], *self.lightmap.arrays)
        places = (frames.words, frames.depth_at(first), frames.instance_at(first))
        if on_gpu:
            paint.paint(*lit, cameras, *seen, centers, *places, *size)
        else:
            tiles = first_hits.squares(*size)
            paint_tiles.paint_tiles(
                *lit, cameras, first_hits.SQUARES, hits, *seen, centers, *places, tiles, width, height
            )
        lights = (*device.lights, device.light_of, self.near_lights)
        reflections.reflect(*scene, *lights, *self.lightmap.arrays, cameras, guide, *mirrored, *size, self._seed)
        spread = reflections.spread if on_gpu else reflections.spread_lanes
        spread(cameras, guide, kinds, mirrors, radiance, *size, 0, 1, paint.MIRROR_STRIDE, 11)
        spread(cameras, guide, kinds, radiance, beside, *size, 1, 1, 3, 0)
        spread(cameras, guide, kinds, beside, radiance, *size, 0, 4, 3, 0)
        spread(cameras, guide, kinds, radiance, beside, *size, 1, 4, 3, 0)
        reflections.combine(cameras, shades, *mirrored, beside, centers, *size)
        if on_gpu:
            listed = self._buffer("listed", pixels + 1, np.int32)
            samples = self._buffer("samples", pixels * first_hits.SAMPLES * 3)
            resolve.resolve_pixels(*lit, cameras, *seen, centers, radiance, listed, samples, *size)
        else:
            edges.resolve(lit, cameras, seen, centers, radiance, size, self._buffer)
        camera_response.develop(radiance, frames.words, frames.rgb_at(first), *size, self._buffer)

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
            cast = primary.cast_rays if _ti.is_on_gpu() else primary.cast_packets
            cast(
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

    def cast_fans(
        self, poses: npt.NDArray[np.float64], along: npt.NDArray[np.float64], range_max_m: float, distances: Any
    ) -> None:
        """Fill `distances` (N * rays) along rays (rays, 3) in the frames of N scanners (N, 4, 4).

        Where nothing is within the range, it is a larger number.
        """
        from benchbot_sim_taichi.kernels import primary

        count, rays = len(poses), len(along)
        if not count:
            return
        at, ways = self._scratch.put("poses", poses), self._scratch.put("along", along)
        origins, directions = (self._buffer(name, count * rays * 3) for name in ("origins", "directions"))
        with _ti.exact_arithmetic():
            primary.spread_fans(at, ways, origins, directions, count, rays)
        cast = primary.cast_rays if _ti.is_on_gpu() else primary.cast_packets
        reach = (float(range_max_m), distances, count * rays)
        cast(*self.device.tree, self.device.sheer_root, origins, directions, *reach)

    def _buffer(self, name: str, size: int, dtype: npt.DTypeLike = np.float32) -> Any:
        """Working memory that stays between frames; it holds nothing that a frame reads before it writes."""
        if self._buffers.get(name, (0, None))[0] < size:
            self._buffers[name] = (size, _ti.upload(np.zeros(size, dtype)))
        return self._buffers[name][1]
