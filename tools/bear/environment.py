"""An environment's files: its scene, declaration, ground truth and map, always written from one run."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from benchbot_scenes.free_space import free_space
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.ground_truth import ground_truth
from benchbot_scenes.layout import Layout, write_layout
from benchbot_scenes.occupancy_map import write_occupancy_map
from benchbot_scenes.scene_file import scene_file
from tools.bear.published import load_published
from tools.household.gltf import write_glb

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchbot_scenes.scene import SceneGeometry
    from tools.bear.published import Published
    from tools.household.model import SceneObject

Pose = tuple[float, ...]

# The footprint's heights in the declaration of the robot carter.
ROBOT_HEIGHTS_M = (0.03, 1.10)
# What lies behind the windows of each place.
EXTERIORS = {
    "miniroom": {"kind": "trees", "seed": 2},
    "house": {"kind": "trees", "seed": 1},
    "apartment": {"kind": "town", "seed": 3},
    "company": {"kind": "town", "seed": 4},
    "office": {"kind": "town", "seed": 5},
}


@dataclass(frozen=True)
class Environment:
    """An environment to write: a layout of models from packs, or objects of its own.

    Poses are [qw, qx, qy, qz, x, y, z] on the floor, turned about z only.
    """

    name: str
    variant: int
    description: str
    scene: Layout | Sequence[SceneObject]
    start_pose: Pose
    trajectory_poses: tuple[Pose, ...]
    lighting: dict[str, Any]


def as_published(
    published: Published, description: str, scene: Layout | Sequence[SceneObject], lighting: dict[str, Any]
) -> Environment:
    """An environment that starts and drives as published."""
    return Environment(
        published.name,
        int(published.variant),
        description,
        scene,
        published.start_pose,
        published.trajectory_poses,
        lighting,
    )


def write(environment: Environment, folder: Path) -> str:
    """Write scenes/ or layouts/, environments/, ground_truths/ and maps/ under `folder`; return a summary line."""
    stem = f"{environment.name}_{environment.variant}"
    scene = folder / _map_path(environment)
    truths = folder / "ground_truths"
    declarations = folder / "environments"
    for path in (scene.parent, declarations, truths):
        path.mkdir(parents=True, exist_ok=True)
    geometry = _write_scene(environment.scene, scene)
    document = declaration(environment)
    text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=110)
    (declarations / f"{stem}.yaml").write_text(text, encoding="utf-8")
    truth = ground_truth(geometry, document)
    (truths / f"{stem}.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    space = free_space(geometry, *ROBOT_HEIGHTS_M)
    write_occupancy_map(folder / "maps" / stem, space, (environment.start_pose[4], environment.start_pose[5]))
    named = sum(instance.class_name is not None for instance in geometry.instances)
    return f"{stem}: {named} objects in {len(geometry.instances)} nodes, {len(geometry.triangles)} triangles"


def _write_scene(scene: Layout | Sequence[SceneObject], path: Path) -> SceneGeometry:
    if not isinstance(scene, Layout):
        write_glb(path, scene, generator="benchbot-envs-bear")
        return load_scene(path)
    write_layout(path, scene)
    with tempfile.TemporaryDirectory() as cache:
        return load_scene(scene_file(path, Path(cache)))


def _map_path(environment: Environment) -> Path:
    stem = f"{environment.name}_{environment.variant}"
    return Path("layouts", f"{stem}.yaml") if isinstance(environment.scene, Layout) else Path("scenes", f"{stem}.glb")


def declaration(environment: Environment) -> dict[str, Any]:
    """The environment's declaration."""
    return {
        "name": environment.name,
        "variant": environment.variant,
        "type": "sim_taichi",
        "map_path": f"../{_map_path(environment).as_posix()}",
        "description": environment.description,
        "start_pose": list(environment.start_pose),
        "trajectory_poses": [list(pose) for pose in environment.trajectory_poses],
        "object_labels": object_labels(),
        "lighting": {**environment.lighting, "exterior": EXTERIORS[environment.name]},
    }


def object_labels() -> list[str]:
    """The 30 classes that BEAR's maps name, in the published order."""
    return [label for label in load_published("miniroom", "1").class_list if label != "background"]
