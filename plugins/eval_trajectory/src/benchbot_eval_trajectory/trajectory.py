"""Trajectories: where something was, pose by pose."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Trajectory:
    """Poses of a body in one frame, in order.

    `positions_m` (N, 3); `rotations` (N, 3, 3) from the body to the frame; `times_s` (N,), never decreasing, or None.
    """

    positions_m: Floats
    rotations: Floats
    times_s: Floats | None = None

    @classmethod
    def from_quaternions(
        cls, positions_m: ArrayLike, rotations_xyzw: ArrayLike, times_s: ArrayLike | None = None
    ) -> Self:
        """Return the trajectory of positions (N, 3) and quaternions (N, 4), which are normalised."""
        return cls(
            np.array(positions_m, np.float64).reshape(-1, 3),
            _matrices(np.array(rotations_xyzw, np.float64).reshape(-1, 4)),
            None if times_s is None else np.array(times_s, np.float64),
        )

    def __len__(self) -> int:
        return len(self.positions_m)

    @property
    def rotations_xyzw(self) -> Floats:
        """The rotations as unit quaternions (N, 4), w not negative."""
        if not len(self):
            return np.zeros((0, 4))
        quaternions: Floats = Rotation.from_matrix(self.rotations).as_quat(canonical=True)
        return quaternions

    def at(self, indices: ArrayLike) -> "Trajectory":
        """Return the poses of these numbers."""
        chosen = np.asarray(indices, np.intp)
        times_s = None if self.times_s is None else self.times_s[chosen]
        return Trajectory(self.positions_m[chosen], self.rotations[chosen], times_s)


def _matrices(quaternions_xyzw: Floats) -> Floats:
    # scipy before 1.17 refuses to make rotations of nothing.
    if not len(quaternions_xyzw):
        return np.zeros((0, 3, 3))
    matrices: Floats = Rotation.from_quat(quaternions_xyzw).as_matrix()
    return matrices
