"""The simulator: a differential-drive robot in a ray-traced scene, as one platform."""

from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, Observations, PlatformSpec, Pose, Scene, did_you_mean
from benchbot.simulation import (
    EXACT,
    QUICK,
    Camera,
    Footprint,
    Frame,
    KinematicRobots,
    KinematicSimulator,
    Response,
    SrgbResponse,
    Trigonometry,
    World,
    matrices,
)
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.obstacle_map import EdgeGrid, ObstacleMap
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.scene_file import scene_file
from benchbot_sim_taichi import _ti, camera_response, devices, lamps, progress, quality
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchbot_sim_taichi.textures import srgb_to_linear


class FilmicResponse:
    """The camera's response: a tone curve before the transfer function of sRGB."""

    def exposed(self, rgb: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return the exposed radiance (H, W, 3) that is shown as these bytes."""
        return camera_response.exposed(srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)[rgb])

    def developed(self, radiance: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
        """Return the bytes of exposed radiance (H, W, 3)."""
        return camera_response.srgb_bytes(camera_response.filmic(np.minimum(radiance, camera_response.BRIGHTEST)))


class RayTracedSimulator(KinematicSimulator["_World"]):
    """Implements `benchbot.plugin.Simulation` and `ManyCameras`.

    Options of the environment, or of who starts the simulator (these win): `device` chooses what rays are traced on
    (see `devices`); `quality` and `samples` how pictures are lit (see `quality`). The same pose in the same scene gives
    the same colours and depth on the same device, whatever the seed; the seed is that of odometry and of the sensors'
    noise.
    """

    title = "The ray-traced simulator"
    response: Response = FilmicResponse()

    def __init__(self, spec: PlatformSpec) -> None:
        super().__init__(spec)
        progress.listen(spec.note)
        self._worlds: dict[tuple[Path, str, float], _World] = {}

    def open(self, scene: Scene) -> "_World":
        """Return the world of a scene; one that was loaded before is used again, so that a reset is quick."""
        key = _what_is_there(scene)
        if key not in self._worlds:
            self._worlds[key] = _World(scene, self.spec, self.robot.footprint)
        self.response = self._worlds[key].response
        return self._worlds[key]

    def twin(self) -> Self:
        """Return another simulator of the same robot, not yet loaded, that shares the scenes that either loads."""
        twin = type(self)(self.spec)
        twin._worlds = self._worlds
        return twin

    @property
    def trigonometry(self) -> Trigonometry:
        """Exact beside a processor's pictures; those of a graphics processor differ in the last bit anyway."""
        return EXACT if self.world.device.kind == "cpu" else QUICK

    def many(self, count: int) -> KinematicRobots | None:
        """Return so many robots whose actions are executed in one launch."""
        from benchbot_sim_taichi.robots_on_device import TracedRobots

        return TracedRobots(self, count) if super().many(count) else None

    def observe_many(self, platforms: Sequence[Self], channels: Iterable[str]) -> list[Observations]:
        """Return what each of this simulator's twins observes now, with one launch for the pictures of a scene."""
        observed = super().observe_many(platforms, channels)
        _ti.save_kernels()
        return observed

    def move_object(self, name: str, transform: npt.NDArray[np.floating]) -> None:
        """Put the loaded scene's objects of a name where the rigid `transform` (4, 4) takes them from where they began.

        For the time between episodes: what robots see and bump into changes, for all twins in this scene, and stays so
        until it is moved again. Light bounces anew, which takes seconds when the next picture is asked for.
        """
        self.world.move_object(name, transform)

    def provenance(self) -> dict[str, str]:
        """Return the device of the loaded scene, which pictures depend on to the byte."""
        return {"device": str(self.world.device)}

    def close(self) -> None:
        """Let go of all scenes; twins keep them."""
        self._worlds = {}


def intrinsics_of(camera: Camera) -> Intrinsics:
    """Return a camera as the renderer has it, which puts the centre of the first pixel at one half."""
    centre = (camera.cx + 0.5, camera.cy + 0.5)
    return Intrinsics(camera.width, camera.height, camera.fx, camera.fy, *centre, camera.distortion)


def _what_is_there(scene: Scene) -> tuple[Path, str, float]:
    """Return what tells worlds apart: all of a scene but where robots start and go, and the height of its floor."""
    ways = ("start_pose", "trajectory_poses")
    place = {name: value for name, value in scene.environment.items() if name not in ways}
    return scene.folder, repr(place), scene.start_pose.translation_xyz[2]


class _World(World):
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
        self.instances = self._geometry.instances
        # Splats have the colours of photographs, which went through another camera's response.
        self.response: Response = FilmicResponse() if self._geometry.splats is None else SrgbResponse()
        # The base stands on the floor.
        floor_z_m = scene.start_pose.translation_xyz[2]
        self._slab_m = (floor_z_m + footprint.z_min_m, floor_z_m + footprint.z_max_m)
        self._obstacles = ObstacleMap(self._geometry, *self._slab_m)

    def render(self, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> Sequence[Frame]:
        """Render all pictures in one batch."""
        frames = self.render_many(camera, poses, rgb=rgb)
        return [frames.row(i) for i in range(len(poses))]

    def render_many(self, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> Frame:
        """Render all pictures in one batch."""
        batch = self.renderer.render_batch(matrices(poses), intrinsics_of(camera), rgb=rgb)
        return Frame(batch.rgb, batch.depth_m, batch.instance)

    def raycast(
        self, origins: npt.NDArray[np.float64], directions: npt.NDArray[np.float64], range_max_m: float
    ) -> npt.NDArray[np.floating]:
        """Cast all rays in one launch."""
        return self.renderer.cast(origins, directions, range_max_m)

    def clearance_m(self, x: float, y: float) -> float:
        """Return the exact planar distance to what lies between the footprint's heights."""
        return self._obstacles.distance_m(x, y)

    def clearances_m(self, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the distances of points (N,) in one pass."""
        return self._obstacles.distances_m(x, y)

    def edge_grid(self) -> EdgeGrid:
        """Return what `clearance_m` looks up."""
        return self._obstacles.grid()

    def covers(self, x: float, y: float) -> bool:
        """Return whether a surface of an obstacle lies above or below a point."""
        return self._obstacles.covers(x, y)

    def show_object(self, name: str, transform: npt.NDArray[np.floating]) -> None:
        """Put objects somewhere else in pictures and rays; light that bounces stays that of before."""
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

    def move_object(self, name: str, transform: npt.NDArray[np.floating]) -> None:
        self.show_object(name, transform)
        self.renderer.relight()
        self._obstacles = ObstacleMap(self.renderer.scene, *self._slab_m)
        self.revision += 1

    @cached_property
    def renderer(self) -> Renderer:
        kind, cache_dir = self.device.kind, self._spec.cache_dir
        renderer = Renderer(self._geometry, self._lighting, cache_dir=cache_dir, device=kind, quality=self._quality)
        if self._geometry.splats is None:
            progress.tell(
                "the simulator works out the light of the scene, and compiles what is not compiled yet: "
                "up to half a minute"
            )
        return renderer
