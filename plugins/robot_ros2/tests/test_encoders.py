from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from rclpy.serialization import deserialize_message, serialize_message

from benchbot_robot_ros2.callbacks import find
from benchbot_robot_ros2.encoders import encode
from benchbot_robot_ros2.messages import stamp_ns

JOINTS = ("names", "positions", "velocities", "efforts")
SIZES = arrays.array_shapes(min_dims=2, max_dims=2, max_side=6)


def over_the_wire(channel: str, value: Any) -> Any:
    """Encode, serialise, deserialise and decode, as two processes do."""
    parts = encode(channel, value, stamp_ns=12_000_000_034, frame_id="eye")
    arrived = {part: deserialize_message(serialize_message(message), type(message)) for part, message in parts.items()}
    return find(channel).decode(arrived)


@given(SIZES.flatmap(lambda size: arrays.arrays(np.uint8, (*size, 3))))
def test_colour_comes_through(picture: npt.NDArray[np.uint8]) -> None:
    np.testing.assert_array_equal(over_the_wire("image_rgb", picture), picture)


@given(arrays.arrays(np.float32, SIZES, elements=st.floats(width=32)))
def test_depth_comes_through_with_everything_that_is_no_number(depth_m: npt.NDArray[np.float32]) -> None:
    np.testing.assert_array_equal(over_the_wire("image_depth", depth_m), depth_m)


@given(
    SIZES.flatmap(lambda size: st.tuples(arrays.arrays(np.uint8, size), arrays.arrays(np.uint16, size))),
    st.dictionaries(st.text(), st.integers(0, 64)),
)
def test_segmentation_comes_through(
    pictures: tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint16]], class_ids: dict[str, int]
) -> None:
    classes, instances = pictures
    value = {"class_segment_img": classes, "instance_segment_img": instances, "class_ids": class_ids}
    seen = over_the_wire("image_segment", value)
    assert seen["class_ids"] == class_ids
    for part, dtype in (("class_segment_img", np.uint8), ("instance_segment_img", np.uint16)):
        assert seen[part].dtype == dtype
        np.testing.assert_array_equal(seen[part], value[part])


@given(SIZES.flatmap(lambda size: arrays.arrays(np.float32, (size[0] + 1, size[1]), elements=st.floats(0.5, width=32))))
def test_a_lidar_comes_through_with_everything_that_is_no_number(ranges_m: npt.NDArray[np.float32]) -> None:
    rings, beams = ranges_m.shape
    ranges_m[0, 0], ranges_m[-1, -1] = np.nan, -np.inf
    angles = {
        "elevations_rad": np.linspace(-0.25, 0.25, rings),
        "azimuths_rad": np.linspace(-np.pi, np.pi, beams, endpoint=False),
    }
    seen = over_the_wire("lidar", {"frame_id": "eye", "ranges_m": ranges_m, **angles})
    assert seen["frame_id"] == "eye"
    assert seen["ranges_m"].dtype == np.float32
    np.testing.assert_array_equal(seen["ranges_m"], ranges_m)
    for name, expected in angles.items():
        np.testing.assert_allclose(seen[name], expected, atol=1e-6)


@pytest.mark.parametrize("channel", ["image_rgb_info", "image_depth_info", "image_segment_info"])
def test_a_camera_model_comes_through(channel: str) -> None:
    matrix = np.array([[480.0, 0, 479.5], [0, 481.0, 269.5], [0, 0, 1]])
    projection = np.hstack([matrix, np.zeros((3, 1))])
    sent: dict[str, Any] = {
        "frame_id": "eye",
        "height": 540,
        "width": 960,
        "matrix_intrinsics": matrix,
        "matrix_projection": projection,
    }
    seen = over_the_wire(channel, sent)
    assert seen.keys() == sent.keys()
    assert all(np.array_equal(seen[key], sent[key]) for key in sent)


def test_a_distorted_camera_says_so() -> None:
    model = {"height": 3, "width": 4, "matrix_intrinsics": np.eye(3), "matrix_projection": np.eye(3, 4)}
    coefficients = np.array([-0.05, 0.01, 5e-4, -5e-4, 0.002])
    model |= {"distortion_model": "plumb_bob", "distortion_coefficients": coefficients}
    (message,) = encode("image_rgb_info", model, stamp_ns=0, frame_id="eye").values()
    assert message.distortion_model == "plumb_bob"
    np.testing.assert_array_equal(message.d, coefficients)


@given(
    arrays.arrays(np.float32, st.integers(3, 400), elements=st.floats(0.5, 20, width=32)),
    st.sampled_from([np.inf, -np.inf, np.nan]),
)
def test_a_full_turn_comes_through(ranges_m: npt.NDArray[np.float32], special: float) -> None:
    ranges_m[0] = special
    angles_rad = np.linspace(-np.pi, np.pi, len(ranges_m), endpoint=False)
    sent = {"scans": np.stack([ranges_m, angles_rad], 1), "range_min": 0.5, "range_max": 20.0}
    seen = over_the_wire("laser", sent)
    np.testing.assert_array_equal(seen["scans"][:, 0], ranges_m)
    np.testing.assert_allclose(seen["scans"][:, 1], angles_rad, atol=1e-6)
    assert (seen["range_min"], seen["range_max"]) == (0.5, 20.0)


def test_a_scan_that_was_wrapped_is_encoded_as_the_turn_that_it_was() -> None:
    angles_rad = np.array([3.0, 3.1, 3.2 - 2 * np.pi, 3.3 - 2 * np.pi])
    sent = {"scans": np.stack([np.ones(4), angles_rad], 1), "range_min": 0.1, "range_max": 9.0}
    message = encode("laser", sent, stamp_ns=0, frame_id="lidar")[""]
    assert message.angle_increment == pytest.approx(0.1)
    np.testing.assert_allclose(over_the_wire("laser", sent)["scans"][:, 1], angles_rad, atol=1e-6)


def test_one_beam_is_a_scan() -> None:
    sent = {"scans": np.array([[2.0, 0.5]]), "range_min": 0.1, "range_max": 9.0}
    assert over_the_wire("laser", sent)["scans"].tolist() == [[2.0, 0.5]]


def test_every_part_with_a_header_has_the_same_stamp_and_frame() -> None:
    value = {
        "class_segment_img": np.zeros((2, 2), np.uint8),
        "instance_segment_img": np.zeros((2, 2), np.uint16),
        "class_ids": {},
    }
    parts = encode("image_segment", value, stamp_ns=7_000_000_009, frame_id="eye")
    assert {part: stamp_ns(message) for part, message in parts.items()} == {
        "class_segment_img": 7_000_000_009,
        "instance_segment_img": 7_000_000_009,
        "class_ids": None,
    }
    assert parts["class_segment_img"].header.frame_id == "eye"


def test_a_picture_that_is_a_view_is_encoded_as_what_it_shows() -> None:
    mirrored = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)[:, ::-1]
    np.testing.assert_array_equal(over_the_wire("image_rgb", mirrored), mirrored)


@pytest.mark.parametrize(
    ("channel", "value", "complaint"),
    [
        ("poses", {}, "the channel 'poses' has no messages"),
        ("image_rgb", np.zeros((4, 4), np.uint8), r"an array of the shape \(4, 4\) is no rgb8 picture"),
        ("image_rgb", np.zeros((4, 4, 4), np.uint8), "is no rgb8 picture"),
        ("image_rgb", np.zeros((4, 4, 3)), "an array of float64 is no rgb8 picture"),
        ("image_depth", np.zeros((4, 0), np.float32), "is no 32FC1 picture"),
        ("image_depth", np.zeros((4, 4)), "an array of float64 is no 32FC1 picture"),
        ("laser", {"scans": np.zeros((0, 2))}, "the scan is empty"),
        ("laser", {"scans": np.array([[1, 0], [1, 0.1], [1, 0.3]])}, "the angles of the scan are not evenly spaced"),
        ("laser", {"scans": np.array([[1, 0], [1, np.nan]])}, "the angles of the scan are not evenly spaced"),
    ],
)
def test_what_no_message_can_hold_is_refused_in_words(channel: str, value: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        encode(channel, value, stamp_ns=0, frame_id="eye")


VECTORS = arrays.arrays(np.float64, 3, elements=st.floats(-100, 100))


@given(VECTORS, VECTORS, st.booleans())
def test_an_inertial_measurement_comes_through_with_what_is_not_measured(
    turn_radps: npt.NDArray[np.float64], force_mps2: npt.NDArray[np.float64], knows_turn: bool
) -> None:
    sent = {
        "orientation_xyzw": np.full(4, np.nan),
        "angular_velocity_radps": turn_radps if knows_turn else np.full(3, np.nan),
        "linear_acceleration_mps2": force_mps2,
    }
    seen = over_the_wire("imu", sent)
    assert seen.keys() == sent.keys()
    for key, values in sent.items():
        np.testing.assert_array_equal(seen[key], values)
    (message,) = encode("imu", sent, stamp_ns=0, frame_id="base_link").values()
    assert message.orientation_covariance[0] == -1
    assert message.angular_velocity_covariance[0] == (0 if knows_turn else -1)


@given(arrays.arrays(np.float64, (3, 7), elements=st.floats(allow_infinity=False, allow_nan=False)))
def test_joints_come_through(values: npt.NDArray[np.float64]) -> None:
    names = ["base", "shoulder", "elbow", "forearm", "wrist", "flange", "gripper"]
    seen = over_the_wire("joint_states", dict(zip(JOINTS, (names, *values), strict=True)))
    assert seen["names"] == names
    np.testing.assert_array_equal(np.stack([seen[key] for key in JOINTS[1:]]), values)
