"""Turn closed pieces that came inside out: some of infinigen's table tops are."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from plugins.assets_household.bake.parts import Floats, Part

_SHEET = 1e-3
_RAYS = 5
_INSIDE = np.array([0.31, 0.36, 0.33])


def outward(part: Part) -> Part:
    """The part with the triangles and normals of every connected piece pointing out of it.

    The sign of its volume tells for a closed piece; for a flat one, what lies before it.
    """
    triangles = part.positions.reshape(-1, 3, 3)
    piece = _pieces(part.positions)
    middle = np.stack([np.bincount(piece, triangles[..., axis].mean(axis=1)) for axis in range(3)], axis=1)
    first, second, third = (triangles - (middle / np.bincount(piece)[:, None])[piece][:, None]).transpose(1, 0, 2)
    volume = np.bincount(piece, np.einsum("ij,ij->i", first, np.cross(second, third)))
    edge = np.sqrt(np.bincount(piece, np.linalg.norm(np.cross(second - first, third - first), axis=1)))
    is_sheet = np.abs(volume) < _SHEET * edge**3
    inside_out = np.where(is_sheet, False, volume < 0)
    for number in np.flatnonzero(is_sheet):
        inside_out[number] = _looks_inward(triangles, np.flatnonzero(piece == number))
    is_inside_out = inside_out[piece]

    def turned(values: Floats, sign: float = 1.0) -> Floats:
        corners = values.reshape(len(triangles), 3, -1).copy()
        corners[is_inside_out] = sign * corners[is_inside_out][:, ::-1]
        return corners.reshape(values.shape)

    return replace(part, positions=turned(part.positions), normals=turned(part.normals, -1.0), uvs=turned(part.uvs))


def _looks_inward(triangles: Floats, sheet: npt.NDArray[np.int64]) -> bool:
    """Whether most rays along the normals of the sheet's largest triangles cross the model an odd number of times."""
    corners = triangles[sheet]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    largest = np.argsort(-areas)[:_RAYS]
    odd = 0
    for index in largest:
        direction = normals[index] / max(areas[index], 1e-30)
        odd += _crossings(corners[index].T @ _INSIDE + 1e-5 * direction, direction, triangles) % 2
    return odd > len(largest) / 2


def _crossings(origin: Floats, direction: Floats, triangles: Floats) -> int:
    """How many triangles a ray meets (Moeller and Trumbore 1997)."""
    first = triangles[:, 1] - triangles[:, 0]
    second = triangles[:, 2] - triangles[:, 0]
    across = np.cross(direction, second)
    determinant = np.einsum("ij,ij->i", first, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = (origin - triangles[:, 0]) / determinant[:, None]
        u = np.einsum("ij,ij->i", offset, across)
        around = np.cross(offset, first)
        v = around @ direction
        distance = np.einsum("ij,ij->i", second, around)
        return int(np.count_nonzero((u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)))


def _pieces(positions: Floats) -> npt.NDArray[np.int64]:
    """The number of the connected piece that each triangle belongs to."""
    _, vertex = np.unique(positions.round(6), axis=0, return_inverse=True)
    corners = vertex.reshape(-1, 3)
    edges = np.concatenate([corners[:, :2], corners[:, 1:]])
    size = int(vertex.max()) + 1
    _, label = connected_components(coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (size, size)))
    _, number = np.unique(label[corners[:, 0]], return_inverse=True)
    return np.asarray(number, np.int64)
