"""PointCloud2 messages of multi-beam lidars, as observations."""

from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import LidarScan
from benchbot_robot_ros2.sensors import wrapped

# sensor_msgs/msg/PointField: FLOAT32 and FLOAT64.
_DTYPES = {7: "f4", 8: "f8"}

Array = npt.NDArray[np.float64]


def lidar(message: Any) -> LidarScan:
    """Return an organised sensor_msgs/msg/PointCloud2, a row a ring, as the channel `lidar` has it.

    Fields `distance`, `elevation` and `azimuth` (metres, radians; those of Autoware's PointXYZIRCAEDT) are taken as
    they are. Where they are missing, distances are those of x, y and z, and a ring's elevation and a column's azimuth
    the medians of their points, NaN where there is none. Points at the origin or of no numbers are NaN then: such a
    cloud does not say whether they are too far, too near or invalid.
    Raises ValueError when the cloud is not organised, has no such fields, or its data are cut off.
    """
    if message.height < 2:
        raise ValueError(
            "its cloud is not organised: it has one row. Let the lidar's driver publish a row for each ring (the "
            "velodyne driver's parameter organize_cloud)"
        )
    fields = _fields(message)
    lacking = [axis for axis in "xyz" if axis not in fields]
    if lacking:
        raise ValueError(f"its points have no field '{lacking[0]}' of floating-point numbers")
    x, y, z = (fields[axis] for axis in "xyz")
    level_m = np.hypot(x, y)
    ranges_m = fields.get("distance", np.hypot(level_m, z))
    ranges_m = np.where(ranges_m == 0, np.nan, ranges_m)
    is_point = np.isfinite(ranges_m)
    elevations_rad = fields.get("elevation", np.where(is_point, np.arctan2(z, level_m), np.nan))
    azimuths_rad = fields.get("azimuth", np.where(is_point, np.arctan2(y, x), np.nan))
    return {
        "frame_id": message.header.frame_id,
        "ranges_m": ranges_m.astype(np.float32),
        "elevations_rad": _median(elevations_rad),
        "azimuths_rad": _middle_angle(azimuths_rad.T),
    }


def _fields(message: Any) -> dict[str, Array]:
    """Return the floating-point fields of a cloud by name, each (height, width)."""
    order = ">" if message.is_bigendian else "<"
    known = [field for field in message.fields if field.datatype in _DTYPES and field.count == 1]
    layout = np.dtype(
        {
            "names": [field.name for field in known],
            "formats": [order + _DTYPES[field.datatype] for field in known],
            "offsets": [field.offset for field in known],
            "itemsize": message.point_step,
        }
    )
    height, width = message.height, message.width
    if message.row_step < width * message.point_step or len(message.data) < height * message.row_step:
        raise ValueError(f"its data are cut off: {len(message.data)} bytes for {height} x {width} points")
    rows = np.frombuffer(message.data, np.uint8, height * message.row_step).reshape(height, message.row_step)
    points = np.ascontiguousarray(rows[:, : width * message.point_step]).view(layout).reshape(height, width)
    return {field.name: points[field.name].astype(np.float64) for field in known}


def _median(values: Array) -> Array:
    """Return the median of each row's numbers, NaN where a row has none."""
    medians = np.full(len(values), np.nan)
    for i, row in enumerate(values):
        numbers = row[np.isfinite(row)]
        if numbers.size:
            medians[i] = np.median(numbers)
    return medians


def _middle_angle(angles_rad: Array) -> Array:
    """Return the middle of each row's angles in [-pi, pi), whose numbers may lie on both sides of pi."""
    first = _median(np.where(np.cumsum(np.isfinite(angles_rad), 1) == 1, angles_rad, np.nan))[:, None]
    off_rad = (angles_rad - first + np.pi) % (2 * np.pi) - np.pi
    return wrapped(first[:, 0] + _median(off_rad))
