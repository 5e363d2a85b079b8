"""Laser scanners of a simulated robot: a planar one, and a lidar of many rings."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from benchbot.plugin import LaserScan, LidarScan, Pose, directions, elevations_deg
from benchbot.plugins.simulation.declared import check_keys, limits_m, optional
from benchbot.plugins.simulation.poses import matrices

Raycast = Callable[[npt.NDArray[np.float64], npt.NDArray[np.float64], float], npt.NDArray[np.floating]]
"""Distances (N,) in metres along unit rays (N, 3) from origins (N, 3) in the map frame; +inf beyond the last."""


@dataclass(frozen=True)
class RangeNoise:
    """Normal errors of ranges; their variance is `sigma_m`² + (`sigma_relative` × range)²."""

    sigma_m: float = 0.0
    sigma_relative: float = 0.0

    def __post_init__(self) -> None:
        if not (0 <= self.sigma_m < np.inf and 0 <= self.sigma_relative < np.inf):
            raise ValueError(f"{self} is negative or not finite")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a scanner's `noise`; raises TypeError or ValueError when it is not one."""
        return cls(**{str(key): float(value) for key, value in values.items()})

    def apply(self, ranges_m: npt.NDArray[np.float64], random: np.random.Generator) -> npt.NDArray[np.float64]:
        """Return ranges with errors; what is infinite stays so."""
        finite = np.isfinite(ranges_m)
        sigma_m = np.hypot(self.sigma_m, self.sigma_relative * np.where(finite, ranges_m, 0.0))
        return np.where(finite, ranges_m + sigma_m * random.standard_normal(ranges_m.shape), ranges_m)


@dataclass(frozen=True)
class Laser:
    """A planar scanner: `beams` rays over the full turn, counter-clockwise from -pi, in the plane of its frame."""

    frame: str
    beams: int
    range_m: tuple[float, float]
    noise: RangeNoise | None = None

    def __post_init__(self) -> None:
        if not self.beams > 0:
            raise ValueError(f"{self} has no beams")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a robot's `laser` mapping; raises KeyError, TypeError or ValueError when it is not one."""
        check_keys("laser", values, cls)
        return cls(
            frame=str(values["frame"]),
            beams=int(values["beams"]),
            range_m=limits_m(values["range_m"]),
            noise=optional(values, "noise", RangeNoise.from_mapping),
        )

    def scan(
        self, raycast: Raycast, laser_poses: Sequence[Pose], randoms: Iterable[np.random.Generator]
    ) -> list[LaserScan]:
        """Return a scan from each pose in the map frame, with noise from the generator of each (REP-117)."""
        return [self.channel(ranges_m) for ranges_m in self.ranges(raycast, laser_poses, randoms)]

    @property
    def rays(self) -> int:
        """Number of ranges in a scan."""
        return self.beams

    def along(self) -> npt.NDArray[np.float64]:
        """Return the unit directions (beams, 3) of the rays in the scanner's frame."""
        angles_rad = _around(self.beams)
        return np.stack([np.cos(angles_rad), np.sin(angles_rad), np.zeros(self.beams)], 1)

    def ranges(
        self, raycast: Raycast, laser_poses: Sequence[Pose], randoms: Iterable[np.random.Generator]
    ) -> npt.NDArray[np.float64]:
        """Return the ranges (poses, beams) of `scan`."""
        return _measure(raycast, laser_poses, self.along(), self.range_m, self.noise, randoms)

    def channel(self, ranges_m: npt.NDArray[np.float64]) -> LaserScan:
        """Return the channel `laser` of ranges (beams,)."""
        nearest_m, farthest_m = self.range_m
        scans = np.stack([ranges_m, _around(self.beams)], 1)
        return {"scans": scans, "range_min": nearest_m, "range_max": farthest_m}


@dataclass(frozen=True)
class Lidar:
    """A multi-beam lidar: rings of `beams` rays over the full turn, each at its elevation above the x-y plane."""

    frame: str
    elevations_deg: tuple[float, ...]
    beams: int
    range_m: tuple[float, float]
    noise: RangeNoise | None = None

    def __post_init__(self) -> None:
        if not (self.beams > 0 and self.elevations_deg):
            raise ValueError(f"{self} has no beams")
        if not all(abs(elevation) <= 90 for elevation in self.elevations_deg):
            raise ValueError(f"elevations_deg are {list(self.elevations_deg)}, not all within [-90, 90]")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a robot's `lidar` mapping; raises KeyError, TypeError or ValueError when it is not one."""
        check_keys("lidar", values, cls)
        return cls(
            frame=str(values["frame"]),
            elevations_deg=elevations_deg(values["elevations_deg"]),
            beams=int(values["beams"]),
            range_m=limits_m(values["range_m"]),
            noise=optional(values, "noise", RangeNoise.from_mapping),
        )

    def scan(
        self, raycast: Raycast, lidar_poses: Sequence[Pose], randoms: Iterable[np.random.Generator]
    ) -> list[LidarScan]:
        """Return the channel `lidar` from each pose in the map frame, with noise from the generator of each."""
        return [self.channel(ranges_m) for ranges_m in self.ranges(raycast, lidar_poses, randoms)]

    @property
    def rays(self) -> int:
        """Number of ranges in a scan."""
        return len(self.elevations_deg) * self.beams

    def ranges(
        self, raycast: Raycast, lidar_poses: Sequence[Pose], randoms: Iterable[np.random.Generator]
    ) -> npt.NDArray[np.float32]:
        """Return the ranges (poses, rings, beams) of `scan`."""
        elevations_rad, azimuths_rad = np.radians(self.elevations_deg), _around(self.beams)
        along = directions(elevations_rad, azimuths_rad).reshape(-1, 3)
        ranges_m = _measure(raycast, lidar_poses, along, self.range_m, self.noise, randoms)
        return ranges_m.astype(np.float32).reshape(-1, len(elevations_rad), self.beams)

    def channel(self, ranges_m: npt.NDArray[np.floating]) -> LidarScan:
        """Return the channel `lidar` of ranges (rings, beams), or of as many in a row."""
        return {
            "frame_id": self.frame,
            "ranges_m": ranges_m.astype(np.float32).reshape(len(self.elevations_deg), self.beams),
            "elevations_rad": np.radians(self.elevations_deg),
            "azimuths_rad": _around(self.beams),
        }


def _around(beams: int) -> npt.NDArray[np.float64]:
    return np.linspace(-np.pi, np.pi, beams, endpoint=False)


def _measure(
    raycast: Raycast,
    poses: Sequence[Pose],
    along: npt.NDArray[np.float64],
    range_m: tuple[float, float],
    noise: RangeNoise | None,
    randoms: Iterable[np.random.Generator],
) -> npt.NDArray[np.float64]:
    """Return ranges (poses, rays) along (rays, 3) in each pose's frame: +inf beyond the limits, -inf before them."""
    nearest_m, farthest_m = range_m
    bases = matrices(poses)
    origins = np.repeat(bases[:, :3, 3], len(along), 0)
    rays = np.matmul(along, bases[:, :3, :3].transpose(0, 2, 1)).reshape(-1, 3)
    ranges_m = raycast(origins, rays, farthest_m).astype(np.float64).reshape(-1, len(along))
    if noise:
        ranges_m = np.stack([noise.apply(*each) for each in zip(ranges_m, randoms, strict=True)])
        ranges_m[ranges_m > farthest_m] = np.inf
    ranges_m[ranges_m < nearest_m] = -np.inf
    return ranges_m
