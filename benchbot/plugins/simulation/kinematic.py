"""A simulator of a robot on wheels, all but its world: what is seen, hit by rays and bumped into."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, Generic, Self, TypeVar

import numpy as np

from benchbot.plugin import (
    BenchbotError,
    InertialMeasurement,
    JointStates,
    MotionConfig,
    Observations,
    PlatformSpec,
    Pose,
    Scene,
    did_you_mean,
    randomness,
)
from benchbot.plugins.simulation import dynamics
from benchbot.plugins.simulation.camera_noise import Response, SrgbResponse
from benchbot.plugins.simulation.contact import Clearance, travel
from benchbot.plugins.simulation.dynamics import State
from benchbot.plugins.simulation.imu import Motion
from benchbot.plugins.simulation.many_robots import PICTURES, KinematicRobots
from benchbot.plugins.simulation.odometry import Odometry
from benchbot.plugins.simulation.poses import EXACT, Trigonometry
from benchbot.plugins.simulation.robot import Robot
from benchbot.plugins.simulation.scanners import Laser, Lidar
from benchbot.plugins.simulation.sensors import Frame, Labels, Sightings
from benchbot.plugins.simulation.world import World

CONTROL_PERIOD_S = 0.05
CHANNELS = [*PICTURES, *(f"{picture}_info" for picture in PICTURES), "laser", "lidar", "imu", "joint_states", "poses"]


W = TypeVar("W", bound=World)


class KinematicSimulator(ABC, Generic[W]):
    """Implements `benchbot.plugin.Simulation` in simulated time, on top of the `World` that `open` returns.

    Limits, ramps, contact, odometry with its noise, the noise and models of sensors, frames and the numbers of objects
    are here. A simulator with physics of its own overrides `advance`, and `measured` where wheels slip. `title` begins
    sentences of errors; `response` is that of its camera, for the noise of pictures.
    """

    title: ClassVar[str] = "This simulator"
    channels: ClassVar[list[str]] = CHANNELS
    response: Response = SrgbResponse()

    def __init__(self, spec: PlatformSpec) -> None:
        self.spec = spec
        self.config = MotionConfig.from_robot(spec.robot, spec.localisation)
        self.robot = Robot.from_declaration(spec.robot, self.config)
        self._check_sideways()
        self.world: W

    @abstractmethod
    def open(self, scene: Scene) -> W:
        """Return the world of a scene, at best one that was opened before; raises BenchbotError when it has none."""

    @property
    def control_period_s(self) -> float:
        """20 Hz, as in v2."""
        return CONTROL_PERIOD_S

    def load(self, scene: Scene, seed: int) -> None:
        """Put the robot at the start pose of the scene; raises BenchbotError when it does not fit there."""
        self.world = self.open(scene)
        self.sightings = Sightings(Labels.of(self.world.instances, scene.environment.get("object_labels", ())))
        self._start_pose = scene.start_pose
        x, y, self._base_z_m = self._start_pose.translation_xyz
        self.state = State(x, y, self._start_pose.yaw_rad)
        noise = self.robot.noise
        bias = (noise.linear_bias, noise.angular_bias)
        holonomic = self.robot.limits.lateral_mps > 0
        self._odometry = Odometry(self.state, noise.linear, noise.angular, seed, bias, holonomic=holonomic)
        self._motion = Motion()
        self._seed, self._instant = seed, 0
        self._clock_s = 0.0
        self._collided = False
        self._clearance, self._revision = self._new_clearance(), self.world.revision
        if self.world.covers(x, y) or self._clearance.exactly_m(self.state) < 0:
            raise BenchbotError(
                f"The robot '{self.robot.name}' does not fit at the start of this scene.",
                f"At ({x:g}, {y:g}) its footprint of radius {self.robot.footprint.radius_m:g} m overlaps an obstacle.",
                "Move the environment's start_pose, or choose a smaller robot.",
            )

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the requested channels; pictures share one exposure, and other channels are not rendered."""
        return self.observe_many([self], channels)[0]

    def observe_many(self, platforms: Sequence[Self], channels: Iterable[str]) -> list[Observations]:
        """Return what each of these simulators of one robot observes now, with one `render` and `raycast` per world."""
        wanted = tuple(channels)
        unknown = [name for name in wanted if name not in self.channels]
        if unknown:
            raise BenchbotError(
                f"{self.title} does not simulate '{unknown[0]}'.",
                f"It simulates: {', '.join(self.channels)}.{did_you_mean(unknown[0], self.channels)}",
                "Choose a task that asks for these only.",
            )
        observed: list[Observations] = [{} for _ in platforms]
        for world in {id(platform.world): platform.world for platform in platforms}.values():
            there = [i for i, platform in enumerate(platforms) if platform.world is world]
            mounts = [platforms[i].mounts() for i in there]
            poses = [platforms[i].pose() for i in there]
            frames = self._expose(world, poses, mounts, wanted)
            scans = {
                name: scanner.scan(
                    world.raycast,
                    [pose @ mount[scanner.frame] for pose, mount in zip(poses, mounts, strict=True)],
                    (platforms[i]._random(name) for i in there),
                )
                for name, scanner in self._scanners(wanted).items()
            }
            for number, (i, frame) in enumerate(zip(there, frames, strict=True)):
                scanned = {name: scan[number] for name, scan in scans.items()}
                observed[i] = platforms[i]._seen(wanted, frame, scanned)
        return observed

    def many(self, count: int) -> KinematicRobots | None:
        """Return so many robots like this one, to be moved as arrays; None where each moves by itself.

        So do those that have physics of their own, and those that drive sideways.
        """
        base, own = KinematicSimulator, type(self)
        same = all(
            getattr(own, name) is getattr(base, name)
            for name in ("drive", "advance", "measured", "contact_ahead", "pose", "odometry", "mounts")
        )
        return KinematicRobots(self, count) if same and not self.robot.limits.lateral_mps else None

    @property
    def trigonometry(self) -> Trigonometry:
        """Whose sine and cosine move many robots in the loaded scene: as exact as those of one, unless overridden."""
        return EXACT

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Apply one control tick; at contact the robot stands still, `collided`, for the rest of it."""
        self._conclude_tick(self.advance(linear_mps, angular_radps, duration_s), duration_s)

    def drive_sideways(
        self, lateral_mps: float, angular_radps: float, duration_s: float, linear_mps: float = 0.0
    ) -> None:
        """Apply one control tick of a holonomic base with a velocity to its left, as `drive` does."""
        self._conclude_tick(self.advance_sideways(lateral_mps, angular_radps, duration_s, linear_mps), duration_s)

    def _conclude_tick(self, advanced: tuple[State, bool], duration_s: float) -> None:
        before = self.state
        self.state, contact = advanced
        self._collided |= contact
        self._clock_s += duration_s
        self._instant += 1
        self._odometry.follow(*self.measured(before))
        now = self.state
        self._motion = self._motion.after(now.linear_mps, now.angular_radps, duration_s, now.lateral_mps)

    def advance(self, linear_mps: float, angular_radps: float, duration_s: float) -> tuple[State, bool]:
        """Return the state after a control tick, and whether there was contact in it."""
        way = dynamics.drive(self.state, linear_mps, angular_radps, duration_s, self.robot.limits)
        return travel(self.state, way, self.clearance)

    def advance_sideways(
        self, lateral_mps: float, angular_radps: float, duration_s: float, linear_mps: float
    ) -> tuple[State, bool]:
        """Return the state after a control tick sideways, and whether there was contact in it."""
        way = dynamics.drive(self.state, linear_mps, angular_radps, duration_s, self.robot.limits, lateral_mps)
        return travel(self.state, way, self.clearance)

    def measured(self, before: State) -> tuple[State, State]:
        """Return two states between which lies the motion that the wheels have measured in the last control tick."""
        return before, self.state

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return whether holding this command and then braking would touch something."""
        if self.clearance.exceeds(self.state, self.robot.limits.reach_m(self.state, linear_mps, horizon_s)):
            return False
        way = dynamics.drive_and_brake(self.state, linear_mps, angular_radps, horizon_s, self.robot.limits)
        return travel(self.state, way, self.clearance)[1]

    def contact_beside(self, lateral_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return whether holding this command sideways and then braking would touch something."""
        limits = self.robot.limits
        if self.clearance.exceeds(self.state, limits.reach_m(self.state, 0.0, horizon_s, lateral_mps)):
            return False
        way = dynamics.drive_and_brake(self.state, 0.0, angular_radps, horizon_s, limits, lateral_mps)
        return travel(self.state, way, self.clearance)[1]

    def pose(self) -> Pose:
        """Return the true pose of the base; it keeps the height of the start pose."""
        return Pose.planar(self.state.x, self.state.y, self.state.yaw_rad, self._base_z_m)

    def odometry(self) -> Pose:
        """Return the base's pose by dead reckoning."""
        return Pose.planar(*self._odometry.pose, self._base_z_m)

    @property
    def velocity(self) -> tuple[float, float]:
        """Linear m/s along +x and angular rad/s about +z."""
        return (self.state.linear_mps, self.state.angular_radps)

    @property
    def lateral_mps(self) -> float:
        """M/s along +y; 0 for a differential base."""
        return self.state.lateral_mps

    @property
    def collided(self) -> bool:
        """True if the robot has touched something since `load`."""
        return self._collided

    def clock(self) -> float:
        """Return simulated seconds since `load`."""
        return self._clock_s

    def place(self, base: Pose) -> None:
        """Put the robot, at rest, at a pose in the map frame."""
        x, y, _ = base.translation_xyz
        self.state = State(x, y, base.yaw_rad)
        self._motion = Motion()
        self._instant += 1

    def mounts(self) -> Mapping[str, Pose]:
        """Return where frames are in the robot's frame now; a simulator of robots with moving parts overrides it."""
        return self.robot.mounts

    def joint_states(self) -> JointStates:
        """Return the states of joints; a simulator of robots with arms overrides it."""
        raise self._lacks("joint_states")

    def halt(self, why: str) -> None:
        """Do nothing: a simulated robot moves inside `drive` only."""

    def close(self) -> None:
        """Do nothing: a simulator that holds something overrides this."""

    @property
    def clearance(self) -> Clearance:
        """The distance between the footprint and what it can bump into where things are now."""
        if self._revision != self.world.revision:
            self._clearance, self._revision = self._new_clearance(), self.world.revision
        return self._clearance

    def _new_clearance(self) -> Clearance:
        return Clearance(self.world.clearance_m, self.robot.footprint.radius_m)

    def _check_sideways(self) -> None:
        """Raise BenchbotError for a robot that drives sideways where its declaration or this simulator does not."""
        if self.robot.limits.lateral_mps == 0 and "move_sideways" not in self.spec.robot["connections"]:
            return
        base, own = KinematicSimulator, type(self)
        if own.advance is not base.advance and own.advance_sideways is base.advance_sideways:
            raise BenchbotError(
                f"{self.title} cannot drive the robot '{self.robot.name}' sideways.",
                "Its physics is that of a base which drives ahead and turns.",
                "Remove limits.lateral_mps and move_sideways from the robot, or choose a simulator such as sim_taichi.",
            )
        if self.robot.limits.lateral_mps == 0:
            raise BenchbotError(
                f"The robot '{self.robot.name}' cannot drive sideways.",
                "It connects move_sideways, and its limits have no lateral_mps.",
                "Add the fastest speed to both sides, in m/s: limits: {lateral_mps: 0.5}",
            )

    def _expose(
        self, world: W, bases: Sequence[Pose], mounts: Sequence[Mapping[str, Pose]], wanted: tuple[str, ...]
    ) -> Sequence[Frame | None]:
        if not any(name in PICTURES for name in wanted):
            return [None] * len(bases)
        camera = self.robot.camera
        eyes = [base @ mount[camera.frame] for base, mount in zip(bases, mounts, strict=True)]
        return world.render(camera, eyes, rgb="image_rgb" in wanted)

    def _random(self, sensor: str) -> np.random.Generator:
        return randomness.generator(self._seed, sensor, self._instant)

    def _scanners(self, wanted: tuple[str, ...]) -> dict[str, Laser | Lidar]:
        """Return the scanners that are asked; raises BenchbotError when the robot has none."""
        scanners = {"laser": self.robot.laser, "lidar": self.robot.lidar}
        asked: dict[str, Laser | Lidar] = {}
        for name in (name for name in scanners if name in wanted):
            scanner = scanners[name]
            if scanner is None:
                raise self._lacks(name)
            asked[name] = scanner
        return asked

    def _seen(self, wanted: Iterable[str], frame: Frame | None, scans: Mapping[str, Any]) -> Observations:
        """Return the channels in the order in which they are wanted."""
        seen: Observations = {}
        camera = self.robot.camera
        for name in wanted:
            match name:
                case "image_rgb" if frame:
                    seen["image_rgb"] = camera.rgb(frame, partial(self._random, "image_rgb"), self.response)
                case "image_depth" if frame:
                    seen["image_depth"] = camera.depth(frame, partial(self._random, "image_depth"))
                case "image_segment" if frame:
                    seen["image_segment"] = self.sightings.segment(frame)
                case "image_rgb_info" | "image_depth_info" | "image_segment_info":
                    seen[name] = camera.info()
                case "laser" | "lidar":
                    seen[name] = scans[name]
                case "imu":
                    seen["imu"] = self._measured_inertia()
                case "joint_states":
                    seen["joint_states"] = self.joint_states()
                case "poses":
                    base = self.odometry() if self.spec.localisation == "noisy" else self.pose()
                    poses = self.robot.poses(base, self._start_pose, self.mounts())
                    seen["poses"] = {frame: pose.record(self.robot.global_frame) for frame, pose in poses.items()}
        return seen

    def _measured_inertia(self) -> InertialMeasurement:
        imu = self.robot.imu
        if imu is None:
            raise self._lacks("imu")
        return imu.measure(self._motion, self.robot.mounts.get(imu.frame, Pose()), self._random("imu"))

    def _lacks(self, sensor: str) -> BenchbotError:
        return BenchbotError(
            f"The robot '{self.robot.name}' has no {sensor}.",
            f"Its declaration has no '{sensor}'.",
            "Choose a robot that has one, such as carter_lidar, or a task that does not observe it.",
        )
