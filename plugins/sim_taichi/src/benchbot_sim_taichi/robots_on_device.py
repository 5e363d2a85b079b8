"""Many robots whose actions run in one launch, where their pictures are taken."""

import math
from collections.abc import Sequence
from typing import Any, Protocol, cast

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, Scene, cache_dir
from benchbot.simulation import PICTURES, ActionNumbers, KinematicRobots, Laser, Poses
from benchbot_scenes.obstacle_map import EdgeGrid
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.frames import DeviceFrames
from benchbot_sim_taichi.renderer import Renderer
from benchbot_sim_taichi.simulator import intrinsics_of

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Tensor = Any
Tensors = dict[str, Tensor]

STATES = (
    "x",
    "y",
    "yaw_rad",
    "linear_mps",
    "angular_radps",
    "linear_mps2",
    "angular_radps2",
    "clock_s",
    "known_x",
    "known_y",
    "known_clearance_m",
)
"""The first rows of the table of states, in the order of `kernels.motion`; ticks and contact follow."""


class _Obstacles(Protocol):
    """What robots bump into, as of `simulator`'s worlds."""

    revision: int

    def edge_grid(self) -> EdgeGrid: ...


class TracedRobots(KinematicRobots):
    """`KinematicRobots` whose actions are executed by a kernel, or by arrays as there where their odometry drifts."""

    def __init__(self, simulator: Any, count: int) -> None:
        super().__init__(simulator, count)
        limits, radius_m = self._robot.limits, self._robot.footprint.radius_m
        self._values = ActionNumbers.of(simulator.config, limits, radius_m, simulator.control_period_s)
        self._table = np.zeros((len(STATES) + 2, count))
        for row, name in enumerate(STATES):
            setattr(self._motion.states, name, self._table[row])
        self._maps: _Maps | None = None
        self._outcomes = np.array([self.outcomes.index(name) for name in ("reached", "blocked", "collided", "timeout")])
        self._scratch, self._sightings = _ti.Scratch(), _ManySightings(count)

    def execute(self, robots: Indices, straight: npt.NDArray[np.bool_], arguments: Floats) -> npt.NDArray[np.intp]:
        """As of `KinematicRobots`."""
        if self._noisy or not len(robots):
            return super().execute(robots, straight, arguments)
        _ti.start(self._simulator.world.device.kind, self._simulator.spec.cache_dir or cache_dir())
        from benchbot_sim_taichi.kernels import motion as kernels

        self._notice_changes(robots)
        revisions = tuple(world.revision for world in self._worlds)
        if self._maps is None or self._maps.revisions != revisions:
            self._maps = _Maps(cast(Sequence[_Obstacles], self._worlds), revisions, self._values)
        states, table, maps = self._motion.states, self._table, self._maps
        table[len(STATES)], table[len(STATES) + 1] = states.instant, states.collided
        outcomes, put = np.empty(len(robots), np.int32), self._scratch.put
        there, ended = put("states", table), put("outcomes", outcomes)
        with _ti.exact_arithmetic():
            kernels.execute(
                put("robots", robots.astype(np.int32)),
                put("straight", straight.astype(np.int32)),
                put("arguments", arguments),
                put("angles", arguments * (math.pi / 180)),
                there,
                put("worlds", self._world_of.astype(np.int32)),
                *maps.arrays,
                ended,
                len(robots),
                table.shape[1],
                int(self._simulator.config.stops_before_contact),
                kernels.WARP if _ti.is_on_gpu() else 1,
            )
        _ti.read(there, table)
        _ti.read(ended, outcomes)
        states.instant[:], states.collided[:] = table[len(STATES)], table[len(STATES) + 1] != 0
        numbers: Indices = self._outcomes[outcomes]
        return numbers

    def load(self, robot: int, scene: Scene, seed: int) -> None:
        """As of `KinematicRobots`."""
        super().load(robot, scene, seed)
        self._sightings.begin(robot, self._starts[robot].sightings)

    def tensor_device(self) -> str:
        """Where tensors are: "cuda" or "cpu"."""
        return str(self._simulator.world.device.kind)

    def tensors(self, robots: Indices, channels: Sequence[str]) -> Tensors:
        """Return what `observe` does of those `channels` that need not pass through the host: pictures and laser.

        Values are as an observation space has them: 0 where nothing was measured, and no more than the sensor's range.
        What is returned is the caller's own. Channels with noise are left out.
        """
        camera, laser = self._robot.camera, self._robot.laser
        pictures = [name for name in PICTURES if name in channels]
        if camera.rgb_noise:
            pictures = [name for name in pictures if name != "image_rgb"]
        if camera.depth_noise:
            pictures = [name for name in pictures if name != "image_depth"]
        bases = self._bases(robots, noisy=False)
        seen: Tensors = {}
        groups = self._by_world(robots)
        for world, there in groups:
            part: Tensors = {}
            renderer = cast(Any, world).renderer
            if pictures:
                eyes = bases[there] @ self._robot.mounts[camera.frame]
                part |= self._pictures(renderer, eyes, robots[there], pictures)
            if laser and laser.noise is None and "laser" in channels:
                mounts = bases[there] @ self._robot.mounts[laser.frame]
                part["laser"] = _ranges(renderer, mounts, laser)
            for name, rows in part.items():
                if len(groups) == 1:
                    seen[name] = rows
                else:
                    if name not in seen:
                        seen[name] = rows.new_empty((len(robots), *rows.shape[1:]))
                    _put_rows(seen[name], there, rows)
        return seen

    def _pictures(self, renderer: Renderer, eyes: Poses, robots: Indices, channels: Sequence[str]) -> Tensors:
        camera, torch = self._robot.camera, _torch()
        size = {"count": len(eyes), "width": camera.width, "height": camera.height}
        has_rgb = "image_rgb" in channels
        words = torch.empty(
            DeviceFrames.words_of(**size, has_rgb=has_rgb), dtype=torch.int32, device=self.tensor_device()
        )
        frames = DeviceFrames(words, **size, has_rgb=has_rgb)
        renderer.render_on_device(eyes.matrices(), intrinsics_of(camera), rgb=has_rgb, out=frames)
        shape = (len(eyes), camera.height, camera.width)
        planes = words[: 2 * math.prod(shape)].view(2, *shape)
        seen: Tensors = {}
        if has_rgb:
            strides = (frames.rgb_at(1) * 4 - frames.rgb_at(0) * 4, 3 * camera.width, 3, 1)
            seen["image_rgb"] = words.view(torch.uint8).as_strided((*shape, 3), strides, frames.rgb_at(0) * 4)
        if "image_depth" in channels:
            seen["image_depth"] = _within(planes[0].view(torch.float32), camera.range_m)
        if "image_segment" in channels:
            seen |= self._sightings.segment(planes[1], robots)
        return seen


def _ranges(renderer: Renderer, poses: Poses, laser: Laser) -> Tensor:
    torch = _torch()
    device = "cuda" if _ti.is_on_gpu() else "cpu"
    ranges_m = torch.empty(len(poses) * laser.rays, dtype=torch.float32, device=device)
    renderer.cast_fans(poses.matrices(), laser.along(), laser.range_m[1], ranges_m)
    return _within(ranges_m.view(len(poses), laser.rays), laser.range_m)


def _put_rows(target: Tensor, places: Indices, rows: Tensor) -> None:
    """Put rows at some places of a tensor; torch does not for all types by itself."""
    torch = _torch()
    if target.dtype == torch.uint16:
        target, rows = target.view(torch.int16), rows.view(torch.int16)
    target[torch.from_numpy(places).to(target.device)] = rows


def _within(metres: Tensor, range_m: tuple[float, float]) -> Tensor:
    """Cut off in place: 0 before a sensor's range, and its end beyond it."""
    nearest_m, farthest_m = range_m
    metres.clamp_(max=farthest_m)
    return metres.masked_fill_(metres < nearest_m, 0.0)


class _ManySightings:
    """`Sightings` of N robots, and their numbers on the device."""

    def __init__(self, count: int) -> None:
        self._each: list[Any] = [None] * count
        self._tables: tuple[Tensor, Tensor] | None = None

    def begin(self, robot: int, sightings: Any) -> None:
        self._each[robot] = sightings
        self._tables = None

    def segment(self, instance: Tensor, robots: Indices) -> Tensors:
        """Return the pictures (M, H, W) of classes and of numbers of the objects in `instance`."""
        torch = _torch()
        count, pixels = len(robots), instance.shape[1] * instance.shape[2]
        seen = instance.reshape(count, pixels).long()
        chosen = torch.from_numpy(robots).to(instance.device)
        classes, numbers = self._on(instance.device)
        known, of_class = numbers[chosen].gather(1, seen), classes[chosen].gather(1, seen)
        is_new = (known == 0) & (of_class > 0)
        rows = torch.nonzero(is_new.any(1))[:, 0]
        if len(rows):
            # The first pixel of each object, where pixels that are not new count for none.
            place = torch.arange(pixels, device=instance.device).expand(len(rows), -1)
            place = place.masked_fill(~is_new[rows], pixels)
            first = torch.full((len(rows), classes.shape[1]), pixels, dtype=torch.int64, device=instance.device)
            first.scatter_reduce_(1, seen[rows], place, "amin")
            for robot, pixel in zip(robots[rows.cpu().numpy()].tolist(), first.cpu().numpy(), strict=True):
                order = np.argsort(pixel, kind="stable")
                self._each[robot].number(order[: np.count_nonzero(pixel < pixels)].tolist())
            self._tables = None
            known = self._on(instance.device)[1][chosen].gather(1, seen)
        return {
            "class_segment_img": of_class.to(torch.uint8).view(instance.shape),
            "instance_segment_img": known.to(torch.int16).view(torch.uint16).view(instance.shape),
        }

    def _on(self, device: Any) -> tuple[Tensor, Tensor]:
        if self._tables is None:
            width = max(len(each.numbers) for each in self._each if each is not None)
            tables = np.zeros((2, len(self._each), width), np.int64)
            for row, each in enumerate(self._each):
                if each is not None:
                    tables[0, row, : len(each.numbers)] = each.labels.classes
                    tables[1, row, : len(each.numbers)] = each.numbers
            classes, numbers = _torch().from_numpy(tables).to(device)
            self._tables = (classes, numbers)
        return self._tables


def _torch() -> Any:
    try:
        import torch
    except ModuleNotFoundError as missing:
        raise BenchbotError(
            "torch is not installed.",
            "Observations were asked for as its tensors.",
            'Install it: pip install torch, or leave tensors="torch" out.',
        ) from missing
    return torch


class _Maps:
    """The obstacles of some worlds, as `kernels.motion` reads them."""

    def __init__(self, worlds: Sequence[_Obstacles], revisions: tuple[int, ...], values: ActionNumbers) -> None:
        from benchbot_sim_taichi.kernels import motion as kernels

        self.revisions = revisions
        grids = [world.edge_grid() for world in worlds]
        maps, starts, near, cells, listed, edges = [], [], [], 0, 0, 0
        for grid in grids:
            maps.append([*grid.first, *grid.shape, cells, cells + len(grid.starts) - 2])
            starts.append(grid.starts + listed)
            near.append(grid.numbers + edges)
            cells, listed, edges = cells + len(grid.starts), listed + len(grid.numbers), edges + len(grid.edges)
        numbers = [grids[0].size_m if name == "cell_size_m" else getattr(values, name) for name in kernels.NUMBERS]
        self.arrays = tuple(
            _ti.upload(array.ravel())
            for array in (
                np.array(maps, np.int32),
                np.concatenate(starts).astype(np.int32),
                np.concatenate([*near, np.zeros(1, np.int64)]).astype(np.int32),
                np.concatenate([*(grid.edges for grid in grids), np.zeros((1, 5))]),
                np.array(numbers),
            )
        )
