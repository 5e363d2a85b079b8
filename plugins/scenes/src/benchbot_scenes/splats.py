"""3D Gaussian splats: how a scanned place looks, as a cloud of coloured, soft ellipsoids.

Kerbl, Kopanas, Leimkühler and Drettakis, "3D Gaussian splatting for real-time radiance field rendering", 2023.
"""

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float32]

HARMONIC_0 = 0.28209479177387814
HARMONIC_1 = 0.4886025119029199
"""Factors of the real spherical harmonics of degree 0 and 1: 1 / (2 sqrt(pi)) and sqrt(3 / (4 pi))."""


@dataclass(frozen=True)
class Splats:
    """N Gaussians in the map frame, all float32.

    `positions_m` (N, 3); `rotations` (N, 4) unit quaternions x, y, z, w of their axes, `scales_m` (N, 3) standard
    deviations along these; `opacities` (N,) in 0 … 1. Seen along a unit vector `d`, a Gaussian has the display-referred
    sRGB colour `colors + color_slopes @ d`, at least 0: `colors` (N, 3), `color_slopes` (N, 3 channels, 3 axes). That
    is spherical harmonics of degree 1, with the slope as a vector, which turns as any other.
    """

    positions_m: FloatArray
    rotations: FloatArray
    scales_m: FloatArray
    opacities: FloatArray
    colors: FloatArray
    color_slopes: FloatArray

    @property
    def count(self) -> int:
        """Number of Gaussians."""
        return len(self.positions_m)

    def part(self, which: slice | npt.NDArray[np.integer | np.bool_]) -> "Splats":
        """Return some of them."""
        return Splats(**{field.name: getattr(self, field.name)[which] for field in fields(Splats)})


def transformed(
    splats: Splats,
    rotation: npt.NDArray[np.floating] | None = None,
    *,
    scale: float = 1.0,
    offset: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Splats:
    """The splats rotated by (3, 3) and scaled about the origin, then shifted."""
    turn = np.eye(3) if rotation is None else np.asarray(rotation, np.float64)
    positions = splats.positions_m.astype(np.float64) @ (scale * turn).T + np.asarray(offset, np.float64)
    rotations, slopes = splats.rotations, splats.color_slopes
    if rotation is not None:
        from scipy.spatial.transform import Rotation  # most scenes have no splats, and it is slow to import

        rotations = (Rotation.from_matrix(turn) * Rotation.from_quat(rotations)).as_quat().astype(np.float32)
        slopes = (slopes.astype(np.float64) @ turn.T).astype(np.float32)
    return Splats(
        positions_m=positions.astype(np.float32),
        rotations=rotations,
        scales_m=(splats.scales_m * np.float32(scale)).astype(np.float32),
        opacities=splats.opacities,
        colors=splats.colors,
        color_slopes=slopes,
    )


def joined(parts: list[Splats]) -> Splats | None:
    """All splats of several clouds as one; None of none."""
    if not parts:
        return None
    return Splats(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Splats)})


def covariances(splats: Splats) -> npt.NDArray[np.float64]:
    """(N, 3, 3) in square metres."""
    from scipy.spatial.transform import Rotation

    axes = Rotation.from_quat(splats.rotations).as_matrix() * splats.scales_m[:, None, :].astype(np.float64)
    squares: npt.NDArray[np.float64] = axes @ axes.transpose(0, 2, 1)
    return squares


def colors_of_harmonics(
    constant: npt.NDArray[np.floating], linear: npt.NDArray[np.floating]
) -> tuple[FloatArray, FloatArray]:
    """`colors` and `color_slopes` of coefficients of degree 0 (N, 3) and 1 (N, 3 orders, 3 channels).

    The orders -1, 0, 1 are those of -y, z and -x (with the Condon-Shortley phase), as in files of 3DGS and in glTF.
    """
    slopes = HARMONIC_1 * np.stack([-linear[:, 2], -linear[:, 0], linear[:, 1]], axis=-1)
    return (0.5 + HARMONIC_0 * constant).astype(np.float32), slopes.astype(np.float32)


def harmonics_of_colors(splats: Splats) -> tuple[FloatArray, FloatArray]:
    """Inverse of `colors_of_harmonics`."""
    x, y, z = np.moveaxis(splats.color_slopes / np.float32(HARMONIC_1), -1, 0)
    constant = (splats.colors - np.float32(0.5)) / np.float32(HARMONIC_0)
    return constant.astype(np.float32), np.stack([-y, z, -x], axis=1).astype(np.float32)
