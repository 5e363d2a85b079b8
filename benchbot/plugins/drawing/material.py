"""What figures are made of: where things and the robot were, scene by scene, and where a solution believed them."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.core import results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation.ground_truths import GroundTruths, environment_of
from benchbot.plugins.drawing.camera import Box
from benchbot.plugins.drawing.driven import Way, ways
from benchbot.plugins.drawing.episodes import OBJECTS, Document, Episode
from benchbot.plugins.drawing.objects import proposed, stated
from benchbot.plugins.drawing.occupancy import Occupancy, occupancy_of

Labelled = tuple[str, Box]
Points = NDArray[np.float64]


@dataclass(frozen=True)
class SceneMaterial:
    """One scene of a result. `title` says which; places are in the map frame, metres.

    `estimate` is the way that the solution believes it has gone, moved and turned as a whole to fit the true one; None
    where its results are no trajectory.
    """

    title: str
    occupancy: Occupancy | None
    truth: tuple[Labelled, ...]
    proposed: tuple[Labelled, ...]
    way: Way
    estimate: Points | None


def read(path: Path, catalog: Catalog, truth_paths: Sequence[Path] | None = None) -> list[SceneMaterial]:
    """Return what there is to draw of a result, scene by scene.

    Raises BenchbotError for a file that is no result; what is not known of it is left out.
    """
    document = results.read(path)
    return list(_scenes(document, catalog, GroundTruths.of(catalog, truth_paths)))


def _scenes(document: Document, catalog: Catalog, truths: GroundTruths) -> Iterator[SceneMaterial]:
    scenes = document["environment_details"]
    driven = ways(Episode("", None, None, None, None, None, None, document=document))
    estimates = _estimates(document, driven)
    for number, scene in enumerate(scenes):
        name = environment_of(scene)
        declaration = None
        stands: list[tuple[str, Box | None]] = []
        with suppress(BenchbotError):  # an environment that is not installed here has no floor to show
            declaration = catalog.get("environments", name)
        with suppress(BenchbotError):
            stands = stated(truths.find(name, (OBJECTS,)).get("ground_truth"))
        # The results are about the last scene: of scene change, they are what has changed since the ones before.
        found = proposed(document.get("results")) if number == len(scenes) - 1 else []
        yield SceneMaterial(
            title=name,
            occupancy=occupancy_of(declaration),
            truth=_known(stands),
            proposed=_known(found),
            way=driven[number] if number < len(driven) else Way((), (), recorded=False),
            estimate=estimates[number] if number < len(estimates) else None,
        )


def _known(items: Sequence[tuple[str, Box | None]]) -> tuple[Labelled, ...]:
    return tuple((label, box) for label, box in items if box is not None)


def _estimates(document: Document, driven: Sequence[Way]) -> list[Points | None]:
    """Return the believed way through each scene: the poses of a trajectory, by the number of their observation."""
    results_of = document.get("results")
    listed = results_of.get("poses") if isinstance(results_of, dict) else None
    poses = {item["observation"]: item["translation_xyz"][:2] for item in _poses(listed)}
    if not poses:
        return []
    believed, true, scene_of = [], [], []
    places = [(scene, pose) for scene, way in enumerate(driven) for pose in way.observed]
    for number, (scene, pose) in enumerate(places):
        if number in poses:
            believed.append(poses[number])
            true.append(pose.translation_xyz[:2])
            scene_of.append(scene)
    moved = fitted(np.asarray(believed, float).reshape(-1, 2), np.asarray(true, float).reshape(-1, 2))
    which = np.asarray(scene_of)
    return [moved[which == scene] for scene in range(len(driven))]


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
