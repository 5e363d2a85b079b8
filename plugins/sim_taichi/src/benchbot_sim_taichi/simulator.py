"""The simulator: a differential-drive robot in a ray-traced scene, as one platform."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from benchbot.plugin import (
    BenchbotError,
    InertialMeasurement,
    MotionConfig,
    Observations,
    PlatformSpec,
    Pose,
    Scene,
    did_you_mean,
    randomness,
)
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.scene_file import scene_file
from benchbot_sim_taichi import _ti, devices, dynamics, lamps, progress, quality
from benchbot_sim_taichi.collision import Clearance, ObstacleMap, travel
from benchbot_sim_taichi.dynamics import State
from benchbot_sim_taichi.imu import Motion
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.odometry import Odometry
from benchbot_sim_taichi.renderer import Frame, Renderer
from benchbot_sim_taichi.robot import Footprint, Robot
from benchbot_sim_taichi.scanners import Laser, Lidar
from benchbot_sim_taichi.sensors import Labels, Sightings

CONTROL_PERIOD_S = 0.05
PICTURES = ("image_rgb", "image_depth", "image_segment")
CHANNELS = [*PICTURES, *(f"{picture}_info" for picture in PICTURES), "laser", "lidar", "imu", "poses"]


class RayTracedSimulator:
    """Implements `benchbot.core.platform.Platform` in simulated time.

    Options of the environment, or of who starts the simulator (these win): `device` chooses what rays are traced on
    (see `devices`); `quality` and `samples` how pictures are lit (see `quality`). The same pose in the same scene gives
    the same colours and depth on the same device, whatever the seed; the seed is that of odometry and of the sensors'
    noise.
    """

    def __init__(self, spec: PlatformSpec) -> None:
        self._spec = spec
        progress.listen(spec.note)
        self._robot = Robot.from_declaration(spec.robot, MotionConfig.from_robot(spec.robot, spec.localisation))
        self._worlds: dict[tuple[Path, str, float], _World] = {}

    @property
    def control_period_s(self) -> float:
        """20 Hz, as in v2."""
        return CONTROL_PERIOD_S

    def load(self, scene: Scene, seed: int) -> None:
        """Put the robot at the start pose of the scene; raises BenchbotError when it does not fit there.

        A scene that was loaded before is used again, from wherever the robot starts, so that a reset is quick.
        """
        key = _what_is_there(scene)
        if key not in self._worlds:
            self._worlds[key] = _World(scene, self._spec, self._robot.footprint)
        self._world = self._worlds[key]
        self._sightings = Sightings(self._world.labels)
        self._start_pose = scene.start_pose
        x, y, self._base_z_m = self._start_pose.translation_xyz
        self._state = State(x, y, self._start_pose.yaw_rad)
        self._odometry = Odometry(self._state, self._robot.noise.linear, self._robot.noise.angular, seed)
        self._motion = Motion()
        self._seed, self._instant = seed, 0
        self._clock_s = 0.0
        self._collided = False
        self._last_clearance = Clearance(self._world.obstacles, self._robot.footprint.radius_m)
        if self._world.obstacles.covers(x, y) or self._clearance.exactly_m(self._state) < 0:
            raise BenchbotError(
                f"The robot '{self._robot.name}' does not fit at the start of this scene.",
                f"At ({x:g}, {y:g}) its footprint of radius {self._robot.footprint.radius_m:g} m overlaps an obstacle.",
                "Move the environment's start_pose, or choose a smaller robot.",
            )

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the requested channels; pictures share one exposure, and other channels are not rendered."""
        return self.observe_many([self], channels)[0]

    def twin(self) -> Self:
        """Return another simulator of the same robot, not yet loaded, that shares the scenes that either loads."""
        twin = type(self)(self._spec)
        twin._worlds = self._worlds
        return twin

    def observe_many(self, platforms: Sequence[Self], channels: Iterable[str]) -> list[Observations]:
        """Return what each of this simulator's twins observes now, with one launch for the pictures of a scene."""
        wanted = tuple(channels)
        unknown = [name for name in wanted if name not in CHANNELS]
        if unknown:
            raise BenchbotError(
                f"The ray-traced simulator does not simulate '{unknown[0]}'.",
                f"It simulates: {', '.join(CHANNELS)}.{did_you_mean(unknown[0], CHANNELS)}",
                "Choose a task that asks for these only.",
            )
        observed: list[Observations] = [{} for _ in platforms]
        for world in {id(platform._world): platform._world for platform in platforms}.values():
            there = [i for i, platform in enumerate(platforms) if platform._world is world]
            poses = [platforms[i].pose() for i in there]
            frames = self._expose(world, poses, wanted)
            scans = {
                name: scanner.scan(
                    world.renderer,
                    [pose @ self._robot.mounts[scanner.frame] for pose in poses],
                    (platforms[i]._random(name) for i in there),
                )
                for name, scanner in self._scanners(wanted).items()
            }
            for number, (i, frame) in enumerate(zip(there, frames, strict=True)):
                scanned = {name: scan[number] for name, scan in scans.items()}
                observed[i] = platforms[i]._seen(wanted, frame, scanned)
        _ti.save_kernels()
        return observed

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Apply one control tick; at contact the robot stands still, `collided`, for the rest of it."""
        before = self._state
        way = dynamics.drive(before, linear_mps, angular_radps, duration_s, self._robot.limits)
        self._state, contact = travel(before, way, self._clearance)
        self._collided |= contact
        self._clock_s += duration_s
        self._instant += 1
        self._odometry.follow(before, self._state)
        self._motion = self._motion.after(self._state.linear_mps, self._state.angular_radps, duration_s)

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return whether holding this command and then braking would touch something."""
        if self._clearance.exceeds(self._state, self._robot.limits.reach_m(self._state, linear_mps, horizon_s)):
            return False
        way = dynamics.drive_and_brake(self._state, linear_mps, angular_radps, horizon_s, self._robot.limits)
        return travel(self._state, way, self._clearance)[1]

    def pose(self) -> Pose:
        """Return the true pose of the base; it keeps the height of the start pose."""
        return Pose.planar(self._state.x, self._state.y, self._state.yaw_rad, self._base_z_m)

    def odometry(self) -> Pose:
        """Return the base's pose by dead reckoning."""
        return Pose.planar(*self._odometry.pose, self._base_z_m)

    @property
    def velocity(self) -> tuple[float, float]:
        """Linear m/s along +x and angular rad/s about +z."""
        return (self._state.linear_mps, self._state.angular_radps)

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
        self._state = State(x, y, base.yaw_rad)
        self._motion = Motion()
        self._instant += 1

    def move_object(self, name: str, transform: npt.NDArray[np.floating]) -> None:
        """Put the loaded scene's objects of a name where the rigid `transform` (4, 4) takes them from where they began.

        For the time between episodes: what robots see and bump into changes, for all twins in this scene, and stays so
        until it is moved again. Light bounces anew, which takes seconds when the next picture is asked for.
        """
        self._world.move_object(name, transform)

    def provenance(self) -> dict[str, str]:
        """Return the device of the loaded scene, which pictures depend on to the byte."""
        return {"device": str(self._world.device)}

    def halt(self, why: str) -> None:
        """Do nothing: a simulated robot moves inside `drive` only."""

    def close(self) -> None:
        """Let go of all scenes; twins keep them."""
        self._worlds = {}

    @property
    def _clearance(self) -> Clearance:
        # Whoever moves an object, this robot's simulator or a twin, makes a new map.
        if self._last_clearance.obstacles is not self._world.obstacles:
            self._last_clearance = Clearance(self._world.obstacles, self._robot.footprint.radius_m)
        return self._last_clearance

    def _expose(self, world: "_World", bases: Sequence[Pose], wanted: tuple[str, ...]) -> Sequence[Frame | None]:
        if not any(name in PICTURES for name in wanted):
            return [None] * len(bases)
        camera = self._robot.camera
        mount = self._robot.mounts[camera.frame]
        return camera.expose(world.renderer, [base @ mount for base in bases], rgb="image_rgb" in wanted)

    def _random(self, sensor: str) -> np.random.Generator:
        return randomness.generator(self._seed, sensor, self._instant)

    def _scanners(self, wanted: tuple[str, ...]) -> dict[str, Laser | Lidar]:
        """Return the scanners that are asked; raises BenchbotError when the robot has none."""
        scanners = {"laser": self._robot.laser, "lidar": self._robot.lidar}
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
        camera = self._robot.camera
        for name in wanted:
            match name:
                case "image_rgb" if frame:
                    seen["image_rgb"] = camera.rgb(frame, partial(self._random, "image_rgb"))
                case "image_depth" if frame:
                    seen["image_depth"] = camera.depth(frame, partial(self._random, "image_depth"))
                case "image_segment" if frame:
                    seen["image_segment"] = self._sightings.segment(frame)
                case "image_rgb_info" | "image_depth_info" | "image_segment_info":
                    seen[name] = camera.info()
                case "laser" | "lidar":
                    seen[name] = scans[name]
                case "imu":
                    seen["imu"] = self._measured_inertia()
                case "poses":
                    base = self.odometry() if self._spec.localisation == "noisy" else self.pose()
                    poses = self._robot.poses(base, self._start_pose)
                    seen["poses"] = {frame: pose.record(self._robot.global_frame) for frame, pose in poses.items()}
        return seen

    def _measured_inertia(self) -> InertialMeasurement:
        imu = self._robot.imu
        if imu is None:
            raise self._lacks("imu")
        return imu.measure(self._motion, self._robot.mounts.get(imu.frame, Pose()), self._random("imu"))

    def _lacks(self, sensor: str) -> BenchbotError:
        return BenchbotError(
            f"The robot '{self._robot.name}' has no {sensor}.",
            f"Its declaration has no '{sensor}'.",
            "Choose a robot that has one, such as carter_lidar, or a task that does not observe it.",
        )


def _what_is_there(scene: Scene) -> tuple[Path, str, float]:
    """Return what tells worlds apart: all of a scene but where robots start and go, and the height of its floor."""
    ways = ("start_pose", "trajectory_poses")
    place = {name: value for name, value in scene.environment.items() if name not in ways}
    return scene.folder, repr(place), scene.start_pose.translation_xyz[2]


class _World:
    """A loaded scene; what is slow to make is made when it is first needed."""

    def __init__(self, scene: Scene, spec: PlatformSpec, footprint: Footprint) -> None:
        environment = scene.environment
        if "map_path" not in environment:
            raise BenchbotError(
                f"The environment '{environment.get('name')}' has no map_path.",
                "A simulated environment needs a scene: a GLB file (glTF 2.0 binary) or a layout.",
                "Add a line such as 'map_path: ../scenes/miniroom_1.glb', relative to the environment's file.",
            )
        self._spec = spec
        source = scene.folder / environment["map_path"]
        progress.tell(f"the simulator loads the scene {environment['map_path']}")
        self._geometry: SceneGeometry = load_scene(scene_file(source, spec.cache_dir, environment.get("assets")))
        self._lighting = Lighting.from_mapping(environment.get("lighting"))
        lamps.check(self._geometry, self._lighting.lamps)
        self._options = {**environment.get("options", {}), **spec.options}
        self.device = devices.resolve(self._options)
        self._quality = quality.from_options(self._options)
        self.labels = Labels.of(self._geometry.instances, environment.get("object_labels", ()))
        # The base stands on the floor.
        floor_z_m = scene.start_pose.translation_xyz[2]
        self._slab_m = (floor_z_m + footprint.z_min_m, floor_z_m + footprint.z_max_m)
        self.obstacles = ObstacleMap(self._geometry, *self._slab_m)

    def move_object(self, name: str, transform: npt.NDArray[np.floating]) -> None:
        names = [instance.name for instance in self._geometry.instances]
        if name not in names:
            raise BenchbotError(
                f"There is no object '{name}' in this scene.",
                f"It has {len(names)} objects.{did_you_mean(name, names)}",
                "Name one of the scene's instances: a node of its GLB file.",
            )
        for instance in self._geometry.instances:
            if instance.name == name:
                self.renderer.move(instance.index, transform)
        self.renderer.relight()
        self.obstacles = ObstacleMap(self.renderer.scene, *self._slab_m)

    @cached_property
    def renderer(self) -> Renderer:
        kind, cache_dir = self.device.kind, self._spec.cache_dir
        renderer = Renderer(self._geometry, self._lighting, cache_dir=cache_dir, device=kind, quality=self._quality)
        progress.tell("the simulator works out the light of the scene, and compiles what is not compiled yet")
        return renderer
