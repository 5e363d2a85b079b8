import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, Vector3
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, Imu, JointState, LaserScan, RegionOfInterest
from std_msgs.msg import Header

from benchbot_robot_ros2.sensors import camera_model, imu, joint_states, laser

K = [480.0, 0.0, 479.5, 0.0, 481.0, 269.5, 0.0, 0.0, 1.0]
P = [480.0, 0.0, 479.5, -57.6, 0.0, 481.0, 269.5, 0.0, 0.0, 0.0, 1.0, 0.0]


def info(**fields: Any) -> Any:
    return CameraInfo(**{"header": Header(frame_id="eye"), "width": 960, "height": 540, "k": K, "p": P, **fields})


def scan(**fields: Any) -> Any:
    """A scan as it comes over the wire, where its numbers are float32."""
    message = LaserScan(
        **{"angle_min": -0.5, "angle_increment": 0.25, "range_min": 0.5, "range_max": 10.0, "ranges": [1.0], **fields}
    )
    return deserialize_message(serialize_message(message), LaserScan)


def test_a_camera_model_has_its_matrices_and_size() -> None:
    model = camera_model(info())
    assert (model["frame_id"], model["width"], model["height"]) == ("eye", 960, 540)
    assert model["matrix_intrinsics"].tolist() == [K[:3], K[3:6], K[6:]]
    assert model["matrix_projection"].tolist() == [P[:4], P[4:8], P[8:]]


def test_no_binning_and_no_region_may_be_said_in_so_many_numbers() -> None:
    whole = RegionOfInterest(width=960, height=540)
    assert camera_model(info(binning_x=1, binning_y=1, roi=whole))["width"] == 960


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (info(k=[0.0] * 9, p=[0.0] * 12), "the camera is not calibrated"),
        (info(p=[0.0] * 12), "the camera is not calibrated"),
        (info(k=[math.nan] * 9), "numbers that are not finite"),
        (info(width=0), "an empty picture: 0 x 540 pixels"),
        (info(binning_x=2, binning_y=2), "its pictures are binned 2 x 2"),
        (info(roi=RegionOfInterest(width=100, height=50)), "a region of 100 x 50 pixels"),
    ],
)
def test_a_model_that_does_not_fit_the_pictures_is_refused_in_words(message: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        camera_model(message)


def test_a_scan_is_a_row_of_range_and_angle_per_beam() -> None:
    seen = laser(scan(ranges=[1.0, 2.0, 3.0]))
    assert seen["scans"].dtype == np.float64
    assert seen["scans"].tolist() == [[1.0, -0.5], [2.0, -0.25], [3.0, 0.0]]
    assert (seen["range_min"], seen["range_max"]) == (0.5, 10.0)


def test_ranges_outside_the_limits_become_infinite_and_the_limits_are_inside() -> None:
    ranges = [0.0, 0.49, 0.5, 10.0, 10.5, math.inf, -math.inf, math.nan]
    seen = laser(scan(ranges=ranges))["scans"][:, 0]
    np.testing.assert_array_equal(seen, [-math.inf, -math.inf, 0.5, 10.0, math.inf, math.inf, -math.inf, math.nan])


def test_a_limit_that_float32_rounds_does_not_exclude_itself() -> None:
    seen = laser(scan(ranges=[0.1, 5.6], range_min=0.1, range_max=5.6))
    assert np.isfinite(seen["scans"][:, 0]).all()


def test_a_full_turn_from_minus_pi_begins_at_minus_pi() -> None:
    step = 2 * math.pi / 900
    angles = laser(scan(angle_min=-math.pi, angle_increment=step, ranges=[1.0] * 900))["scans"][:, 1]
    assert angles[0] == -math.pi
    np.testing.assert_allclose(angles, np.linspace(-math.pi, math.pi, 900, endpoint=False), atol=1e-6)


def test_a_scanner_may_turn_clockwise() -> None:
    angles = laser(scan(angle_min=0.5, angle_increment=-0.5, ranges=[1.0] * 3))["scans"][:, 1]
    assert angles.tolist() == [0.5, 0.0, -0.5]


@given(
    st.floats(-10, 10, width=32),
    st.floats(-0.125, 0.125, width=32).filter(bool),
    st.integers(1, 300),
)
def test_angles_are_wrapped_and_point_where_the_beams_do(first: float, step: float, count: int) -> None:
    angles = laser(scan(angle_min=first, angle_increment=step, ranges=[1.0] * count))["scans"][:, 1]
    assert ((angles >= -math.pi) & (angles < math.pi)).all()
    meant = first + step * np.arange(count)
    # Turned by the difference, one arrives at the same direction.
    assert np.abs(np.exp(1j * angles) - np.exp(1j * meant)).max() < 1e-6


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (scan(ranges=[]), "it has no ranges"),
        (scan(range_min=5.0, range_max=5.0), "range_min = 5 and range_max = 5 leave no range"),
        (scan(range_max=math.nan), "leave no range"),
        (scan(angle_increment=0.0, ranges=[1.0, 1.0]), "give its ranges no directions"),
        (scan(angle_min=math.inf), "give its ranges no directions"),
    ],
)
def test_a_malformed_scan_is_refused_in_words(message: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        laser(message)


def test_an_imu_measures_orientation_rate_and_acceleration() -> None:
    measured = imu(
        Imu(
            orientation=Quaternion(x=0.0, y=0.0, z=0.6, w=0.8),
            angular_velocity=Vector3(x=0.1, y=0.2, z=0.3),
            linear_acceleration=Vector3(x=0.0, y=0.0, z=9.81),
        )
    )
    assert measured["orientation_xyzw"].tolist() == [0.0, 0.0, 0.6, 0.8]
    assert measured["angular_velocity_radps"].tolist() == [0.1, 0.2, 0.3]
    assert measured["linear_acceleration_mps2"].tolist() == [0.0, 0.0, 9.81]


def test_what_an_imu_does_not_measure_is_not_a_number() -> None:
    absent = [-1.0] + [0.0] * 8
    measured: Mapping[str, Any] = imu(
        Imu(orientation_covariance=absent, angular_velocity_covariance=absent, linear_acceleration_covariance=absent)
    )
    assert [values.shape for values in measured.values()] == [(4,), (3,), (3,)]
    assert all(np.isnan(values).all() for values in measured.values())


@pytest.mark.parametrize("w", [0.0, 2.0, math.nan])
def test_an_orientation_that_is_no_rotation_is_refused_in_words(w: float) -> None:
    with pytest.raises(ValueError, match="no rotation: the quaternion's length is"):
        imu(Imu(orientation=Quaternion(w=w)))


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (JointState(), "it has no joints"),
        (JointState(name=["a", "a"], position=[0.0, 0.0]), "two have one name"),
        (JointState(name=["a", "b"], position=[0.0]), "its 2 joints have 1 values of position"),
        (JointState(name=["a"], velocity=[0.0]), "have 0 values of position"),
        (JointState(name=["a"], position=[0.0], effort=[1.0, 2.0]), "have 2 values of effort"),
        (JointState(name=["a"], position=[math.nan]), "not finite"),
    ],
)
def test_joints_that_are_malformed_are_refused_in_words(message: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        joint_states(message)


def test_what_joints_do_not_measure_is_not_a_number() -> None:
    seen = joint_states(JointState(name=["a", "b"], position=[1.0, 2.0], effort=[3.0, 4.0]))
    assert (seen["positions"].tolist(), seen["efforts"].tolist()) == ([1.0, 2.0], [3.0, 4.0])
    assert np.isnan(seen["velocities"]).all()
