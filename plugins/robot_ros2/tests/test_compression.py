"""Compressed pictures are read again as what was sent, as nearly as the format can say it."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from rclpy.serialization import deserialize_message, serialize_message

from benchbot_robot_ros2.callbacks import find
from benchbot_robot_ros2.compression import compress
from benchbot_robot_ros2.messages import stamp_ns

SIZES = arrays.array_shapes(min_dims=2, max_dims=2, max_side=8)


def over_the_wire(channel: str, pixels: npt.NDArray[Any]) -> Any:
    sent = compress(channel, pixels, stamp_ns=12_000_000_034, frame_id="eye")
    arrived = deserialize_message(serialize_message(sent), type(sent))
    assert (stamp_ns(arrived), arrived.header.frame_id) == (12_000_000_034, "eye")
    return find(channel).decode({"": arrived})


@given(arrays.arrays(np.float32, SIZES, elements=st.floats(0.0625, 20, width=32)))
def test_depth_comes_through_within_the_error_that_16_bits_leave(depth_m: npt.NDArray[np.float32]) -> None:
    seen = over_the_wire("image_depth", depth_m)
    nearest_m, farthest_m = float(depth_m.min()), max(float(depth_m.max()), 1.01 * float(depth_m.min()))
    step = (1 / nearest_m - 1 / farthest_m) / 65534
    # Half a step of inverse depth, and what float32 rounds.
    allowed_m = np.square(depth_m, dtype=np.float64) * 0.6 * step + 2e-5 * depth_m
    assert (np.abs(seen - depth_m) <= allowed_m).all()


@pytest.mark.parametrize("nothing", [np.nan, np.inf, -np.inf, 0.0])
def test_what_is_no_distance_is_invalid(nothing: float) -> None:
    seen = over_the_wire("image_depth", np.array([[1.0, nothing], [2.0, 3.0]], np.float32))
    assert np.isnan(seen).tolist() == [[False, True], [False, False]]


def test_a_picture_of_nothing_is_all_invalid() -> None:
    assert np.isnan(over_the_wire("image_depth", np.full((2, 3), np.inf, np.float32))).all()


def test_colours_come_through_in_their_order() -> None:
    picture = np.zeros((32, 48, 3), np.uint8)
    picture[:, :16, 0], picture[:, 16:32, 1], picture[:, 32:, 2] = 200, 150, 100
    seen = over_the_wire("image_rgb", picture)
    # JPEG blurs colours next to edges.
    for first in (0, 16, 32):
        within = slice(first + 4, first + 12)
        assert np.abs(seen[4:28, within].astype(int) - picture[4:28, within]).max() <= 4


def test_formats_are_those_of_image_transport() -> None:
    rgb = compress("image_rgb", np.zeros((2, 2, 3), np.uint8), stamp_ns=0, frame_id="eye")
    depth = compress("image_depth", np.ones((2, 2), np.float32), stamp_ns=0, frame_id="eye")
    assert (rgb.format, depth.format) == ("rgb8; jpeg compressed bgr8", "32FC1; compressedDepth png")
