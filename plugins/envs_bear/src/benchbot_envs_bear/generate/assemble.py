"""Put an environment together and write its scene, declaration and ground truth, always from one run."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from benchbot_assets_household.generate.gltf import write_glb
from benchbot_assets_household.generate.model import SceneObject, bounds, triangle_count
from benchbot_envs_bear.generate.miniroom import LIGHTING, miniroom
from benchbot_envs_bear.generate.published import Published, load_published

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_SCENES = {("miniroom", "1"): (miniroom, LIGHTING, "A sunny bed-sitting room with a kitchenette and a dining corner.")}


def environments() -> list[str]:
    """The environments that can be generated, as `name:variant`."""
    return [":".join(key) for key in _SCENES]


def generate(name: str, variant: str, folder: Path) -> str:
    """Write scenes/, environments/ and ground_truths/ under `folder`; return a summary line."""
    build_scene, lighting, description = _SCENES[name, variant]
    layout = load_published(name, variant)
    objects = build_scene(layout)
    stem = f"{name}_{variant}"
    environment = declaration(layout, lighting, description)
    truth = ground_truth(environment, layout, objects)
    paths = {kind: folder / kind for kind in ("scenes", "environments", "ground_truths")}
    for path in paths.values():
        path.mkdir(parents=True, exist_ok=True)
    scene = paths["scenes"] / f"{stem}.glb"
    write_glb(scene, objects, generator="benchbot-envs-bear")
    text = yaml.safe_dump(environment, sort_keys=False, default_flow_style=None, width=110)
    (paths["environments"] / f"{stem}.yaml").write_text(text, encoding="utf-8")
    (paths["ground_truths"] / f"{stem}.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    triangles = sum(triangle_count(item.model) for item in objects)
    return f"{stem}: {len(objects)} nodes, {triangles} triangles, {scene.stat().st_size / 1e6:.2f} MB"


def declaration(layout: Published, lighting: dict[str, Any], description: str) -> dict[str, Any]:
    """The environment's declaration."""
    return {
        "name": layout.name,
        "variant": int(layout.variant),
        "type": "sim_taichi",
        "map_path": f"../scenes/{layout.name}_{layout.variant}.glb",
        "description": description,
        "start_pose": list(layout.start_pose),
        "trajectory_poses": [list(pose) for pose in layout.trajectory_poses],
        "object_labels": [label for label in layout.class_list if label != "background"],
        "lighting": lighting,
    }


def ground_truth(environment: dict[str, Any], layout: Published, objects: Sequence[SceneObject]) -> dict[str, Any]:
    """The object map of the scene's own vertices, in the form of BenchBot 2's ground truths."""
    return {
        "environment": environment,
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {
            "objects": [_entry(item) for item in objects if item.category is not None],
            "class_list": list(layout.class_list),
            "synonyms": layout.synonyms,
        },
    }


def _entry(item: SceneObject) -> dict[str, Any]:
    low, high = (np.asarray(corner, np.float32).astype(float) for corner in bounds(item.model))
    return {
        "class": item.category,
        "ID_name": item.instance,
        "centroid": [round(float(value), 6) for value in (low + high) / 2],
        "extent": [round(float(value), 6) for value in high - low],
        "isgroup": item.is_group,
    }
