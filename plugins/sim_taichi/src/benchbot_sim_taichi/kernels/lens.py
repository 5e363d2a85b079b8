# mypy: ignore-errors
"""Lens distortion of camera rays."""

from benchbot.simulation import NEWTON_STEPS
from benchbot_sim_taichi._ti import ti


@ti.func
def undistort(cameras: ti.template(), at, shown_x, shown_y):
    """`distortion.Distortion.undistort`, with k1, k2, p1, p2, k3 from `at` on."""
    k1, k2, p1, p2, k3 = cameras[at], cameras[at + 1], cameras[at + 2], cameras[at + 3], cameras[at + 4]
    x = shown_x
    y = shown_y
    for _ in range(NEWTON_STEPS):
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        growth = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))
        error_x = shown_x - (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x))
        error_y = shown_y - (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y)
        xx = radial + x * x * growth + 2.0 * p1 * y + 6.0 * p2 * x
        xy = x * y * growth + 2.0 * p1 * x + 2.0 * p2 * y
        yy = radial + y * y * growth + 6.0 * p1 * y + 2.0 * p2 * x
        determinant = xx * yy - xy * xy
        x += (yy * error_x - xy * error_y) / determinant
        y += (xx * error_y - xy * error_x) / determinant
    return x, y
