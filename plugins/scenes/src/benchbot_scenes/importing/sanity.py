"""Checking a file's triangles, and leaving out those that cannot be used."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing.model import Model
from benchbot_scenes.scene import SceneGeometry, only

MAX_TRIANGLES = 20_000_000
# A vertex is astray when nothing else is in the outer part of the scene, and its triangles are a needle, so many times
# as long as it is wide. Fewer vertices are those of a drawing, in which a spire may stand alone.
STRAY_SHARE, NEEDLE, LEAST_VERTICES, MOST_AT_TIP = 0.4, 5.0, 50, 100
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
    strays = _strays(geometry, is_kept)
    if strays:
        is_kept &= ~np.isin(geometry.triangles, list(strays)).any(axis=1)
        told = ", ".join("({:g}, {:g}, {:g})".format(*geometry.vertices[vertex]) for vertex in list(strays)[:3])
        owners = {model.paths[index - 1][-1] for index in strays.values()}
        notes.append(f"Stray vertices far from all others are left out: {told}, of {', '.join(sorted(owners)[:3])}.")
    return model if is_kept.all() else replace(model, geometry=only(geometry, is_kept), notes=tuple(notes))


def _strays(geometry: SceneGeometry, is_kept: npt.NDArray[np.bool_]) -> dict[int, int]:
    """Vertices at the tip of needles that make the scene far larger than it is, each with its instance."""
    kept = np.flatnonzero(is_kept)
    used = np.unique(geometry.triangles[kept])
    found: dict[int, int] = {}
    for axis, sign in ((axis, sign) for axis in range(3) for sign in (-1.0, 1.0)):
        if len(used) < LEAST_VERTICES:
            break
        places = sign * geometry.vertices[used, axis].astype(np.float64)
        tip, width = geometry.vertices[used[int(np.argmax(places))]], float(np.ptp(places))
        outer = np.flatnonzero(places > places.max() - STRAY_SHARE * width)
        vertices = used[outer]
        if len(outer) > MOST_AT_TIP or np.abs(geometry.vertices[vertices] - tip).max() > 1e-6 * width:
            continue
        own = kept[np.isin(geometry.triangles[kept], vertices).any(axis=1)]
        if not _is_needle(geometry, own, tip):
            continue
        owner = int(geometry.triangle_instance[own[0]])
        found |= {int(vertex): owner for vertex in vertices}
        kept = np.setdiff1d(kept, own)
        used = np.unique(geometry.triangles[kept])
    return found


def _is_needle(geometry: SceneGeometry, triangles: npt.NDArray[np.int64], tip: npt.NDArray[np.float32]) -> bool:
    """Return whether triangles at a tip are together far longer than they are wide at their other end."""
    corners = geometry.vertices[geometry.triangles[triangles]].reshape(-1, 3).astype(np.float64)
    length = np.linalg.norm(corners - tip, axis=1)
    ends = corners[length > 0.5 * length.max()]
    return bool(np.linalg.norm(np.ptp(ends, axis=0)) * NEEDLE < length.max())
