"""Clouds of splats, and their pictures by a plain reference."""

import numpy as np
import numpy.typing as npt

from benchbot.simulation import Distortion
from benchbot_scenes.splats import Splats, covariances
from benchbot_sim_taichi.intrinsics import Intrinsics
from benchbot_sim_taichi.splats import MARGIN_SHARE

NEAR_M, LOW_PASS, LEAST, MOST = 0.2, 0.3, 1.0 / 255.0, 0.99


def cloud(
    count: int, seed: int, *, low: tuple[float, ...] = (0.5, -2.0, 0.0), high: tuple[float, ...] = (6.0, 2.0, 2.5)
) -> Splats:
    """Random Gaussians of every shape in a box, their colours changing with the view."""
    random = np.random.default_rng(seed)
    rotations = random.normal(size=(count, 4))
    return Splats(
        positions_m=random.uniform(low, high, (count, 3)).astype(np.float32),
        rotations=(rotations / np.linalg.norm(rotations, axis=1, keepdims=True)).astype(np.float32),
        scales_m=np.exp(random.uniform(np.log(0.005), np.log(0.4), (count, 3))).astype(np.float32),
        opacities=random.uniform(0.02, 1.0, count).astype(np.float32),
        colors=random.uniform(0.0, 1.0, (count, 3)).astype(np.float32),
        color_slopes=random.normal(scale=0.2, size=(count, 3, 3)).astype(np.float32),
    )


def reference(
    splats: Splats, pose: npt.NDArray[np.float64], lens: Intrinsics
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """(H, W, 3) colours before rounding and (H, W) median depths: every Gaussian at every pixel, in 64 bits."""
    turn, eye = pose[:3, :3], pose[:3, 3]
    away = splats.positions_m.astype(np.float64) - eye
    place = away @ turn
    order = [i for i in np.argsort(place[:, 2].astype(np.float32), kind="stable") if place[i, 2] > NEAR_M]
    spread = turn.T @ covariances(splats) @ turn
    directions = away / np.linalg.norm(away, axis=1, keepdims=True)
    shown = np.maximum(splats.colors + np.einsum("nca,na->nc", splats.color_slopes, directions), 0.0)
    column, row = np.meshgrid(np.arange(lens.width) + 0.5, np.arange(lens.height) + 0.5)
    color, passing = np.zeros((lens.height, lens.width, 3)), np.ones((lens.height, lens.width))
    median = np.full((lens.height, lens.width), np.inf)
    for i in order:
        mean, jacobian = _linearised(place[i], lens)
        covariance = jacobian @ spread[i] @ jacobian.T + LOW_PASS * np.eye(2)
        inverse = np.linalg.inv(covariance)
        dx, dy = column - mean[0], row - mean[1]
        power = -0.5 * (inverse[0, 0] * dx * dx + inverse[1, 1] * dy * dy) - inverse[0, 1] * dx * dy
        alpha = np.minimum(splats.opacities[i] * np.exp(power), MOST)
        alpha[alpha < LEAST] = 0.0
        left = passing * (1.0 - alpha)
        slope = inverse @ jacobian @ spread[i][:, 2]
        is_middle = (passing > 0.5) & (left <= 0.5)
        median[is_middle] = (place[i, 2] + slope[0] * dx + slope[1] * dy)[is_middle]
        color += (passing * alpha)[..., None] * shown[i]
        passing = left
    return np.minimum(color, 1.0), median


def _linearised(
    place: npt.NDArray[np.float64], lens: Intrinsics
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The pixel of a point in the optical frame, and its derivatives (2, 3) by differences within the margins."""
    plane = place[:2] / place[2]
    edge = np.array([0.0, 1.0])
    x, y = (edge * lens.width - lens.cx) / lens.fx, (edge * lens.height - lens.cy) / lens.fy
    corners = np.stack(np.meshgrid(np.linspace(x[0], x[1], 33), np.linspace(y[0], y[1], 33)), axis=-1).reshape(-1, 2)
    bend = lens.distortion or Distortion()
    ideal = np.stack(bend.undistort(corners[:, 0], corners[:, 1]), axis=-1)
    margin = MARGIN_SHARE * np.ptp(ideal, axis=0)
    near = np.clip(plane, ideal.min(axis=0) - margin, ideal.max(axis=0) + margin)

    def shown(at: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.array(bend.distort(at[0], at[1]))

    step = 1e-6
    bent = np.stack([(shown(near + axis) - shown(near - axis)) / (2 * step) for axis in np.eye(2) * step], axis=1)
    focal, centre = np.array([lens.fx, lens.fy]), np.array([lens.cx, lens.cy])
    projected = np.array([[1.0, 0.0, -near[0]], [0.0, 1.0, -near[1]]]) / place[2]
    return focal * (shown(near) + bent @ (plane - near)) + centre, focal[:, None] * (bent @ projected)
