"""Splats as trainers of 3DGS write them, and splats that lie on a mesh."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.splats import Splats, harmonics_of_colors

FLATNESS, SPREAD = 0.1, 0.7


def write_ply(path: Path, splats: Splats, degree: int = 3) -> Path:
    """Write a point_cloud.ply: normals that mean nothing, harmonics up to `degree`, logits and logarithms."""
    each = (degree + 1) ** 2 - 1
    rest = [f"f_rest_{number}" for number in range(3 * each)]
    names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", *rest]
    names += ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    constant, linear = harmonics_of_colors(splats)
    higher = np.random.default_rng(7).normal(size=(splats.count, 3, max(each - 3, 0)))
    harmonics = np.concatenate([linear.transpose(0, 2, 1), higher], axis=2) if degree else np.zeros((splats.count, 0))
    columns: list[npt.NDArray[np.floating]] = [
        splats.positions_m,
        np.zeros((splats.count, 3)),
        constant,
        harmonics.reshape(splats.count, -1),
    ]
    columns += [np.log(splats.opacities / (1 - splats.opacities))[:, None], np.log(splats.scales_m)]
    columns += [3.0 * splats.rotations[:, [3, 0, 1, 2]]]
    properties = "".join(f"property float {name}\n" for name in names)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {splats.count}\n{properties}end_header\n"
    path.write_bytes(head.encode() + np.concatenate(columns, axis=1).astype("<f4").tobytes())
    return path


def on_mesh(geometry: SceneGeometry, per_m2: float) -> Splats:
    """Flat Gaussians all over the triangles, in the colours of their places."""
    corners = geometry.vertices[geometry.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    random = np.random.default_rng(0)
    count = int(areas.sum() * per_m2)
    triangle = random.choice(len(areas), count, p=areas / areas.sum())
    u, v = random.uniform(size=(2, count))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    edges = corners[:, 1:] - corners[:, :1]
    points = corners[triangle, 0] + u[:, None] * edges[triangle, 0] + v[:, None] * edges[triangle, 1]
    size = np.array([1.0, 1.0, FLATNESS]) * SPREAD * 1.5 / np.sqrt(per_m2)
    low, high = points.min(axis=0), points.max(axis=0)
    return Splats(
        positions_m=points.astype(np.float32),
        rotations=facing((normals / (2 * areas[:, None]))[triangle]).astype(np.float32),
        scales_m=np.tile(size, (count, 1)).astype(np.float32),
        opacities=np.full(count, 0.95, np.float32),
        colors=((points - low) / (high - low)).astype(np.float32),
        color_slopes=np.zeros((count, 3, 3), np.float32),
    )


def facing(normals: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Quaternions (N, 4) x, y, z, w that turn z to unit normals."""
    x, y, z = normals.T
    turns = np.stack([-y, x, np.zeros_like(x), 1.0 + z], axis=1)
    turns[z < -1.0 + 1e-6] = (1.0, 0.0, 0.0, 0.0)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return turns
