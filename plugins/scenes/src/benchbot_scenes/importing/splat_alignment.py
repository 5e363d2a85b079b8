"""Whether splats are where the mesh is: their depth against its own, from along the robot's trajectory."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot_scenes.importing.planning import level_camera
from benchbot_scenes.scene import SceneGeometry

PLACES = 8
HEADINGS_DEG = (0.0, 120.0, 240.0)
WIDTH, HEIGHT, VIEW_DEG = 160, 120, 90.0
CLOSE_M, NEAR_M = 0.05, 0.10
LEAST_NEAR_SHARE = 0.8
LEAST_SHARE_OF_SAME_PLACE = 0.5
MOST_SHIFT_M, MOST_STRETCH = 0.03, 0.02
LEAST_OPAQUE_SHARE = 0.5
LEAST_EXPLAINED_SHARE = 0.7
_REACHES_M = (0.6, 0.4, 0.3, 0.2, 0.15, 0.1, 0.1, 0.1)
"""Pairs of points farther apart than this count nothing in the fit, which begins with the first."""
_LEAST_PAIRS = 100

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Alignment:
    """How splats lie to the mesh.

    `opaque_share` of what is seen of the mesh has splats that half of the light does not pass; of these, `close_share`
    are within 5 cm of its depth and `near_share` within 10 cm. `shift_m` and `scale` would have moved the splats from
    where they should be: fitted to those that are not far off, which leaves `explained_share` of all within 5 cm.
    """

    opaque_share: float
    close_share: float
    near_share: float
    shift_m: tuple[float, float, float]
    scale: float
    explained_share: float

    @property
    def is_other_place(self) -> bool:
        """True if they do not show this mesh, or not in its frame."""
        return self.near_share < LEAST_SHARE_OF_SAME_PLACE or self.opaque_share < LEAST_OPAQUE_SHARE

    @property
    def is_off(self) -> bool:
        """True if they are not quite where they belong."""
        is_moved = math.hypot(*self.shift_m) > MOST_SHIFT_M or abs(self.scale - 1.0) > MOST_STRETCH
        return self.is_other_place or is_moved or self.near_share < LEAST_NEAR_SHARE

    def __str__(self) -> str:
        return (
            f"{self.close_share:.0%} of their depths within 5 cm of the mesh's, {self.near_share:.0%} within 10 cm; "
            f"{self.opaque_share:.0%} of the mesh is behind them"
        )

    @property
    def cause(self) -> str:
        """Return why they are off, as far as is known: a sentence."""
        if self.explained_share < LEAST_EXPLAINED_SHARE or self.opaque_share < LEAST_OPAQUE_SHARE:
            return "No small movement explains it: another axis is up, the unit is another, or it is another place."
        x, y, z = self.shift_m
        return f"They seem shifted by ({x:.2f}, {y:.2f}, {z:.2f}) m and scaled by {self.scale:.3f} against the mesh."


def measure(
    geometry: SceneGeometry, poses: Sequence[Sequence[float]], cache_dir: Path | None = None
) -> Alignment | None:
    """Compare depths from base `poses` [qw, qx, qy, qz, x, y, z]; None without splats, or benchbot-sim-taichi."""
    try:
        from benchbot_sim_taichi.lighting import Lighting
        from benchbot_sim_taichi.renderer import Intrinsics, Renderer
    except ImportError:
        return None
    renderer = Renderer(geometry, Lighting(), cache_dir=cache_dir)
    drawing = renderer.splats
    if drawing is None:
        return None
    lens = Intrinsics.from_horizontal_fov(WIDTH, HEIGHT, VIEW_DEG)
    column, row = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    rays = np.stack([(column - lens.cx) / lens.fx, (row - lens.cy) / lens.fy, np.ones_like(row)], axis=-1)
    seen, depths, pairs = 0, [], []
    for camera in _cameras(poses):
        mesh_m = renderer.render(camera, lens, rgb=False).depth_m.astype(np.float64)
        splats_m = drawing.depth_m(camera, lens).astype(np.float64)
        both = np.isfinite(mesh_m) & np.isfinite(splats_m)
        seen += int(np.isfinite(mesh_m).sum())
        depths.append((splats_m - mesh_m)[both])
        pairs.append(_pairs(camera, rays, mesh_m, splats_m, both))
    off = np.abs(np.concatenate(depths))
    shift, scale, explained = _fitted(*(np.concatenate(part) for part in zip(*pairs, strict=True)))
    return Alignment(
        opaque_share=len(off) / max(seen, 1),
        close_share=float((off < CLOSE_M).mean()) if len(off) else 0.0,
        near_share=float((off < NEAR_M).mean()) if len(off) else 0.0,
        shift_m=shift,
        scale=scale,
        explained_share=explained,
    )


def _cameras(poses: Sequence[Sequence[float]]) -> list[Floats]:
    """Level optical frames above some of the poses, looking all around."""
    cameras = []
    for number in sorted({round(k * (len(poses) - 1) / max(PLACES - 1, 1)) for k in range(PLACES)}):
        cameras += [level_camera(poses[number], turn) for turn in np.radians(HEADINGS_DEG)]
    return cameras


def _pairs(
    camera: Floats, rays: Floats, mesh_m: Floats, splats_m: Floats, both: npt.NDArray[np.bool_]
) -> tuple[Floats, Floats, Floats]:
    """Points of the mesh, its normals there, and how far along these the splats of the same pixels are."""
    along = rays @ camera[:3, :3].T
    with np.errstate(invalid="ignore", divide="ignore"):
        points = camera[:3, 3] + along * mesh_m[..., None]
        normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    usable = both & np.isfinite(normals).all(axis=-1)
    way = ((splats_m - mesh_m)[..., None] * along)[usable]
    return points[usable], normals[usable], (normals[usable] * way).sum(axis=-1)


def _fitted(points: Floats, normals: Floats, off_m: Floats) -> tuple[tuple[float, float, float], float, float]:
    """The shift and scale, about the middle of the points, that take them by `off_m` along the normals.

    Also which share of them then is within 5 cm. Least squares with Tukey's weights, so that what is in one of both
    alone does not count; point to plane, as in Chen and Medioni, "Object modelling by registration of multiple range
    images", 1992.
    """
    if len(points) < _LEAST_PAIRS:
        return (0.0, 0.0, 0.0), 1.0, 0.0
    middle = np.median(points, axis=0)
    design = np.column_stack([normals, (normals * (points - middle)).sum(axis=1)])
    moved = np.zeros(4)
    for reach_m in _REACHES_M:
        share = (off_m - design @ moved) / reach_m
        weight = np.where(np.abs(share) < 1.0, (1.0 - share**2) ** 2, 0.0)
        # A little is added, so that what no surface tells stays where it is.
        normal_equations = design.T @ (design * weight[:, None]) + 1e-3 * max(weight.sum(), 1.0) * np.eye(4)
        moved = np.linalg.solve(normal_equations, design.T @ (weight * off_m))
    x, y, z, stretch = moved.tolist()
    return (x, y, z), 1.0 + stretch, float((np.abs(off_m - design @ moved) < CLOSE_M).mean())
