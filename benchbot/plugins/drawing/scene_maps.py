"""Readers of what is drawn: the maps of a result's scenes, the map of an installed environment, recorded frames."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.core import results
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError
from benchbot.core.platform import Scene
from benchbot.evaluation.frames import numbered_frames
from benchbot.evaluation.ground_truths import GroundTruths, environment_of
from benchbot.plugins.drawing.map_model import (
    MapObject,
    MapPath,
    Points,
    SceneMap,
    driven_paths,
    estimated_objects,
    occupancy_of,
    planar,
    true_objects,
)

OBJECTS = "object_map_ground_truth"


def maps_of_result(path: Path, catalog: Catalog, truth_paths: Sequence[Path] | None = None) -> list[SceneMap]:
    """Return the map of each scene of a result, with its ground truth.

    Raises BenchbotError for a file that is no result; what is not known of it is left out.
    """
    document = results.read(path)
    ground_truths = GroundTruths.of(catalog, truth_paths)
    paths = driven_paths(document)
    believed = _believed_paths(document, paths)
    maps = []
    for number, scene in enumerate(document["environment_details"]):
        name = environment_of(scene)
        objects = []
        with suppress(BenchbotError):
            objects = true_objects(ground_truths.find(name, (OBJECTS,)).get("ground_truth"))
        # The results are about the last scene: of scene change, they are what has changed since the ones before.
        if number == len(document["environment_details"]) - 1:
            objects += estimated_objects(document.get("results"))
        maps.append(
            SceneMap(
                name,
                # An environment that is not installed here has no floor to show.
                occupancy_of(catalog.find("environments", name)),
                tuple(objects),
                paths[number] if number < len(paths) else MapPath(),
                believed[number] if number < len(believed) else None,
            )
        )
    return maps


def map_of_environment(declaration: Declaration) -> SceneMap:
    """Return the map of an environment as it is declared: its floor, the trajectory and the start."""
    scene = Scene(declaration.data, declaration.path.parent)
    start = scene.start_pose if "start_pose" in declaration.data else None
    return SceneMap(
        declaration.name,
        occupancy_of(declaration),
        planned=tuple(map(planar, scene.trajectory)),
        start_xyyaw=None if start is None else (*planar(start), start.yaw_rad),
    )


def installed_map(catalog: Catalog, environment: str) -> SceneMap:
    """Return the map of an environment, `NAME:VARIANT`, with its true objects: for the host of a run only.

    Raises BenchbotError for an environment that is not installed.
    """
    found = map_of_environment(catalog.get("environments", environment))
    return replace(found, objects=installed_truth(catalog, environment))


def installed_truth(catalog: Catalog, environment: str) -> tuple[MapObject, ...]:
    """Return the true objects of an environment; none where no map of them is installed."""
    for path in catalog.ground_truth_files:
        document = schema.read(path)
        if environment_of(document["environment"]) == environment:
            objects = true_objects(document.get("ground_truth"))
            if objects:
                return tuple(objects)
    return ()


def _believed_paths(document: Mapping[str, Any], paths: Sequence[MapPath]) -> list[Points]:
    """Return the believed path through each scene: the poses of a trajectory, by the number of their observation."""
    results_of = document.get("results")
    listed = results_of.get("poses") if isinstance(results_of, dict) else None
    poses = {item["observation"]: item["translation_xyz"][:2] for item in _poses(listed)}
    if not poses:
        return []
    observed = enumerate((scene, pose) for scene, path in enumerate(paths) for pose in path.observed)
    known = [(scene, poses[number], planar(pose)) for number, (scene, pose) in observed if number in poses]
    believed, true = (np.array([item[i] for item in known], float).reshape(-1, 2) for i in (1, 2))
    moved = fitted(believed, true)
    scenes = np.array([scene for scene, _, _ in known])
    return [moved[scenes == scene] for scene in range(len(paths))]


def _poses(listed: Any) -> Iterator[dict[str, Any]]:
    for item in listed if isinstance(listed, list) else ():
        if isinstance(item, dict) and {"observation", "translation_xyz"} <= item.keys():
            yield item


def fitted(points: Points, onto: Points) -> Points:
    """Return points (N, 2) moved and turned, not stretched, so that their squared distances to others are least.

    Kabsch 1976, https://doi.org/10.1107/S0567739476001873.
    """
    if not len(points):
        return points
    middle, target = points.mean(0), onto.mean(0)
    left, _, right = np.linalg.svd((points - middle).T @ (onto - target))
    # Of the two best orthogonal matrices, the one that is no mirror.
    kept = np.diag([1.0, np.sign(np.linalg.det(left @ right)) or 1.0])
    moved: Points = (points - middle) @ left @ kept @ right + target
    return moved


def frames_in(folder: Path) -> dict[int, Path]:
    """Return the frames in a folder as `numbered_frames` does; raises BenchbotError when there are none."""
    found = numbered_frames(folder)
    if not found:
        raise BenchbotError(
            f"There are no frames in {folder}.",
            "It holds no JPEG files.",
            f"Record them with the result: benchbot submit … --record frames={folder}",
        )
    return found


def chosen(frames: Mapping[int, Path], count: int) -> dict[int, Path]:
    """Return so many of the frames, evenly spread, the first and the last among them."""
    numbers = sorted(frames)
    if len(numbers) > count:
        numbers = [numbers[round(place * (len(numbers) - 1) / max(count - 1, 1))] for place in range(count)]
    return {number: frames[number] for number in numbers}
