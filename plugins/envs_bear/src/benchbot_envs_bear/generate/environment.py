"""An environment made from a layout: its declaration, ground truth and map, always written from one run."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from benchbot_envs_bear.generate.published import load_published
from benchbot_scenes.free_space import free_space
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.ground_truth import ground_truth
from benchbot_scenes.layout import write_layout
from benchbot_scenes.occupancy_map import write_occupancy_map
from benchbot_scenes.scene_file import scene_file

if TYPE_CHECKING:
    from benchbot_scenes.layout import Layout
    from benchbot_scenes.scene import SceneGeometry

Pose = tuple[float, ...]

# The footprint's heights in the declaration of the robot carter.
ROBOT_HEIGHTS_M = (0.03, 1.10)


@dataclass(frozen=True)
class Environment:
    """What an environment is made of. Poses are [qw, qx, qy, qz, x, y, z] on the floor, turned about z only."""

    name: str
    variant: int
    description: str
    layout: Layout
    start_pose: Pose
    trajectory_poses: tuple[Pose, ...]
    lighting: dict[str, Any]


def write(environment: Environment, folder: Path) -> str:
    """Write layouts/, environments/, ground_truths/ and maps/ under `folder`; return a summary line."""
    stem = f"{environment.name}_{environment.variant}"
    paths = {kind: folder / kind for kind in ("layouts", "environments", "ground_truths")}
    for path in paths.values():
        path.mkdir(parents=True, exist_ok=True)
    layout = paths["layouts"] / f"{stem}.yaml"
    write_layout(layout, environment.layout)
    with tempfile.TemporaryDirectory() as cache:
        geometry = load_scene(scene_file(layout, Path(cache)))
    document = declaration(environment)
    text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=110)
    (paths["environments"] / f"{stem}.yaml").write_text(text, encoding="utf-8")
    truth = ground_truth(geometry, document)
    (paths["ground_truths"] / f"{stem}.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    write_map(folder, stem, geometry, environment.start_pose)
    named = sum(instance.class_name is not None for instance in geometry.instances)
    return f"{stem}: {named} objects in {len(geometry.instances)} nodes, {len(geometry.triangles)} triangles"


def write_map(folder: Path, stem: str, geometry: SceneGeometry, start_pose: Pose) -> None:
    """Write the occupancy map of what a robot of carter's height meets, in the format of ROS's map_server."""
    space = free_space(geometry, *ROBOT_HEIGHTS_M)
    write_occupancy_map(folder / "maps" / stem, space, (start_pose[4], start_pose[5]))


def declaration(environment: Environment) -> dict[str, Any]:
    """The environment's declaration."""
    return {
        "name": environment.name,
        "variant": environment.variant,
        "type": "sim_taichi",
        "map_path": f"../layouts/{environment.name}_{environment.variant}.yaml",
        "description": environment.description,
        "start_pose": list(environment.start_pose),
        "trajectory_poses": [list(pose) for pose in environment.trajectory_poses],
        "object_labels": object_labels(),
        "lighting": environment.lighting,
    }


def object_labels() -> list[str]:
    """The 30 classes that BEAR's maps name, in the published order."""
    return [label for label in load_published("miniroom", "1").class_list if label != "background"]
