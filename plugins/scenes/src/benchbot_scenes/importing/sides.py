"""Which surfaces are seen from one side only: those of closed bodies."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry

# Odd multipliers, of which the first is 2^64 over the golden ratio (Knuth, The Art of Computer Programming, 6.4).
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def with_sides(geometry: SceneGeometry) -> SceneGeometry:
    """Mark materials as one-sided where they are on closed bodies only, as both-sided elsewhere.

    What a file says of it is not believed: which side of a scanned or drawn wall is its front is often left to chance.
    """
    closed = is_closed(geometry)
    open_materials = set(np.unique(geometry.triangle_material[~closed]).tolist())
    materials = tuple(
        replace(material, double_sided=number in open_materials) for number, material in enumerate(geometry.materials)
    )
    return replace(geometry, materials=materials)


def is_closed(geometry: SceneGeometry) -> npt.NDArray[np.bool_]:
    """Say of each triangle (T,) whether its instance is closed and faces outwards.

    Closed: every edge is between two triangles that run along it in opposite directions. Outwards: the volume that it
    encloses is positive.
    """
    place = _places(geometry)
    corners = place[geometry.triangles]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    count = len(geometry.vertices)
    low, high = edges.min(axis=1), edges.max(axis=1)
    owner = np.repeat(geometry.triangle_instance.astype(np.int64), 3)
    # The balance of each edge of each instance, one way counting up and the other down, is 0 in a closed body.
    _, edge = np.unique((owner * count + low) * count + high, return_inverse=True)
    balance = np.bincount(edge, np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    is_open = np.zeros(int(geometry.triangle_instance.max()) + 1, bool)
    is_open[owner[balance[edge] != 0]] = True
    points = geometry.vertices[geometry.triangles].astype(np.float64)
    volume = np.bincount(geometry.triangle_instance, (points[:, 0] * np.cross(points[:, 1], points[:, 2])).sum(axis=1))
    closed: npt.NDArray[np.bool_] = (~is_open & (volume > 0))[geometry.triangle_instance]
    return closed


def _places(geometry: SceneGeometry) -> npt.NDArray[np.int64]:
    """A number for each vertex, equal for vertices at the same place."""
    x, y, z = (geometry.vertices + np.float32(0.0)).view(np.uint32).astype(np.uint64).T  # -0.0 becomes 0.0
    hashed = (x * _MIX[0]) ^ (y * _MIX[1] + _MIX[2]) ^ (z * _MIX[2] + (x ^ y) * _MIX[0])
    _, place = np.unique(hashed, return_inverse=True)
    return place
