"""Lens distortion after Brown and Conrady, with the five coefficients of ROS's `plumb_bob`."""

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

PLUMB_BOB = "plumb_bob"
NEWTON_STEPS = 6
MOST_ERROR_PIXELS = 1e-3
_STEPS_FROM_AXIS = 33

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Distortion:
    """Coefficients as in sensor_msgs/CameraInfo and OpenCV, for points of the image plane at unit depth.

    With r² = x² + y²: x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²), and
    y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y (Brown, "Close-range camera calibration", 1971).
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a camera's `distortion`; raises TypeError or ValueError when it is not one."""
        found = cls(**{str(key): float(value) for key, value in values.items()})
        if not np.isfinite(astuple(found)).all():
            raise ValueError(f"distortion has to be finite: {found}")
        return found

    def coefficients(self) -> FloatArray:
        """(k1, k2, p1, p2, k3), their order in sensor_msgs/CameraInfo."""
        return np.array(astuple(self))

    def distort(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distorted positions of points of the undistorted image plane."""
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return (
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )

    def undistort(self, shown_x: FloatArray, shown_y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the undistorted points that the lens shows at positions of the image plane, by Newton's method."""
        x, y = shown_x, shown_y
        for _ in range(NEWTON_STEPS):
            error_x, error_y = (shown - now for shown, now in zip((shown_x, shown_y), self.distort(x, y), strict=True))
            xx, xy, yy = self._derivatives(x, y)
            determinant = xx * yy - xy * xy
            x = x + (yy * error_x - xy * error_y) / determinant
            y = y + (xx * error_y - xy * error_x) / determinant
        return x, y

    def check(self, left: float, top: float, right: float, bottom: float, pixel: float) -> None:
        """Raise ValueError unless each point of a picture shows one direction; limits and `pixel` are at unit depth.

        Rays of the border decide: whatever lies between them and the optical axis must keep its order.
        """
        across, down = np.linspace(left, right, _STEPS_FROM_AXIS), np.linspace(top, bottom, _STEPS_FROM_AXIS)
        shown_x = np.concatenate([across, across, np.full_like(down, left), np.full_like(down, right)])
        shown_y = np.concatenate([np.full_like(across, top), np.full_like(across, bottom), down, down])
        with np.errstate(all="ignore"):
            x, y = self.undistort(shown_x, shown_y)
            error = np.hypot(*(now - shown for now, shown in zip(self.distort(x, y), (shown_x, shown_y), strict=True)))
            share = np.linspace(0.0, 1.0, _STEPS_FROM_AXIS)[:, None]
            xx, xy, yy = self._derivatives(share * x, share * y)
        keeps_order = (xx * yy - xy * xy > 0.0) & (xx > 0.0)
        if not (np.all(error <= MOST_ERROR_PIXELS * pixel) and np.all(keeps_order)):
            raise ValueError(
                f"distortion {self} folds the picture: some of its pixels would show two directions, or none; "
                "use weaker coefficients, or a picture that reaches less far from the optical axis"
            )

    def _derivatives(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of `distort`: dx'/dx, dx'/dy = dy'/dx, dy'/dy."""
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        growth = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3))
        return (
            radial + x * x * growth + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            x * y * growth + 2.0 * self.p1 * x + 2.0 * self.p2 * y,
            radial + y * y * growth + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
