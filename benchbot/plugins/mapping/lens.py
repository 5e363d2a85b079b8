"""The distortion of a lens: `plumb_bob`, the model of ROS and OpenCV with five coefficients."""

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import BenchbotError, CameraModel

Doubles = NDArray[np.float64]

_NEWTON_STEPS = 8


def coefficients_of(info: CameraModel) -> Doubles:
    """Return k1, k2, p1, p2, k3 of `plumb_bob`, all zero for a pinhole; raises BenchbotError for another model."""
    model = info.get("distortion_model", "plumb_bob")
    if model != "plumb_bob":
        raise BenchbotError(
            f"The distortion of the pictures is of the model '{model}'.",
            "Pixels can be taken back to points for pinholes and for 'plumb_bob', the model of ROS and OpenCV.",
            "Rectify the pictures before they are published, for example with image_proc.",
        )
    return np.array(info.get("distortion_coefficients", np.zeros(5)), np.float64)


def distort(x: Doubles, y: Doubles, coefficients: Doubles) -> tuple[Doubles, Doubles]:
    """Return where the lens shows points of the plane z = 1 (Brown, "Close-range camera calibration", 1971)."""
    k1, k2, p1, p2, k3 = coefficients
    square = x * x + y * y
    radial = 1 + square * (k1 + square * (k2 + square * k3))
    return (
        x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
        y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
    )


def undistort(shown_x: Doubles, shown_y: Doubles, coefficients: Doubles) -> tuple[Doubles, Doubles]:
    """Return the points of the plane z = 1 that a lens shows there: `distort` undone, by Newton's method."""
    if not coefficients.any():
        return shown_x, shown_y
    k1, k2, p1, p2, k3 = coefficients
    x, y = shown_x, shown_y
    for _ in range(_NEWTON_STEPS):
        now_x, now_y = distort(x, y, coefficients)
        square = x * x + y * y
        radial = 1 + square * (k1 + square * (k2 + square * k3))
        growth = 2 * (k1 + square * (2 * k2 + square * 3 * k3))
        # The derivatives dx'/dx, dx'/dy = dy'/dx and dy'/dy of `distort`.
        xx = radial + x * x * growth + 2 * p1 * y + 6 * p2 * x
        xy = x * y * growth + 2 * p1 * x + 2 * p2 * y
        yy = radial + y * y * growth + 6 * p1 * y + 2 * p2 * x
        determinant = xx * yy - xy * xy
        off_x, off_y = shown_x - now_x, shown_y - now_y
        x, y = x + (yy * off_x - xy * off_y) / determinant, y + (xx * off_y - xy * off_x) / determinant
    return x, y
