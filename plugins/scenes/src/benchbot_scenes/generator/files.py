"""A generated place as an add-on folder: layout, declaration, ground truth, occupancy map and a picture from above."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import yaml

from benchbot.plugin import BenchbotError, editor_line, write_atomically, write_editor_schema, write_json
from benchbot_scenes.compose import compose
from benchbot_scenes.coverage import MARGIN_M, room_of
from benchbot_scenes.free_space import FreeSpace, free_space
from benchbot_scenes.generator.generate import Generated
from benchbot_scenes.gltf import geometry_of
from benchbot_scenes.gltf_file import GltfFile, split_glb
from benchbot_scenes.ground_truth import ground_truth
from benchbot_scenes.importing.vocabulary import CLASSES
from benchbot_scenes.layout import write_layout
from benchbot_scenes.occupancy_map import write_occupancy_map
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.top_down import png, top_down
from benchbot_scenes.visibility import Observer

# A clear spring afternoon; lamps are off.
LIGHTING: dict[str, Any] = {"time": "14:00", "date": "2023-04-20", "latitude_deg": 48, "lamps": {"on": "none"}}


@dataclass(frozen=True)
class Written:
    """The files of a generated place: its declaration, its composed scene, and where a robot may be in that."""

    declaration: Path
    geometry: SceneGeometry
    space: FreeSpace
    objects: int


def declaration(name: str, variant: int, place: Generated, lighting: dict[str, Any], *, hidden: bool) -> dict[str, Any]:
    """The environment's declaration, for a file beside the folder of layouts; nothing in it tells kind or seed."""
    return {
        "name": name,
        "variant": variant,
        "type": "sim_taichi",
        "map_path": f"../layouts/{name}_{variant}.yaml",
        "description": "A generated place.",
        **({"hidden": True} if hidden else {}),
        "start_pose": list(place.start_pose),
        "trajectory_poses": [list(pose) for pose in place.trajectory_poses],
        "object_labels": list(CLASSES),
        "lighting": lighting,
    }


def write_place(
    folder: Path,
    name: str,
    variant: int,
    place: Generated,
    robot: Observer,
    *,
    hidden: bool = False,
    lighting: dict[str, Any] = LIGHTING,
) -> Written:
    """Write environments/, layouts/, ground_truths/ and maps/ under `folder`, and the schema for editors.

    In a `hidden` place nothing runs without a secret. Raises BenchbotError when it cannot.
    """
    stem = f"{name}_{variant}"
    document = declaration(name, variant, place, lighting, hidden=hidden)
    try:
        for kind in ("environments", "layouts", "ground_truths", "maps"):
            (folder / kind).mkdir(parents=True, exist_ok=True)
        write_layout(folder / "layouts" / f"{stem}.yaml", place.layout)
        geometry = scene_of(place)
        space = free_space(geometry, robot.z_min_m, robot.z_max_m)
        truth = ground_truth(geometry, document)
        write_json(folder / "ground_truths" / f"{stem}.json", truth)
        write_occupancy_map(folder / "maps" / stem, space, (place.start_pose[4], place.start_pose[5]))
        path = folder / "environments" / f"{stem}.yaml"
        text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=110)
        write_editor_schema(folder, "environment")
        write_atomically(path, (editor_line("environment") + text).encode())
    except OSError as error:
        raise BenchbotError(
            f"The environment cannot be written to {folder}.",
            f"{error.filename}: {error.strerror}",
            "Name another folder: --output-location FOLDER",
        ) from error
    return Written(path, geometry, space, len(truth["ground_truth"]["objects"]))


def scene_of(place: Generated) -> SceneGeometry:
    """Return the scene of a place, composed unless it was for finding what is seen."""
    return place.scene or geometry_of(GltfFile(*split_glb(compose(place.layout))))[0]


def least_room_m(written: Written, place: Generated, robot: Observer) -> float:
    """Return the room that a place's trajectory leaves; raises BenchbotError when it is less than the robot needs."""
    least_m = room_of(written.geometry, written.space, place.trajectory_poses, robot)
    if least_m < robot.radius_m:
        raise BenchbotError(
            "The trajectory of this place comes too close to something.",
            f"The robot has {least_m:.3f} m about its middle and needs {robot.radius_m + MARGIN_M:.2f} m.",
            "Take another seed, and report this one.",
        )
    return least_m


def write_maps(stem: Path, geometry: SceneGeometry, space: FreeSpace, start: tuple[float, float]) -> list[Path]:
    """Write an occupancy map (STEM.png, STEM.yaml) and a picture from above (STEM_above.png)."""
    return [*write_occupancy_map(stem, space, start), write_picture(stem, geometry)]


def write_picture(stem: Path, geometry: SceneGeometry) -> Path:
    """Write a picture from above (STEM_above.png)."""
    picture = stem.with_name(f"{stem.name}_above.png")
    write_atomically(picture, png(top_down(geometry)))
    return picture


def origin_file(folder: Path) -> Path:
    """The file that says how the place in `folder` was made: beside it, so that it does not travel with the place."""
    folder = folder.resolve()
    return folder.with_name(f"{folder.name}.origin.json")


def pinned(catalogue: Path, secret: Path | None) -> dict[str, Any]:
    """What else a place depends on: versions, and the SHA-256 of its models' catalogue and of the secret's file."""
    files = {"catalogue_sha256": catalogue, "secret_sha256": secret}
    return {
        "versions": {name: version(name) for name in ("benchbot", "benchbot-scenes", "numpy")},
        **{key: sha256(path.read_bytes()).hexdigest() for key, path in files.items() if path is not None},
    }


def write_origin(path: Path, origin: Mapping[str, Any]) -> None:
    """Write how a place was made into a new file that only its user can read; raises BenchbotError when it cannot."""
    try:
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
            json.dump(origin, file, indent=1)
            file.write("\n")
    except OSError as error:
        raise BenchbotError(
            f"{path} cannot be written.",
            f"{error.strerror}. It says how the place was made: {json.dumps(origin)}",
            "Keep that line yourself, or generate the place again into another folder.",
        ) from error
