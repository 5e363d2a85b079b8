"""Triangles with smooth normals and texture coordinates in metres, made from shared positions."""

from __future__ import annotations

import numpy as np

from tools.household.model import Floats, Ints, Mesh


def build(
    vertices: Floats, triangles: Ints, uvs: Floats | None = None, crease_deg: float = 35.0, grain: str = "x"
) -> Mesh:
    """A mesh from shared positions: edges sharper than `crease_deg` are kept hard, all others shaded smooth.

    `uvs` (N, 2) go with the vertices; without them each triangle is projected along its dominant axis, in metres,
    with the axis `grain` along u. Triangles without area are dropped.
    """
    corners = vertices[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    keep = area > 1e-12
    triangles, corners, cross, area = triangles[keep], corners[keep], cross[keep], area[keep]
    face_normals = cross / area[:, None]
    corner_uvs = _project(corners, face_normals, grain) if uvs is None else uvs[triangles].reshape(-1, 2)
    normals = _corner_normals(corners, face_normals, area, crease_deg)
    rows = np.hstack([corners.reshape(-1, 3), normals, corner_uvs])
    _, first, inverse = np.unique(np.round(rows, 6), axis=0, return_index=True, return_inverse=True)
    unique = rows[first]
    return Mesh(
        unique[:, :3].copy(),
        inverse.reshape(-1, 3).astype(np.int32),
        unique[:, 3:6] / np.linalg.norm(unique[:, 3:6], axis=1, keepdims=True),
        unique[:, 6:].copy(),
    )


def _corner_normals(corners: Floats, face_normals: Floats, area: Floats, crease_deg: float) -> Floats:
    """Per triangle corner (3M, 3): the mean of the touching faces within the crease angle.

    Weighted by angle and area, so that large flat faces stay flat beside small bevels.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    back = corners - np.roll(corners, 1, axis=1)
    cosine = -(edges * back).sum(axis=2)
    cosine /= np.maximum(np.linalg.norm(edges, axis=2) * np.linalg.norm(back, axis=2), 1e-18)
    weight = np.arccos(np.clip(cosine, -1.0, 1.0)).ravel() * np.repeat(area, 3)
    weighted = np.repeat(face_normals, 3, axis=0) * weight[:, None]
    own = np.repeat(face_normals, 3, axis=0)

    _, vertex = np.unique(np.round(corners.reshape(-1, 3), 6), axis=0, return_inverse=True)
    order = np.argsort(vertex.ravel(), kind="stable")
    counts = np.bincount(vertex.ravel())
    starts = np.repeat(np.cumsum(counts) - counts, counts)
    valence = np.repeat(counts, counts)
    left = np.repeat(np.arange(len(order)), valence)
    offset = np.arange(len(left)) - np.repeat(np.cumsum(valence) - valence, valence)
    left, right = order[left], order[starts[left] + offset]

    smooth = (own[left] * own[right]).sum(axis=1) > np.cos(np.radians(crease_deg)) - 1e-9
    normals = np.zeros_like(own)
    np.add.at(normals, left[smooth], weighted[right[smooth]])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 1e-9, normals / np.maximum(length, 1e-12), own)


def _project(corners: Floats, face_normals: Floats, grain: str) -> Floats:
    """Box-projected texture coordinates (3M, 2) in metres."""
    along = "xyz".index(grain)
    others = [axis for axis in range(3) if axis != along]
    dominant = np.argmax(np.abs(face_normals), axis=1)
    u_axis = np.where(dominant == along, others[0], along)
    v_axis = 3 - dominant - u_axis
    rows = np.arange(len(corners))[:, None]
    columns = np.arange(3)[None, :]
    u = corners[rows, columns, u_axis[:, None]]
    v = corners[rows, columns, v_axis[:, None]]
    return np.stack([u, v], axis=2).reshape(-1, 2)
