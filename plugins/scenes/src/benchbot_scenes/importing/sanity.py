"""Checking a file's triangles, and leaving out those that cannot be used."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing.model import Model
from benchbot_scenes.scene import only

MAX_TRIANGLES = 20_000_000
FAR = 1e9
"""Beyond this, in any unit, a coordinate is a mistake: it is 1,000 km in millimetres."""


def sound(model: Model, path: Path) -> Model:
    """Leave out triangles with corners that are no places and such without area; note how many.

    Raises BenchbotError when nothing is left, or more than can be traced.
    """
    geometry = model.geometry
    if len(geometry.triangles) > MAX_TRIANGLES:
        raise BenchbotError(
            f"{path.name} has too many triangles",
            f"It has {len(geometry.triangles):,}; up to {MAX_TRIANGLES:,} can be traced.",
            "Decimate the mesh, for example with MeshLab's Quadric Edge Collapse.",
        )
    with np.errstate(invalid="ignore", over="ignore"):
        is_place = np.asarray((np.abs(geometry.vertices) < FAR).all(axis=1))
        has_places = np.asarray(is_place[geometry.triangles].all(axis=1))
        corners = geometry.vertices[geometry.triangles].astype(np.float64)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        is_kept: npt.NDArray[np.bool_] = has_places & (area > 0)
    if not is_kept.any():
        raise BenchbotError(
            f"{path.name} holds no triangles that can be used",
            f"Of {len(geometry.triangles)} none has three corners and an area.",
            "Export it again; of a point cloud make a mesh first, for example with CloudCompare (Poisson).",
        )
    notes = list(model.notes)
    if not has_places.all():
        notes.append(f"{int((~has_places).sum())} triangles with corners that are no places are left out.")
    if (has_places & ~is_kept).any():
        notes.append(f"{int((has_places & ~is_kept).sum())} triangles without area are left out.")
    return model if is_kept.all() else replace(model, geometry=only(geometry, is_kept), notes=tuple(notes))
