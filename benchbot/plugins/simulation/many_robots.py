"""Many robots of one kinematic simulator, moved and observed as arrays."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from benchbot.plugin import MotionConfig, Observations, PlatformSpec, Pose, Scene, randomness
from benchbot.plugins.simulation.camera_noise import Response
from benchbot.plugins.simulation.dynamics import State
from benchbot.plugins.simulation.imu import Imu, Motion
from benchbot.plugins.simulation.many_motion import OUTCOMES, ManyMotion, ManyOdometry
from benchbot.plugins.simulation.poses import EXACT, Floats, Indices, Mask, Poses, Trigonometry
from benchbot.plugins.simulation.robot import INITIAL_POSE, Robot
from benchbot.plugins.simulation.sensors import Frame, Sightings
from benchbot.plugins.simulation.world import World

PICTURES = ("image_rgb", "image_depth", "image_segment")
Arrays = dict[str, npt.NDArray[Any]]


class _Simulator(Protocol):
    """The simulator of one robot, which loads scenes for many."""

    spec: PlatformSpec
    config: MotionConfig
    robot: Robot
    response: Response
    world: Any
    state: State
    sightings: Sightings

    @property
    def control_period_s(self) -> float: ...
    @property
    def trigonometry(self) -> Trigonometry: ...
    def load(self, scene: Scene, seed: int) -> None: ...


@dataclass
class _Start:
    """What a robot was loaded with."""

    world: World
    pose: Pose
    seed: int
    sightings: Sightings


class KinematicRobots:
    """Implements `benchbot.core.platform.ManyRobots` for what `simulator` is one of: N robots, numbered from 0."""

    outcomes = OUTCOMES

    def __init__(self, simulator: _Simulator, count: int) -> None:
        self._simulator, self._robot, self._by = simulator, simulator.robot, EXACT
        self._noisy = simulator.spec.localisation == "noisy"
        self._motion = ManyMotion(
            count,
            simulator.config,
            self._robot.limits,
            self._robot.footprint.radius_m,
            self._distances_m,
            simulator.control_period_s,
            ManyOdometry.of(count, self._robot.noise) if self._noisy else None,
        )
        self._starts: dict[int, _Start] = {}
        self._worlds: list[World] = []
        self._world_of, self._revision_of = np.zeros((2, count), np.intp)
        scanners = {"laser": self._robot.laser, "lidar": self._robot.lidar}
        self._scanners = {name: scanner for name, scanner in scanners.items() if scanner}
        self._base_z_m, self._start_rows = np.zeros(count), np.zeros((count, 7))

    @property
    def collided(self) -> Mask:
        """Who has touched something since it was loaded (N,)."""
        return self._motion.states.collided

    @property
    def clock_s(self) -> Floats:
        """Simulated seconds since each was loaded (N,)."""
        return self._motion.states.clock_s

    def load(self, robot: int, scene: Scene, seed: int) -> None:
        """Put a robot at the start of a scene; raises BenchbotError when it does not fit there."""
        simulator = self._simulator
        simulator.load(scene, seed)
        self._by = self._motion.by = simulator.trigonometry
        start, state = scene.start_pose, simulator.state
        self._motion.begin(robot, state)
        if self._motion.odometry is not None:
            self._motion.odometry.begin(robot, state, seed)
        world = simulator.world
        if world not in self._worlds:
            self._worlds.append(world)
        self._world_of[robot], self._revision_of[robot] = self._worlds.index(world), world.revision
        self._starts[robot] = _Start(world, start, seed, simulator.sightings)
        self._base_z_m[robot] = start.translation_xyz[2]
        self._start_rows[robot] = (*start.translation_xyz, *start.rotation_xyzw)

    def execute(self, robots: Indices, straight: Mask, arguments: Floats) -> npt.NDArray[np.intp]:
        """Execute move_distance (m) where `straight`, else move_angle (degrees), of each of these robots to its end.

        Returns numbers (M,) of `outcomes`.
        """
        self._notice_changes(robots)
        return self._motion.execute(robots, straight, arguments)

    def hold(self, robots: Indices, linear_mps: Floats, angular_radps: Floats, duration_s: float) -> None:
        """Hold velocities (M,) for a while, in whole control ticks; who touches something stays."""
        self._notice_changes(robots)
        self._motion.hold(robots, linear_mps, angular_radps, duration_s)

    def poses_xyyaw(self, robots: Indices) -> Floats:
        """Return the true places and headings (M, 3) of the bases in the map frame."""
        bases = self._bases(robots, noisy=False)
        return np.stack([*bases.translation_xyz[:, :2].T, bases.yaws_rad(self._by)], 1)

    def pose(self, robot: int) -> Pose:
        """Return the true pose of one robot's base."""
        return self._bases(np.array([robot]), noisy=False)[0]

    def constants(self, robot: int, channels: Iterable[str]) -> Observations:
        """Return of the channels what does not change within a scene: camera models, labels and the scanners' angles.

        Pictures are empty and ranges zero.
        """
        start = self._starts[robot]
        found: dict[str, Any] = {}
        for name in channels:
            if name.endswith("_info"):
                found[name] = self._robot.camera.info()
            elif name == "image_segment":
                found[name] = {"class_ids": dict(start.sightings.labels.class_ids)}
            elif scanner := self._scanners.get(name):
                found[name] = scanner.channel(np.full(scanner.rays, np.inf))
        return found  # type: ignore[return-value]

    def observe(self, robots: Indices, channels: Sequence[str]) -> Arrays:
        """Return what these robots (M,) observe now, each array with a row for each of them.

        `image_rgb`, `image_depth`, `class_segment_img`, `instance_segment_img` are pictures as the channels have them,
        `laser` and `lidar` ranges in metres, `imu_…` the vectors of the unit, and `pose_FRAME` positions and
        quaternions (7,). All pictures and scans of one world are made in one launch.
        """
        wanted = [name for name in channels if not name.endswith("_info")]
        bases = self._bases(robots, noisy=False)
        seen: Arrays = {}
        groups = self._by_world(robots)
        for world, there in groups:
            part = self._sense(world, robots[there], bases[there], wanted)
            for name, rows in part.items():
                if len(groups) == 1:
                    seen[name] = rows
                else:
                    seen.setdefault(name, np.empty((len(robots), *rows.shape[1:]), rows.dtype))[there] = rows
        if "poses" in wanted:
            seen |= self._reported(robots, bases)
        return seen

    def _sense(self, world: World, robots: Indices, bases: Poses, wanted: Sequence[str]) -> Arrays:
        robot, seen = self._robot, Arrays()
        if any(name in PICTURES for name in wanted):
            camera = robot.camera
            frame = world.render_many(camera, bases @ robot.mounts[camera.frame], rgb="image_rgb" in wanted)
            if "image_rgb" in wanted:
                seen["image_rgb"] = self._noisily(robots, frame, "image_rgb") if camera.rgb_noise else frame.rgb
            if "image_depth" in wanted:
                seen["image_depth"] = (
                    self._noisily(robots, frame, "image_depth")
                    if camera.depth_noise
                    else camera.depth(frame, partial(np.random.default_rng, 0))
                )
            if "image_segment" in wanted:
                seen |= self._segmented(robots, frame)
        for name, scanner in self._scanners.items():
            if name in wanted:
                randoms = self._randoms(robots, name)
                seen[name] = scanner.ranges(world.raycast, bases @ robot.mounts[scanner.frame], randoms)
        if "imu" in wanted and robot.imu:
            seen |= self._inertia(robots, robot.imu)
        return seen

    def _noisily(self, robots: Indices, frame: Frame, channel: str) -> npt.NDArray[Any]:
        camera, pictures = self._robot.camera, []
        for row, robot in enumerate(robots.tolist()):
            random = partial(self._random, robot, channel)
            one = frame.row(row)
            pictures.append(
                camera.rgb(one, random, self._simulator.response)
                if channel == "image_rgb"
                else camera.depth(one, random)
            )
        return np.stack(pictures)

    def _segmented(self, robots: Indices, frame: Frame) -> Arrays:
        sightings = [self._starts[robot].sightings for robot in robots.tolist()]
        classes = sightings[0].labels.classes[frame.instance]
        rows = np.arange(len(robots)).reshape(-1, 1, 1)
        numbers = np.stack([each.numbers for each in sightings])[rows, frame.instance]
        new = ((numbers == 0) & (classes > 0)).any((1, 2))
        for row in np.flatnonzero(new).tolist():
            numbers[row] = sightings[row].segment(frame.row(row))["instance_segment_img"]
        return {"class_segment_img": classes, "instance_segment_img": numbers}

    def _inertia(self, robots: Indices, imu: Imu) -> Arrays:
        states = self._motion.states
        mount = self._robot.mounts.get(imu.frame, Pose())
        moving = zip(
            *(each[robots].tolist() for each in (states.linear_mps, states.angular_radps)),
            *(each[robots].tolist() for each in (states.linear_mps2, states.angular_radps2)),
            strict=True,
        )
        measured = [
            imu.measure(Motion(*motion), mount, self._random(robot, "imu"))
            for robot, motion in zip(robots.tolist(), moving, strict=True)
        ]
        return {f"imu_{name}": np.stack([each[name] for each in measured]) for name in measured[0]}  # type: ignore[literal-required]

    def _reported(self, robots: Indices, bases: Poses) -> Arrays:
        robot = self._robot
        believed = self._bases(robots, noisy=True) if self._noisy else bases
        rows: Arrays = {robot.base_frame: believed.rows(), INITIAL_POSE: self._start_rows[robots]}
        for frame in {*robot.reported, robot.camera.frame} - rows.keys():
            rows[frame] = (believed @ robot.mounts[frame]).rows()
        reported = {f"pose_{frame}": rows[frame] for frame in robot.reported}
        return reported | {"pose_camera": rows[robot.camera.frame]}

    def _bases(self, robots: Indices, *, noisy: bool) -> Poses:
        odometry = self._motion.odometry
        states = odometry if noisy and odometry else self._motion.states
        x, y, yaw_rad = states.x[robots], states.y[robots], states.yaw_rad[robots]
        return Poses.planar(x, y, yaw_rad, self._base_z_m[robots], self._by)

    def _by_world(self, robots: Indices) -> list[tuple[World, Indices]]:
        """Return each world with the places in `robots` of those that are in it."""
        numbers = self._world_of[robots]
        if (numbers == numbers[:1]).all():
            return [(self._worlds[number], np.arange(len(robots))) for number in numbers[:1].tolist()]
        return [(self._worlds[number], np.flatnonzero(numbers == number)) for number in np.unique(numbers).tolist()]

    def _distances_m(self, robots: Indices, x: Floats, y: Floats) -> Floats:
        groups = self._by_world(robots)
        if len(groups) == 1:
            return groups[0][0].clearances_m(x, y)
        distances_m = np.empty(len(robots))
        for world, there in groups:
            distances_m[there] = world.clearances_m(x[there], y[there])
        return distances_m

    def _notice_changes(self, robots: Indices) -> None:
        revisions = np.array([world.revision for world in self._worlds])[self._world_of[robots]]
        stale = robots[self._revision_of[robots] != revisions]
        if len(stale):
            self._motion.forget(stale)
            self._revision_of[robots] = revisions

    def _random(self, robot: int, sensor: str) -> np.random.Generator:
        return randomness.generator(self._starts[robot].seed, sensor, int(self._motion.states.instant[robot]))

    def _randoms(self, robots: Indices, sensor: str) -> Iterator[np.random.Generator]:
        return (self._random(robot, sensor) for robot in robots.tolist())
