"""The mesh of a PLY file as labels need it: triangles, and what else the file says of vertices and faces."""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import files
from benchbot_scenes.importing.labels import Floats, Integers


@dataclass(frozen=True)
class LabelMesh:
    """A PLY file's triangles, the face that each is of, and the properties of its vertices and faces."""

    vertices: Floats
    triangles: Integers
    face: Integers
    raw: Any

    def vertex_property(self, *names: str) -> Integers | None:
        """The first of these properties that vertices have."""
        return _property(self.raw["vertex"], names)

    def face_property(self, *names: str) -> Integers | None:
        """The first of these properties that faces have."""
        return _property(self.raw["face"], names)


def _property(element: Any, names: tuple[str, ...]) -> Integers | None:
    for name in names:
        if name in element["properties"]:
            return np.asarray(element["data"][name]).reshape(-1).astype(np.int64)
    return None


def counts_of(path: Path) -> tuple[int, int]:
    """The numbers of vertices and faces that a PLY file's head names."""
    counts = {"vertex": -1, "face": -1}
    with path.open("rb") as stream:
        for _ in range(200):
            parts = stream.readline(400).split()
            if parts[:1] == [b"end_header"] or not parts:
                break
            if parts[0] == b"element" and len(parts) == 3 and parts[2].isdigit():
                counts[parts[1].decode("ascii", "replace")] = int(parts[2])
    return counts["vertex"], counts["face"]


def read_ply(path: Path) -> LabelMesh:
    """Read a PLY file with all its properties; raise BenchbotError when it is none."""
    files.check(path)
    from trimesh.exchange.ply import load_ply

    try:
        raw = load_ply(io.BytesIO(path.read_bytes()), skip_materials=True)["metadata"]["_ply_raw"]
        vertex, face = raw["vertex"]["data"], raw["face"]["data"]
        vertices = np.stack([np.asarray(vertex[axis], np.float64).reshape(-1) for axis in "xyz"], axis=1)
        name = next(name for name in ("vertex_indices", "vertex_index") if name in raw["face"]["properties"])
        corners = face[name]["f1"] if isinstance(face, np.ndarray) else face[name]
        triangles, of_face = _triangulated(corners)
    except (LookupError, StopIteration, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise malformed(path, f"{type(error).__name__}: {error}") from error
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise malformed(path, "A face names a vertex that is not there.")
    return LabelMesh(vertices, triangles, of_face, raw)


def _triangulated(corners: Any) -> tuple[Integers, Integers]:
    """Triangles (T, 3) of polygons as fans, and the polygon that each is of."""
    try:
        even = np.asarray(corners, np.int64)
    except ValueError:  # they have different numbers of corners
        fans = [(polygon[0], polygon[k], polygon[k + 1], n) for n, polygon in enumerate(corners) for k in _fan(polygon)]
        table = np.array(fans, np.int64)
        return table[:, :3], table[:, 3]
    count = even.shape[1] - 2
    triangles = np.stack([even[:, [0, k + 1, k + 2]] for k in range(count)], axis=1).reshape(-1, 3)
    return triangles, np.repeat(np.arange(len(even)), count)


def _fan(polygon: Any) -> range:
    return range(1, len(polygon) - 1)


def malformed(path: Path, why: str) -> BenchbotError:
    """The error for a file that labels cannot be taken from."""
    return BenchbotError(
        f"{path.name} cannot be used as labels", why, "Fetch it again, or import without labels: --labels none."
    )
