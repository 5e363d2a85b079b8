"""A folder with all official add-ons of BenchBot v2, in their layout: what they declare, with contents of our own."""

import json
from pathlib import Path
from typing import Any

import yaml

SSU = ["image_depth", "image_depth_info", "image_rgb", "image_rgb_info", "laser", "poses"]
SEGMENT = ["image_segment", "image_segment_info"]
WAYS = {"passive:ground_truth": ["move_next"], "active:ground_truth": ["move_angle", "move_distance"]}
WAYS["active:dead_reckoning"] = WAYS["active:ground_truth"]
POSE = [1, 0, 0, 0, 0, 0, 0]


def make(folder: Path) -> Path:
    """Write the add-ons as `benchbot_install` had cloned them: `folder/benchbot-addons/NAME`."""
    files: dict[str, Any] = {}
    for kind, name, scenes, results_format in (
        ("semantic_slam", "tasks_ssu", 1, "object_map"),
        ("scd", "tasks_ssu", 2, "object_map_with_states"),
        ("data_collect", "tasks_data_collect", 1, None),
    ):
        for way, actions in WAYS.items():
            task = {
                "name": f"{kind}:{way}",
                "type": "sim_unreal",
                "actions": actions,
                "observations": SSU + (SEGMENT if results_format is None else []),
                "localisation": "noisy" if "dead" in way else "ground_truth",
                "scene_count": scenes,
            }
            task |= {} if results_format is None else {"results_format": results_format}
            files[f"{name}/tasks/{kind}_{way.replace(':', '_')}.yaml"] = task
    for name, environments in (
        ("develop_1", ["miniroom:1", "house:1"]),
        ("challenge_4", ["office:1:2", "company:1:2"]),
    ):
        for repository in ("batches_bear", "batches_isaac"):
            files[f"{repository}/batches/{name}.yaml"] = {"name": name, "environments": environments}
    for repository, kind, place in (
        ("envs_bear_develop_sim_omni", "sim_omni", "miniroom"),
        ("envs_isaac_develop", "sim_unreal", "miniroom"),
        ("envs_bear_challenge_sim_omni", "sim_omni", "office"),
    ):
        environment = {"name": place, "variant": 1, "type": kind, "map_path": ".sim_data/x.usd", "start_pose": POSE}
        files[f"{repository}/environments/{place}_1.yaml"] = environment
        files[f"{repository}/.remote"] = f"https://example.org/{repository}.zip environments\n"
    truth = {
        "environment": {"name": "miniroom", "variant": 1},
        "format": {"name": "object_map_ground_truth", "functions": {"create": "object_map_ground_truth.create"}},
        "ground_truth": {"objects": [], "class_list": ["cup"], "synonyms": {}},
    }
    files["ground_truths_bear_develop/ground_truths/miniroom_1.json"] = truth
    for name in ("object_map", "object_map_with_states", "object_map_ground_truth"):
        functions = {"create": f"{name}.create"} | ({} if "truth" in name else {"validate": f"{name}.validate"})
        files[f"formats_object_map/formats/{name}.yaml"] = {"name": name, "functions": functions}
        files[f"formats_object_map/formats/{name}.py"] = "raise SystemExit('it was run')\n"
    files["eval_omq/evaluation_methods/omq.yaml"] = {
        "name": "omq",
        "valid_result_formats": ["object_map", "object_map_with_states"],
        "valid_ground_truth_formats": ["object_map_ground_truth"],
        "functions": {"evaluate": "omq.evaluate", "combine": "omq.combine"},
    }
    files["eval_omq/evaluation_methods/omq.py"] = "raise SystemExit('it was run')\n"
    files["eval_omq/.dependencies"] = "benchbot-addons/formats_object_map\n"
    files["eval_omq/.dependencies-python"] = "numpy\n"
    for repository, names in (
        ("examples_base", ["hello_active", "hello_args", "hello_benchbot", "hello_passive"]),
        ("examples_ssu", ["hello_scd", "hello_eval_scd", "aigym_scd"]),
    ):
        for name in names:
            files[f"{repository}/examples/{name}.yaml"] = {"name": name, "native_command": f"python3 .{name}/{name}"}
            files[f"{repository}/examples/.{name}/{name}"] = "from benchbot_api import BenchBot\nBenchBot()\n"
    for repository, name, kind in (
        ("robots_isaac", "carter", "sim_unreal"),
        ("robots_isaac", "carter_remote", "sim_unreal"),
        ("robots_sim_omni", "carter_omni", "sim_omni"),
    ):
        files[f"{repository}/robots/{name}.yaml"] = {
            "name": name,
            "type": kind,
            "address": "benchbot_robot:10000",
            "global_frame": "map",
            "robot_frame": "robot",
            "poses": ["robot"],
            "run_cmd": "touch executed",
            "connections": {"poses": {"connection": "ros_to_api"}},
        }
    files["ssu/.dependencies"] = "".join(
        f"benchbot-addons/{name}\n" for name in ("tasks_ssu", "robots_sim_omni", "eval_omq", "examples_ssu")
    )
    for name, content in files.items():
        path = folder / "benchbot-addons" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        text = content if isinstance(content, str) else yaml.safe_dump(content)
        path.write_text(json.dumps(content) if name.endswith(".json") else text)
    return folder
