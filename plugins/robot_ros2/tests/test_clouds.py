"""Point clouds of lidars, as their drivers publish them."""

from typing import Any

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField

from benchbot_robot_ros2.clouds import lidar

FLOAT32, UINT16 = PointField.FLOAT32, PointField.UINT16
ELEVATIONS_RAD = np.radians([-2.0, 0.0, 4.0])
AZIMUTHS_RAD = np.radians([-180.0, -90.0, 0.0, 90.0])


def cloud(ranges_m: Any, *, order: str = "<", padding: int = 0) -> Any:
    """An organised cloud of x, y, z and ring, as the velodyne driver's: points that are missing are NaN."""
    ranges_m = np.asarray(ranges_m, np.float64)
    level = np.cos(ELEVATIONS_RAD)[:, None]
    layout = np.dtype([("x", order + "f4"), ("y", order + "f4"), ("z", order + "f4"), ("ring", order + "u2")])
    points = np.zeros(ranges_m.shape, layout)
    points["x"] = ranges_m * level * np.cos(AZIMUTHS_RAD)
    points["y"] = ranges_m * level * np.sin(AZIMUTHS_RAD)
    points["z"] = ranges_m * np.sin(ELEVATIONS_RAD)[:, None]
    rows = points.view(np.uint8).reshape(len(points), -1)
    rows = np.pad(rows, ((0, 0), (0, padding)))
    fields = [(name, 4 * place, FLOAT32) for place, name in enumerate("xyz")] + [("ring", 12, UINT16)]
    return PointCloud2(
        height=ranges_m.shape[0],
        width=ranges_m.shape[1],
        fields=[PointField(name=name, offset=at, datatype=kind, count=1) for name, at, kind in fields],
        is_bigendian=order == ">",
        point_step=layout.itemsize,
        row_step=rows.shape[1],
        data=rows.tobytes(),
    )


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("padding", [0, 6])
def test_angles_are_those_of_the_points(order: str, padding: int) -> None:
    ranges_m = np.array([[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, np.nan, 8.0], [9.0, 10.0, 11.0, 12.0]])
    seen = lidar(cloud(ranges_m, order=order, padding=padding))
    np.testing.assert_allclose(seen["ranges_m"], ranges_m, rtol=1e-6)
    np.testing.assert_allclose(seen["elevations_rad"], ELEVATIONS_RAD, atol=1e-6)
    # The first column lies on the border between -pi and pi.
    np.testing.assert_allclose(np.exp(1j * seen["azimuths_rad"]), np.exp(1j * AZIMUTHS_RAD), atol=1e-6)
    assert (np.abs(seen["azimuths_rad"]) <= np.pi).all()


def test_what_did_not_come_back_is_invalid_and_its_direction_unknown() -> None:
    ranges_m = np.array([[np.nan, 2.0, 3.0, 0.0], [np.nan] * 4, [np.nan, 1.0, 1.0, np.nan]])
    seen = lidar(cloud(ranges_m))
    assert np.isnan(seen["ranges_m"]).sum() == 8
    assert np.isnan(seen["elevations_rad"]).tolist() == [False, True, False]
    assert np.isnan(seen["azimuths_rad"]).tolist() == [True, False, False, True]


def broken(**changes: Any) -> Any:
    message = cloud(np.ones((3, 4)))
    for name, value in changes.items():
        setattr(message, name, value)
    return message


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (broken(height=1, width=12, row_step=168), "organize_cloud"),
        (broken(data=b"12345678"), "cut off"),
        (broken(row_step=8), "cut off"),
        (broken(fields=broken().fields[:2]), "'z'"),
    ],
)
def test_other_clouds_are_refused(message: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        lidar(message)
