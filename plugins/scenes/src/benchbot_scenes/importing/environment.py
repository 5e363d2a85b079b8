"""A whole environment from a file: scene, declaration, ground truth, map and report, as an add-on folder."""

import json
import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from benchbot.plugin import BenchbotError, editor_line, write_editor_schema
from benchbot_scenes.free_space import free_space
from benchbot_scenes.ground_truth import BACKGROUND, mapped_objects
from benchbot_scenes.importing import doors, light, splat_alignment
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.importing.guesses import Guesses, write_guesses
from benchbot_scenes.importing.labels import Labelled, OrientedBox
from benchbot_scenes.importing.planning import Room, find_room, plan
from benchbot_scenes.importing.splat_alignment import Alignment
from benchbot_scenes.importing.understanding import Understood, understand
from benchbot_scenes.importing.vocabulary import CLASSES
from benchbot_scenes.occupancy_map import write_occupancy_map
from benchbot_scenes.scene import SceneGeometry, only
from benchbot_scenes.visibility import Observer

OPEN_BELOW, ROOFED_ABOVE = 0.05, 0.95
NO_DAYLIGHT = {
    "sun": {"azimuth_deg": 0.0, "elevation_deg": 45.0, "irradiance": [0.0, 0.0, 0.0]},
    "sky": {"zenith": [0.0, 0.0, 0.0], "horizon": [0.0, 0.0, 0.0], "ground": [0.0, 0.0, 0.0]},
}
"""For closed scenes: what falls on a house from outside would only confuse the exposure."""
GUESSES_FILE = "guesses.yaml"
LEAST_POSES = 5


@contextmanager
def _silent(_what: str) -> Iterator[None]:
    yield


@dataclass(frozen=True)
class Imported:
    """An environment that was made: what the file was taken for, where the robot can go, and its declaration."""

    understood: Understood
    geometry: SceneGeometry
    room: Room
    declaration: dict[str, Any]
    ground_truth: dict[str, Any]
    unseen: tuple[str, ...]
    guesses: Guesses
    reasons: dict[str, str]
    notes: tuple[str, ...]
    alignment: Alignment | None = None

    @property
    def shows_nothing(self) -> bool:
        """True if the robot hardly moves and sees none of the objects."""
        found = self.ground_truth["ground_truth"]["objects"]
        return len(self.declaration["trajectory_poses"]) < LEAST_POSES and len(self.unseen) >= len(found)


def build(
    path: Path,
    name: str,
    robot: Observer,
    known: Guesses,
    labelled_by: Path | Literal["none"] | None = None,
    stage: Callable[[str], AbstractContextManager[None]] = _silent,
    splats: Path | None = None,
) -> Imported:
    """Analyse a file and propose an environment in it; raise BenchbotError if that is impossible.

    `stage` is entered with a sentence for each part of the work. `splats` names a file of splats of the same place.
    """
    with stage(f"Reading {path.name}"):
        understood = understand(path, known, labelled_by, splats)
    with stage("Looking for room to move"):
        understood = without_doors(understood, robot, known)
        room = find_room(understood.geometry, robot, known.start_pose)
    geometry, reasons, notes = understood.geometry, dict(understood.reasons), list(understood.notes)
    notes.append(_about_roof(light.roofed_share(geometry, room.space, room.reached)))
    dark = light.is_dark(geometry, room.start[:2])
    if dark:
        geometry, lamps = light.with_lamps(geometry, room.space, room.reached)
        notes.append(
            f"It is closed and nothing in it shines: ceiling lamps were added, {len(lamps)} in all."
            if lamps
            else "It is closed and nothing in it shines: pictures will be black."
        )
    with stage("Planning a trajectory past all objects"):
        coverage = plan(geometry, room.start, robot)
    if len(coverage.poses) < LEAST_POSES:
        notes.append(
            f"The trajectory has only {len(coverage.poses)} poses: the robot can hardly move from where it starts. "
            "Name another place (--start X,Y), a smaller robot (--robot), or what is in its way (hidden)."
        )
    alignment = None
    if geometry.splats is not None:
        with stage("Comparing the splats with the mesh"):
            alignment = splat_alignment.measure(geometry, coverage.poses)
        notes += _about_splats(alignment)
    x, y, heading = room.start
    half = heading / 2
    declaration: dict[str, Any] = {
        "name": name,
        "variant": 1,
        "type": "sim_taichi",
        "map_path": f"../scenes/{name}_1.glb",
        "description": f"Imported from {path.name}.",
        "start_pose": [round(v, 6) for v in (math.cos(half), 0.0, 0.0, math.sin(half), x, y, 0.0)],
        "trajectory_poses": [list(pose) for pose in coverage.poses],
        "object_labels": list(CLASSES),
    }
    lighting = known.lighting or (NO_DAYLIGHT if dark else None)
    if lighting is not None:
        declaration["lighting"] = lighting
    if known.start_pose is None:
        reasons["start_pose"] = f"x, y, heading in degrees: amid the largest free region, {room.area_m2:.1f} m²"
    return Imported(
        understood=understood,
        geometry=geometry,
        room=room,
        declaration=declaration,
        ground_truth=ground_truth(geometry, declaration, understood.labelled),
        unseen=coverage.unseen,
        guesses=_guessed(understood, room, known),
        reasons=reasons,
        notes=tuple(notes),
        alignment=alignment,
    )


def without_doors(understood: Understood, robot: Observer, known: Guesses) -> Understood:
    """The scene without its closed doors, unless a person has said what is hidden; those of scans are as they are."""
    objects = understood.recognised.objects
    if known.hidden is not None or understood.labelled is not None:
        return understood
    if not any(doors.is_door(found.path) for found in objects):
        return understood
    geometry = understood.geometry
    space = free_space(geometry, robot.z_min_m, robot.z_max_m)
    closed = [objects[number - 1] for number in doors.closed(geometry, objects, space)]
    names = {found.name for found in closed}
    is_left = np.array([True, *(found.name not in names for found in geometry.instances)])[geometry.triangle_instance]
    if not names or not is_left.any():
        return understood
    colliders = (*understood.recognised.colliders, *(found.path[-1] for found in closed))
    shown = ", ".join(sorted(names)[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
    note = f"Doors are left out, so that the robot can pass: {shown}. To keep one, take it from hidden in guesses.yaml."
    return replace(
        understood,
        geometry=only(geometry, is_left),
        recognised=replace(understood.recognised, colliders=colliders),
        notes=(*understood.notes, note),
    )


def write(imported: Imported, folder: Path) -> None:
    """Write the add-on folder, which `--addons FOLDER` takes; raises BenchbotError when it cannot be written."""
    stem = f"{imported.declaration['name']}_{imported.declaration['variant']}"
    try:
        for kind in ("environments", "ground_truths", "maps", "scenes"):
            (folder / kind).mkdir(parents=True, exist_ok=True)
        (folder / "scenes" / f"{stem}.glb").write_bytes(to_glb(imported.geometry))
        text = yaml.safe_dump(imported.declaration, sort_keys=False, default_flow_style=None, width=110)
        write_editor_schema(folder, "environment")
        declaration = editor_line("environment") + text
        (folder / "environments" / f"{stem}.yaml").write_text(declaration, encoding="utf-8")
        truth = json.dumps(imported.ground_truth, indent=1) + "\n"
        (folder / "ground_truths" / f"{stem}.json").write_text(truth, encoding="utf-8")
        write_occupancy_map(folder / "maps" / stem, imported.room.space, imported.room.start[:2])
        source = imported.declaration["description"].removeprefix("Imported from ").removesuffix(".")
        write_guesses(folder / GUESSES_FILE, imported.guesses, imported.reasons, source)
    except OSError as error:
        raise BenchbotError(
            f"The environment cannot be written to {folder}",
            f"{error.filename}: {error.strerror}",
            "Name another folder: --output-location FOLDER",
        ) from error


def _about_roof(share: float) -> str:
    if share < OPEN_BELOW:
        return "It is open from above (a scan without ceiling?): sun and sky shine in."
    if share < ROOFED_ABOVE:
        return f"{share:.0%} of its free floor has something above it; sun and sky shine in elsewhere."
    return "It has a ceiling."


def _about_splats(alignment: Alignment | None) -> list[str]:
    if alignment is None:
        return ["Whether its splats are where its mesh is, was not looked at: that needs benchbot-sim-taichi."]
    told = f"Splats against the mesh: {alignment}."
    if not alignment.is_off:
        return [told]
    advice = "Bring both into one frame, for example in CloudCompare: pictures do not agree with depth and ids."
    return [f"{told} They are not quite where the mesh is. {alignment.cause} {advice}"]


def _guessed(understood: Understood, room: Room, known: Guesses) -> Guesses:
    x, y, heading = room.start
    classes: dict[str, str | None] = {
        found.name: found.class_name for found in understood.recognised.objects if found.class_name is not None
    }
    return replace(
        known,
        units=understood.unit,
        up=understood.up,
        floor_z_m=understood.floor_z_m,
        start_pose=(x, y, round(math.degrees(heading), 3)),
        hidden=tuple(dict.fromkeys(understood.recognised.colliders)),
        classes=classes | known.classes,
    )


def ground_truth(
    geometry: SceneGeometry, declaration: dict[str, Any], labelled: Labelled | None = None
) -> dict[str, Any]:
    """The boxes of the objects that have a class, in the form of BenchBot 2's ground truths.

    Boxes that labels gave count as they were given; those that are turned are beside the axis-aligned ones.
    """
    classes = declaration["object_labels"]
    found = mapped_objects(geometry, classes)
    for entry in found:
        box = None if labelled is None else labelled.boxes.get(entry["ID_name"])
        if labelled is None or box is None:
            continue
        if entry["ID_name"] in labelled.truths:
            low, high = box.bounds
            entry["centroid"] = [round(float(value), 6) for value in (low + high) / 2]
            entry["extent"] = [round(float(value), 6) for value in high - low]
        entry["oriented_box"] = _as_document(box)
    return {
        "environment": declaration,
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {"objects": found, "class_list": [*classes, BACKGROUND]},
    }


def _as_document(box: OrientedBox) -> dict[str, list[float]]:
    """Its middle, full lengths along its own axes, and the turn of these as a quaternion (w, x, y, z)."""
    half = box.points[1:] - box.points[0]
    lengths = np.linalg.norm(half, axis=1)
    axes = (half / np.maximum(lengths, 1e-12)[:, None]).T
    axes[:, 2] *= 1.0 if np.linalg.det(axes) > 0 else -1.0
    x, y, z, w = Rotation.from_matrix(axes).as_quat(canonical=True)
    numbers = {"centroid": box.points[0], "extent": 2 * lengths, "orientation": (w, x, y, z)}
    return {key: [round(float(value), 6) + 0.0 for value in values] for key, values in numbers.items()}
