"""Collects data: at each step colour, depth, segmentation, laser and poses, as files that everything can read.

FOLDER/miniroom_1/000000/   environment and run; the next run is 000001
    cameras.json            the pinhole models: matrix_intrinsics, matrix_projection, width, height
    classes.json            the names of the numbers in class images
    0000_rgb.png            uint8 (H, W, 3)
    0000_depth.npy          float32 (H, W), metres along the optical axis
    0000_class.npy          uint8 (H, W), and 0000_instance.npy, uint16 (H, W), where the task has segmentation
    0000_laser.npy          float64 (N, 2): range in metres, angle in radians
    0000_poses.json         frame: translation_xyz in metres, rotation_xyzw, rotation_rpy in radians
"""

import argparse
import itertools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchbot.api import ActionResult, BenchBot, Observations

LOOK_AROUND = 12


def new_folder(root: Path, environment: Mapping[str, Any]) -> Path:
    """Make and return the folder of this run: the first number that is not taken."""
    parent = root / f"{environment['name']}_{environment['variant']}"
    for number in itertools.count():
        folder = parent / f"{number:06d}"
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        return folder
    raise AssertionError("numbers do not end")


def save(folder: Path, step: int, observations: Observations) -> None:
    """Write the observations of one step; what the task does not have is left out."""
    stem = f"{step:04d}"
    if "image_rgb" in observations:
        Image.fromarray(observations["image_rgb"]).save(folder / f"{stem}_rgb.png")
    arrays: dict[str, NDArray[Any] | None] = {
        "depth": observations.get("image_depth"),
        "laser": observations.get("laser", {}).get("scans"),
    }
    segments = observations.get("image_segment", {})
    arrays |= {"class": segments.get("class_segment_img"), "instance": segments.get("instance_segment_img")}
    for name, array in arrays.items():
        if array is not None:
            np.save(folder / f"{stem}_{name}.npy", array)
    write_json(folder / f"{stem}_poses.json", observations.get("poses", {}))


def save_models(folder: Path, observations: Observations) -> None:
    """Write what stays the same from step to step: camera models and class names."""
    cameras = {name: model for name, model in observations.items() if name.endswith("_info")}
    write_json(folder / "cameras.json", cameras)
    write_json(folder / "classes.json", observations.get("image_segment", {}).get("class_ids", {}))


def write_json(path: Path, value: object) -> None:
    """Write a value as JSON, arrays as lists."""
    path.write_text(json.dumps(value, indent=1, default=np.ndarray.tolist), encoding="utf-8")


def collect(benchbot: BenchBot, root: Path, most_steps: int) -> ActionResult:
    """Go through the current scene and save what is seen: along the trajectory, or turning once around."""
    observations, result = benchbot.step(None)
    folder = new_folder(root, benchbot.environment_details[observations["scene_number"]])
    print(f"Saving in {folder}", flush=True)
    save_models(folder, observations)
    for step in itertools.count():
        save(folder, step, observations)
        if result is not ActionResult.SUCCESS or step == most_steps:
            return result
        if "move_next" in benchbot.actions:
            observations, result = benchbot.step("move_next")
        elif step < LOOK_AROUND:
            observations, result = benchbot.step("move_angle", angle=360 / LOOK_AROUND)
        else:
            return result
    raise AssertionError("numbers do not end")


def main(root: Path, most_steps: int) -> None:
    """Collect the data of every scene."""
    benchbot = BenchBot()
    benchbot.reset()
    while collect(benchbot, root, most_steps) is not ActionResult.COLLISION and benchbot.next_scene():
        pass
    Path(benchbot.result_filename).write_text(json.dumps(benchbot.empty_results()), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where to save: a full path")
    parser.add_argument("--steps", type=int, default=1000, help="take at most so many steps in a scene")
    given = parser.parse_args()
    if not given.folder.is_absolute():
        parser.error(f"'{given.folder}' is not a full path. Write for example: $PWD/{given.folder}")
    main(given.folder, given.steps)
