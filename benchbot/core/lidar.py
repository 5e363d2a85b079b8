"""Multi-beam lidars: their measurements as points and as the records of a point cloud."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.core.channels import LidarScan

FIELDS = ("x", "y", "z", "azimuth", "elevation", "distance")
"""Fields of a point of a cloud, named as in Autoware's PointXYZIRCAEDT; metres and radians."""
POINT = np.dtype([(name, "<f4") for name in FIELDS])
OFFSETS = {name: 4 * place for place, name in enumerate(FIELDS)}
"""Offsets of the fields of a `POINT`, in bytes."""


def elevations_deg(values: Any) -> tuple[float, ...]:
    """Read the elevations that a robot's `lidar` declares.

    They are a list, or `{count, from_deg, to_deg}`: evenly spaced, both ends among them.
    Raises KeyError, TypeError or ValueError when it is neither.
    """
    if not isinstance(values, Mapping):
        return tuple(float(value) for value in values)
    unknown = set(values) - {"count", "from_deg", "to_deg"}
    if unknown:
        raise ValueError(f"elevations_deg has no '{unknown.pop()}', only count, from_deg, to_deg")
    return tuple(np.linspace(float(values["from_deg"]), float(values["to_deg"]), int(values["count"])).tolist())


def points_m(lidar: LidarScan) -> NDArray[np.float64]:
    """Return where the beams of the channel `lidar` ended, (rings, beams, 3) in metres, in the lidar's own frame.

    x looks ahead, y to the left, z up (REP-103). What is no distance, as too far, too near or invalid, is NaN.
    """
    ranges_m = np.asarray(lidar["ranges_m"], np.float64)
    ranges_m = np.where(np.isfinite(ranges_m), ranges_m, np.nan)
    return ranges_m[..., None] * directions(lidar["elevations_rad"], lidar["azimuths_rad"])


def directions(elevations_rad: NDArray[np.floating], azimuths_rad: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return unit vectors (rings, beams, 3) along the beams, in the lidar's frame."""
    elevation, azimuth = np.meshgrid(
        np.asarray(elevations_rad, np.float64), np.asarray(azimuths_rad, np.float64), indexing="ij"
    )
    level = np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=-1)


def cloud(lidar: LidarScan) -> NDArray[Any]:
    """Return the records (rings, beams) of `POINT`; `distance` says by REP-117 why a point is NaN.

    Raises ValueError when the ranges are not (rings, beams) of the angles.
    """
    ranges_m = np.asarray(lidar["ranges_m"])
    elevations_rad, azimuths_rad = np.asarray(lidar["elevations_rad"]), np.asarray(lidar["azimuths_rad"])
    if ranges_m.shape != (*elevations_rad.shape, *azimuths_rad.shape) or ranges_m.ndim != 2:
        raise ValueError(
            f"ranges of the shape {ranges_m.shape} are not those of {elevations_rad.shape} elevations and "
            f"{azimuths_rad.shape} azimuths"
        )
    records = np.empty(ranges_m.shape, POINT)
    # What is too far for float32 is too far for any lidar.
    with np.errstate(over="ignore"):
        for axis, values in zip("xyz", np.moveaxis(points_m(lidar), -1, 0), strict=True):
            records[axis] = values
        records["azimuth"], records["elevation"] = azimuths_rad, elevations_rad[:, None]
        records["distance"] = ranges_m
    return records
