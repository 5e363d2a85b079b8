import math
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from benchbot.plugin import CameraModel, InertialMeasurement, LaserScan, LidarScan
from benchbot_record_mcap import messages
from plugins.record_mcap.tests.bags import through_cdr

HEADER = messages.header(12_000_000_034, "camera")
SHAPES = npst.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9)


def pictures() -> st.SearchStrategy[tuple[str, Any]]:
    """Make any picture of any encoding: floats of any bits, NaN payloads included."""
    return st.sampled_from(sorted(messages.ENCODINGS)).flatmap(
        lambda encoding: st.tuples(st.just(encoding), SHAPES.flatmap(lambda shape: _pixels(encoding, shape)))
    )


def _pixels(encoding: str, shape: tuple[int, ...]) -> st.SearchStrategy[Any]:
    dtype, channels = messages.ENCODINGS[encoding]
    return npst.arrays(dtype, shape if channels == 1 else (*shape, channels))


@given(pictures(), st.booleans())
def test_a_picture_keeps_every_bit(picture: tuple[str, Any], mirrored: bool) -> None:
    encoding, pixels = picture
    if mirrored:
        pixels = pixels[:, ::-1]  # not contiguous
    image = through_cdr(messages.image(pixels, encoding, HEADER))
    assert (image.height, image.width, image.encoding) == (*pixels.shape[:2], encoding)
    assert image.step * image.height == len(image.data)
    assert bytes(image.data) == pixels.tobytes()
    assert (image.header.stamp.sec, image.header.stamp.nanosec, image.header.frame_id) == (12, 34, "camera")


def test_a_picture_of_either_byte_order_is_written_little_endian() -> None:
    image = messages.image(np.array([[1, 258]], ">u2"), "mono16", HEADER)
    assert (bytes(image.data), image.is_bigendian) == (b"\x01\x00\x02\x01", 0)


def test_depth_keeps_what_is_not_a_number() -> None:
    # REP-118: invalid, too far, too near.
    depth = np.array([[np.nan, np.inf], [-np.inf, 1.5]], np.float32)
    image = through_cdr(messages.image(depth, "32FC1", HEADER))
    np.testing.assert_array_equal(np.frombuffer(bytes(image.data), "<f4").reshape(2, 2), depth)


@given(
    first=st.floats(-math.pi, math.pi),
    beams=st.integers(2, 400),
    turn=st.floats(0.01, 2 * math.pi),
    clockwise=st.booleans(),
    data=st.data(),
)
def test_a_scan_keeps_ranges_and_angles(first: float, beams: int, turn: float, clockwise: bool, data: Any) -> None:
    increment = (-1 if clockwise else 1) * turn / beams
    angles = (first + increment * np.arange(beams) + np.pi) % (2 * np.pi) - np.pi
    ranges = data.draw(npst.arrays("float32", beams))
    laser: LaserScan = {"scans": np.stack([ranges.astype(float), angles], 1), "range_min": 0.1, "range_max": 20.0}
    scan = through_cdr(messages.laser_scan(laser, HEADER))
    np.testing.assert_array_equal(np.array(scan.ranges, np.float32), ranges)
    read = scan.angle_min + scan.angle_increment * np.arange(beams)
    assert np.abs(np.angle(np.exp(1j * (read - angles)))).max() < 1e-4
    assert scan.angle_max == pytest.approx(read[-1], abs=1e-4)


@pytest.mark.parametrize("beams", [0, 1])
def test_a_scan_may_be_almost_nothing(beams: int) -> None:
    laser: LaserScan = {"scans": np.full((beams, 2), 0.5), "range_min": 0.1, "range_max": math.inf}
    scan = through_cdr(messages.laser_scan(laser, HEADER))
    assert (list(scan.ranges), scan.angle_increment, scan.range_max) == ([0.5] * beams, 0.0, math.inf)


@given(data=st.data(), rings=st.integers(1, 4), beams=st.integers(1, 9))
def test_a_cloud_keeps_ranges_and_angles(data: Any, rings: int, beams: int) -> None:
    ranges = data.draw(npst.arrays("float32", (rings, beams)))
    lidar: LidarScan = {
        "frame_id": "lidar",
        "ranges_m": ranges,
        "elevations_rad": np.linspace(-0.2, 0.2, rings),
        "azimuths_rad": np.arange(beams) / 9,
    }
    cloud = through_cdr(messages.point_cloud(lidar, HEADER))
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "azimuth", "elevation", "distance"]
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (rings, beams, 24, 24 * beams)
    points = np.frombuffer(bytes(cloud.data), "<f4").reshape(rings, beams, 6)
    np.testing.assert_array_equal(points[..., 5], ranges)
    np.testing.assert_allclose(points[:, 0, 4], lidar["elevations_rad"], atol=1e-6)
    np.testing.assert_array_equal(np.isnan(points[..., :3]).all(-1), ~np.isfinite(ranges))


@pytest.mark.parametrize("angles", [[0, 0.1, 0.3], [0, math.nan, 0.2]])
def test_a_scan_of_uneven_beams_is_refused(angles: list[float]) -> None:
    laser: LaserScan = {"scans": np.stack([np.ones(3), angles], 1), "range_min": 0.1, "range_max": 20.0}
    with pytest.raises(ValueError, match="evenly spaced"):
        messages.laser_scan(laser, HEADER)


numbers = st.floats(allow_nan=False)


@given(st.lists(numbers, min_size=10, max_size=10))
def test_inertial_measurements_come_back(values: list[float]) -> None:
    observed: InertialMeasurement = {
        "orientation_xyzw": np.array(values[:4]),
        "angular_velocity_radps": np.array(values[4:7]),
        "linear_acceleration_mps2": np.array(values[7:]),
    }
    imu = through_cdr(messages.imu(observed, HEADER))
    read = [imu.orientation.x, imu.orientation.y, imu.orientation.z, imu.orientation.w]
    read += [imu.angular_velocity.x, imu.angular_velocity.y, imu.angular_velocity.z]
    read += [imu.linear_acceleration.x, imu.linear_acceleration.y, imu.linear_acceleration.z]
    assert read == values
    assert imu.orientation_covariance[0] == 0


@pytest.mark.parametrize("missing", ["orientation", "angular_velocity", "linear_acceleration"])
def test_what_an_imu_does_not_measure_is_marked(missing: str) -> None:
    channels = {"orientation": "orientation_xyzw", "angular_velocity": "angular_velocity_radps"}
    channels |= {"linear_acceleration": "linear_acceleration_mps2"}
    values = {key: np.full(4 if part == "orientation" else 3, 0.5) for part, key in channels.items()}
    values[channels[missing]] *= np.nan
    imu = through_cdr(messages.imu(cast(InertialMeasurement, values), HEADER))
    for part in channels:
        assert getattr(imu, f"{part}_covariance")[0] == (-1 if part == missing else 0)
    assert math.isnan(getattr(imu, missing).x)


def test_a_distorted_camera_says_so() -> None:
    coefficients = np.array([-0.05, 0.01, 5e-4, -5e-4, 0.002])
    plain = CameraModel(
        frame_id="camera", height=3, width=4, matrix_intrinsics=np.eye(3), matrix_projection=np.eye(3, 4)
    )
    distorted: CameraModel = {**plain, "distortion_model": "plumb_bob", "distortion_coefficients": coefficients}
    assert messages.camera_info(plain, HEADER).d.tolist() == [0.0] * 5
    message = messages.camera_info(distorted, HEADER)
    assert message.distortion_model == "plumb_bob"
    np.testing.assert_array_equal(message.d, coefficients)
