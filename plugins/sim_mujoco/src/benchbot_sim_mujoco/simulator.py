"""The simulator: a robot on wheels in one of BenchBot's rooms, as one platform."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from benchbot.plugin import (
    BenchbotError,
    JointStates,
    Outcome,
    PlatformSpec,
    Pose,
    Scene,
    Witnessed,
    did_you_mean,
    load_plugins,
)
from benchbot.simulation import Camera, Frame, KinematicSimulator, Robot, SrgbResponse, State, World
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import Instance, SceneGeometry, only
from benchbot_scenes.scene_file import scene_file
from benchbot_sim_mujoco import opengl
from benchbot_sim_mujoco.arm import Arm, ArmDeclaration
from benchbot_sim_mujoco.drawing import Drawing
from benchbot_sim_mujoco.model import TIMESTEP_S
from benchbot_sim_mujoco.physics import Physics

Floats = npt.NDArray[np.float64]

REST_TIMEOUT_S = 3.0
MARGIN_M = 0.005
"""The footprint is taken for larger where contact is foreseen: wheels follow a plan within millimetres."""


class MujocoSimulator(KinematicSimulator["_World"]):
    """Implements `benchbot.plugin.Simulation`: limits and ramps are those of the robot, its motion is physics.

    `loose` among the options of the environment, or of who starts the simulator (these win), lists objects that can be
    pushed, by the names of instances or of classes. Touching them is no collision. `pictures` names another simulator
    that takes the pictures, such as `sim_taichi`.
    """

    title = "The MuJoCo simulator"

    def __init__(self, spec: PlatformSpec) -> None:
        super().__init__(spec)
        self._worlds: dict[tuple[Path, str, float], _World] = {}
        self._arm = ArmDeclaration.of(spec.robot)
        self._told: Floats | None = None

    def open(self, scene: Scene) -> "_World":
        """Return the world of a scene; one that was loaded before is used again, so that a reset is quick."""
        ways = ("start_pose", "trajectory_poses", "loose_objects")
        place = {name: value for name, value in scene.environment.items() if name not in ways}
        key = (scene.folder, repr(place), scene.start_pose.translation_xyz[2])
        if key not in self._worlds:
            self._worlds[key] = _World(scene, self.spec, self.robot, self._arm)
        self.response = self._worlds[key].response
        return self._worlds[key]

    def load(self, scene: Scene, seed: int) -> None:
        """Put robot and objects where the scene begins; raises BenchbotError when they do not stay there."""
        super().load(scene, seed)
        self.world.physics.load(scene.start_pose, scene.environment.get("loose_objects", ()))
        self.world.revision += 1

    def advance(self, linear_mps: float, angular_radps: float, duration_s: float) -> tuple[State, bool]:
        """Step the physics; after contact the wheels brake."""
        physics = self.world.physics
        before = physics.wheel_angles_rad
        contact = physics.advance(linear_mps, angular_radps, duration_s, self.robot.limits, self._told)
        left, right = (now - then for now, then in zip(physics.wheel_angles_rad, before, strict=True))
        self._rolled = physics.wheels.way(left, right)
        return physics.state, contact

    def measured(self, before: State) -> tuple[State, State]:
        """Return the motion that the wheels have rolled, whether or not they slipped."""
        way_m, turn_rad = self._rolled
        return State(0.0, 0.0, -turn_rad / 2), State(way_m, 0.0, turn_rad / 2)

    def place(self, base: Pose) -> None:
        """Put the robot, at rest, at a pose in the map frame."""
        super().place(base)
        self.world.physics.place(base)

    def pose(self) -> Pose:
        """Return the true pose of the base, which rocks by fractions of a degree when it accelerates."""
        return self.world.physics.pose

    def manipulate(self, action: str, arguments: Mapping[str, Any]) -> Iterator[Outcome | None]:
        """Carry out an action of the arm, tick by tick; yield at the end how it ended, at rest."""
        physics, arm = self.world.physics, self.arm()
        path = arm.planned(action, arguments, physics.data, TIMESTEP_S)
        if path is None:
            yield Outcome.UNREACHABLE
            return
        per_tick = round(self.control_period_s / TIMESTEP_S)
        for first in range(0, len(path), per_tick):
            yield from self._tick(path[first : first + per_tick])
            if self.collided:
                yield Outcome.COLLIDED
                return
            if action != "move_gripper" and arm.lags(path[min(first + per_tick, len(path)) - 1], physics.data):
                held = np.append(arm.joints(physics.data), path[-1, -1])
                yield from self._rest("move_joints", held)
                yield Outcome.COLLIDED if self.collided else Outcome.BLOCKED
                return
        ended = yield from self._rest(action, path[-1])
        yield Outcome.COLLIDED if self.collided else ended

    def _tick(self, told: Floats) -> Iterator[None]:
        self._told = told
        try:
            self.drive(0.0, 0.0, self.control_period_s)
        finally:
            self._told = None
        yield None

    def _rest(self, action: str, target: Floats) -> Generator[None, None, Outcome]:
        """Hold a target until nothing moves any more; return how the action has ended."""
        physics, arm = self.world.physics, self.arm()
        for _ in range(round(REST_TIMEOUT_S / self.control_period_s)):
            yield from self._tick(target[None])
            ended = arm.ended(action, target, physics.data)
            if ended is not None or self.collided:
                return ended or Outcome.COLLIDED
        return Outcome.TIMEOUT

    def witnessed(self) -> Witnessed | None:
        """Return where loose objects are, which of them a finger touches, and what the arm has spent."""
        physics = self.world.physics
        if not physics.loose:
            return None
        objects = {name: physics.centre(name) for name in physics.loose}
        if physics.arm is None:
            return Witnessed(objects)
        return Witnessed(objects, physics.arm.touched(physics.data), physics.energy_j, physics.end_effector_path_m)

    def mounts(self) -> Mapping[str, Pose]:
        """Return where frames are in the robot's frame now: that of the fingers moves."""
        physics = self.world.physics
        if physics.arm is None:
            return self.robot.mounts
        return {**self.robot.mounts, physics.arm.declared.frame: physics.arm.pose(physics.data)}

    def joint_states(self) -> JointStates:
        """Return the states of the arm's joints and of its gripper."""
        names, positions, velocities, efforts = self.arm().states(self.world.physics.data)
        return {"names": names, "positions": positions, "velocities": velocities, "efforts": efforts}

    def arm(self) -> Arm:
        """Return the arm of the robot in the scene; raises BenchbotError when it has none."""
        arm = self.world.physics.arm
        if arm is None:
            raise BenchbotError(
                f"The robot '{self.robot.name}' has no arm.",
                "Its declaration has no key 'arm'.",
                "Choose a robot that has one, such as carter_arm (benchbot list robots).",
            )
        return arm

    def provenance(self) -> dict[str, str]:
        """Return what results depend on to the byte: MuJoCo's version and what drew pictures, if any were drawn."""
        return {"device": "cpu", "mujoco": mujoco.__version__, **self.world.drawn_by}

    def close(self) -> None:
        """Let go of all scenes."""
        for world in self._worlds.values():
            world.close()
        self._worlds = {}


class _World(World):
    """A loaded scene; pictures and rays are made ready when they are first needed."""

    def __init__(self, scene: Scene, spec: PlatformSpec, robot: Robot, arm: ArmDeclaration | None) -> None:
        environment = scene.environment
        if "map_path" not in environment:
            raise BenchbotError(
                f"The environment '{environment.get('name')}' has no map_path.",
                "A simulated environment needs a scene: a GLB file (glTF 2.0 binary) or a layout.",
                "Add a line such as 'map_path: ../scenes/miniroom_1.glb', relative to the environment's file.",
            )
        if spec.note is not None:
            spec.note(f"the simulator loads the scene {environment['map_path']}")
        source = scene.folder / environment["map_path"]
        self._geometry = load_scene(scene_file(source, spec.cache_dir, environment.get("assets")))
        self.instances = self._geometry.instances
        options = {**environment.get("options", {}), **spec.options}
        opengl.described(options)
        self._loose = _loose(self._geometry, options)
        floor_z_m = scene.start_pose.translation_xyz[2]
        footprint = robot.footprint
        held = ~np.isin(self._geometry.triangle_instance, [instance.index for instance in self._loose.values()])
        self._obstacles = ObstacleMap(
            only(self._geometry, held), floor_z_m + footprint.z_min_m, floor_z_m + footprint.z_max_m
        )
        self.physics = Physics(self._geometry, self._loose, self._obstacles, robot, floor_z_m, arm)
        self._painter = _painter(scene, spec, options)
        self._painted: dict[str, bytes] = {}
        self.response = self._painter[0].response if self._painter else SrgbResponse()
        self.drawn_by: dict[str, str] = {"pictures": str(options["pictures"])} if self._painter else {}

    def close(self) -> None:
        """Let go of what draws."""
        drawing = self.__dict__.pop("_drawing", None)
        if drawing is not None:
            drawing.close()
        if self._painter:
            self._painter[0].close()

    def render(self, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> Sequence[Frame]:
        """Draw a picture from each pose, or have it taken by another simulator."""
        if self._painter:
            frames = self._painted_by(self._painter[1], camera, poses, rgb=rgb)
            return frames if self.physics.arm is None else self._with_robot(frames, camera, poses, rgb=rgb)
        frames = self._shown.render(camera, poses, rgb=rgb)
        self.drawn_by = self.drawn_by or {"opengl": opengl.renderer_name()}
        return frames

    def raycast(
        self, origins: npt.NDArray[np.float64], directions: npt.NDArray[np.float64], range_max_m: float
    ) -> npt.NDArray[np.floating]:
        """Cast rays into everything but the robot."""
        return self._shown.cast(origins, directions, range_max_m)

    def clearance_m(self, x: float, y: float) -> float:
        """Return a planar distance to what cannot be pushed, some millimetres short of it."""
        return self._obstacles.distance_m(x, y) - MARGIN_M

    def covers(self, x: float, y: float) -> bool:
        """Return whether a surface of an obstacle lies above or below a point."""
        return self._obstacles.covers(x, y)

    def _painted_by(self, world: World, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> Sequence[Frame]:
        for name in self._loose:
            transform = self.physics.transform(name)
            if self._painted.get(name) != transform.tobytes():
                world.show_object(name, transform)
                self._painted[name] = transform.tobytes()
        return world.render(camera, poses, rgb=rgb)

    def _with_robot(
        self, frames: Sequence[Frame], camera: Camera, poses: Sequence[Pose], *, rgb: bool
    ) -> Sequence[Frame]:
        """Return pictures of another simulator with the robot, which that one does not know, as drawn here."""
        drawn = self._shown.render(camera, poses, rgb=rgb)
        self.drawn_by["opengl"] = opengl.renderer_name()
        return [_over(ours, theirs) for ours, theirs in zip(drawn, frames, strict=True)]

    @property
    def geometry(self) -> SceneGeometry:
        """The scene as it begins, before an episode moves its objects."""
        return self._geometry

    @property
    def _shown(self) -> Drawing:
        self._drawing.move({name: self.physics.moved(name) for name in self._loose})
        self._drawing.show_robot(self.physics.shapes())
        return self._drawing

    @cached_property
    def _drawing(self) -> Drawing:
        return Drawing(self._geometry, self._loose, self.physics.shapes())


def _over(drawn: Frame, painted: Frame) -> Frame:
    """Return a picture in which the robot of another one, which is no instance, is before what is farther away."""
    is_robot = (drawn.instance == 0) & np.isfinite(drawn.depth_m) & (drawn.depth_m < painted.depth_m)
    return Frame(
        np.where(is_robot[..., None], drawn.rgb, painted.rgb),
        np.where(is_robot, drawn.depth_m, painted.depth_m),
        np.where(is_robot, np.int32(0), painted.instance),
    )


def _painter(
    scene: Scene, spec: PlatformSpec, options: Mapping[str, Any]
) -> tuple[KinematicSimulator[World], World] | None:
    """Return another simulator that takes the pictures, with its world of the scene; None where none is asked for."""
    name = options.get("pictures", "sim_mujoco")
    if name == "sim_mujoco":
        return None
    pool = load_plugins().pool("simulators")
    painter = None
    if name in pool:
        others = {key: value for key, value in spec.options.items() if key not in ("pictures", "loose")}
        painter = pool[name].value.create(replace(spec, options={**others, "device": "cpu"}))
    if not isinstance(painter, KinematicSimulator):
        known = sorted(pool)
        raise BenchbotError(
            f"No pictures come from '{name}'.",
            f"options.pictures names a simulator that stands on benchbot.simulation.{did_you_mean(str(name), known)}",
            "Choose sim_taichi, or leave the option away for the pictures of MuJoCo.",
        )
    return painter, painter.open(scene)


def _loose(geometry: SceneGeometry, options: Mapping[str, Any]) -> dict[str, Instance]:
    """Return the loose objects by name; raises BenchbotError for a name that is none, or of two objects."""
    asked = options.get("loose", [])
    asked = [asked] if isinstance(asked, str) else asked
    known = {name for instance in geometry.instances for name in (instance.name, instance.class_name) if name}
    for name in asked:
        if name not in known:
            raise BenchbotError(
                f"There is no object '{name}' in this scene that could be loose.",
                f"options.loose lists names and classes of objects.{did_you_mean(str(name), sorted(known))}",
                "Name objects of the scene, or classes among the environment's object_labels.",
            )
    loose = [instance for instance in geometry.instances if {instance.name, instance.class_name} & set(asked)]
    names = [instance.name for instance in loose]
    for name in names:
        if names.count(name) > 1:
            raise BenchbotError(
                f"Two objects of this scene are called '{name}'.",
                "Each loose object is moved by its name.",
                "Rename one of them in the scene's file, or leave both out of options.loose.",
            )
    return {instance.name: instance for instance in loose}
