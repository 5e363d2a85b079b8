"""Exported scenes in the programs that they are for: boxes and masks beside BenchBot's own.

python -m benchmarks exports [--envs miniroom:1 house:1 apartment:1] [--json FILE]

MJCF is opened and drawn by MuJoCo, SDFormat by Drake, USD opened by usd-core and seen by Embree's rays. Masks are the
object of each pixel, whatever its class, in pictures of 320 x 180 from the start and two poses of the trajectory;
BenchBot's own are those of the ray tracer. `boxes` is how far a face of a box is off at most, `masks` the share of
pixels that show the same object, and `beside contours` that of the pixels whose neighbours all show one object.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.plugin_manager import load
from benchbot.core.resources import cache_dir
from benchbot.simulation import KinematicSimulator
from benchbot_scenes.exporting import mjcf, sdf, usd
from benchbot_scenes.exporting.labels import unique_names
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.scene_file import scene_file
from plugins.scenes.tests.exporting import masks, opened, rooms, sdf_schema

CENTRED = {"width": 320, "height": 180, "fx": 160, "fy": 160, "cx": 159.5, "cy": 89.5}
Boxes = Callable[[Path], rooms.Boxes]


def _mujoco_boxes(path: Path) -> rooms.Boxes:
    return opened.mujoco_boxes(mujoco.MjModel.from_xml_path(str(path)), opened.VISUAL)


FORMATS: dict[str, tuple[Any, str, Boxes, Callable[[Path, masks.Eye], masks.Mask]]] = {
    "mjcf": (mjcf, "xml", _mujoco_boxes, masks.of_mjcf),
    "usd": (usd, "usdc", opened.usd_boxes, masks.of_usd),
    "sdf": (sdf, "sdf", opened.drake_boxes, masks.of_sdf),
}


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--envs", nargs="+", default=["miniroom:1", "house:1", "apartment:1"])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print(f"{'':14}{'':6}{'objects':>8}{'boxes, mm':>11}{'masks':>10}{'beside contours':>17}")
    rows = []
    for name in options.envs:
        geometry, eyes, own = _own(name)
        for label in FORMATS:
            with tempfile.TemporaryDirectory() as folder:
                row = {"environment": name, "format": label, **_measured(geometry, label, Path(folder), eyes, own)}
            rows.append(row)
            print(
                f"{name:14}{label:6}{row['objects']:8}{row['boxes_mm']:11.4f}{row['masks']:10.4%}"
                f"{row['beside_contours']:17.4%}",
                flush=True,
            )
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))
    return 0


def _own(name: str) -> tuple[SceneGeometry, list[masks.Eye], list[masks.Mask]]:
    """Return a scene, cameras in it and the masks that the ray tracer has of it."""
    catalog = Catalog(load())
    declared, robot = catalog.get("environments", name), catalog.get("robots", "carter_lowres").data
    scene = Scene(declared.data, declared.path.parent)
    robot = {**robot, "camera": {**robot["camera"], **CENTRED}}
    create = load().pool("simulators")["sim_taichi"].value.create
    simulator = cast(KinematicSimulator[Any], create(PlatformSpec(robot, "ground_truth", cache_dir())))
    simulator.load(scene, 0)
    bases = [scene.start_pose, *scene.trajectory[:: max(len(scene.trajectory) // 2, 1)][:2]]
    camera = simulator.robot.camera
    poses = [base @ simulator.robot.mounts[camera.frame] for base in bases]
    source = scene.folder / declared.data["map_path"]
    geometry = load_scene(scene_file(source, cache_dir(), declared.data.get("assets")))
    names = np.array(["", *(unique_names(geometry)[found.index] for found in geometry.instances)])
    assert [found.index for found in geometry.instances] == list(range(1, len(names)))
    own = [names[frame.instance] for frame in simulator.world.render(camera, poses, rgb=False)]
    simulator.close()
    return geometry, [masks.Eye(320, 180, 160.0, pose.matrix()) for pose in poses], own


def _measured(
    geometry: SceneGeometry, label: str, folder: Path, eyes: Sequence[masks.Eye], own: Sequence[masks.Mask]
) -> dict[str, float]:
    module, suffix, boxes, drawn = FORMATS[label]
    path = opened.written(module.files(geometry, "place"), folder) / f"place.{suffix}"
    if label == "sdf":
        (folder / "schema").mkdir()
        assert sdf_schema.errors(path, folder / "schema") == []
    seen = [drawn(path, eye) == mask for eye, mask in zip(eyes, own, strict=True)]
    inner = [_inner(mask) for mask in own]
    here, there = rooms.boxes(geometry), boxes(path)
    return {
        "objects": len(here),
        "boxes_mm": 1000 * rooms.apart_m(here, {name: there[name] for name in here}),
        "masks": float(np.mean(seen)),
        "beside_contours": float(np.concatenate([one[where] for one, where in zip(seen, inner, strict=True)]).mean()),
    }


def _inner(mask: masks.Mask) -> np.ndarray:
    """Return which pixels have eight neighbours of the same object."""
    padded = np.pad(mask, 1, mode="edge")
    height, width = mask.shape
    around = [padded[down : down + height, right : right + width] for down in range(3) for right in range(3)]
    inner: np.ndarray = np.all([one == mask for one in around], axis=0)
    return inner


if __name__ == "__main__":
    sys.exit(main())
