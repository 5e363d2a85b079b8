"""Views by which environments are compared: what the robot's camera shows of middling poses, and at which times."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.platform import Scene
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.scene_file import scene_file
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer

CAMERA_HEIGHT_M = 1.05
LOOK = Intrinsics.from_horizontal_fov(240, 135, 90.0)
SHEET_BYTES = 170_000
TIMES = {
    "day": {"time": "12:00", "lamps": "none"},
    "evening": {"time": "19:00", "lamps": "all"},
    "night": {"time": "23:00", "lamps": "all"},
}

Poses = npt.NDArray[np.float64]


def shipped() -> list[str]:
    """Names of the simulated environments that have a trajectory."""
    pool = Catalog(plugin_manager.load()).pool("environments")
    simulated = ((name, found.data) for name, found in pool.items() if found.data["type"] == "sim_taichi")
    return sorted(name for name, data in simulated if "trajectory_poses" in data)


def declared(name: str) -> Declaration:
    """The environment of this name."""
    (environment,) = Catalog(plugin_manager.load()).environments(name)
    return environment


def light_at(at: str, declared: Mapping[str, Any]) -> dict[str, Any]:
    """An environment's light at a time of midsummer at 45°, by night with its lamps on."""
    lamps = {**declared.get("lamps", {}), "on": TIMES[at]["lamps"]}
    kept = {key: declared[key] for key in ("north_deg", "turbidity") if key in declared and "time" in declared}
    around = {"exterior": declared["exterior"]} if "exterior" in declared else {}
    return {**kept, **around, "time": TIMES[at]["time"], "lamps": lamps}


def scene_of(environment: Declaration, cache: Path) -> SceneGeometry:
    """An environment's scene; what is made of its layout is kept in `cache`."""
    return load_scene(scene_file(environment.path.parent / environment.data["map_path"], cache))


def camera_poses(environment: Declaration) -> Poses:
    """Where `carter`'s camera is at each pose of the trajectory, the start among them: (N, 4, 4) optical frames."""
    return np.stack(
        [camera_pose(pose.matrix()) for pose in Scene(environment.data, environment.path.parent).trajectory]
    )


def camera_pose(robot_to_map: Poses) -> Poses:
    """A level optical frame above a robot's base."""
    forward, left = robot_to_map[:3, 0], robot_to_map[:3, 1]
    pose = np.eye(4)
    pose[:3, :3] = np.stack([-left, [0.0, 0.0, -1.0], forward], axis=1)
    pose[:3, 3] = robot_to_map[:3, 3] + [0.0, 0.0, CAMERA_HEIGHT_M]
    return pose


def median_places(
    environment: Declaration, scene: SceneGeometry, cache: Path, device: str, count: int = 1
) -> list[int]:
    """Places in the trajectory in the middle of `count` equal parts, from the emptiest view to the fullest.

    A view is the fuller the more instances its picture shows, and among equals the farther away they are (the median
    of depth). One place is the median.
    """
    renderer = Renderer(scene, Lighting(), cache_dir=cache, device=device)
    seen = renderer.render_batch(camera_poses(environment), LOOK, rgb=False)
    fullness = (
        (len(np.unique(instance)), float(np.median(depth_m)))
        for instance, depth_m in zip(seen.instance, seen.depth_m, strict=True)
    )
    return middling(fullness, count)


def middling(values: Iterable[tuple[float, ...]], count: int) -> list[int]:
    """Places of the values in the middle of `count` equal parts of their order."""
    keyed = list(values)
    order = sorted(range(len(keyed)), key=keyed.__getitem__)
    return [order[(2 * part + 1) * len(order) // (2 * count)] for part in range(count)]


def save_sheet(rows: Sequence[npt.NDArray[np.uint8]], path: Path) -> None:
    """Write rows one below the other as JPEG, in as good a quality as `SHEET_BYTES` allow."""
    for quality in range(84, 40, -4):
        Image.fromarray(np.vstack(rows)).save(path, quality=quality, optimize=True, progressive=True)
        if path.stat().st_size <= SHEET_BYTES:
            break
