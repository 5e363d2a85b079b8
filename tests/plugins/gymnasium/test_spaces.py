from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchbot.core.errors import BenchbotError
from benchbot.plugins.gymnasium.spaces import constants, encode, observation_space, resized

ROBOT: dict[str, Any] = {
    "name": "wagon",
    "poses": ["base_link"],
    "camera": {"width": 4, "height": 2, "fx": 2, "fy": 2, "cx": 2, "cy": 1, "range_m": [0.1, 8]},
    "laser": {"beams": 5, "range_m": [0.1, 6]},
    "lidar": {"elevations_deg": {"count": 3, "from_deg": -5, "to_deg": 5}, "beams": 7, "range_m": [0.4, 60]},
}
IMU = {"orientation_xyzw": 4, "angular_velocity_radps": 3, "linear_acceleration_mps2": 3}


@given(arrays.arrays(np.float32, (2, 4)), arrays.arrays(np.float64, (5, 2)))
def test_whatever_a_sensor_says_is_in_the_space(depth_m: Any, scans: Any) -> None:
    space = observation_space(["image_depth", "laser"], ROBOT)
    encoded = encode({"image_depth": depth_m, "laser": {"scans": scans}}, space)
    assert space.contains(encoded)


@given(arrays.arrays(np.float32, (3, 7)))
def test_whatever_a_lidar_says_is_in_the_space(ranges_m: Any) -> None:
    space = observation_space(["lidar"], ROBOT)
    encoded = encode({"lidar": {"ranges_m": ranges_m}}, space)
    assert space.contains(encoded)
    assert (encoded["lidar"][ranges_m == np.inf] == 60).all()
    assert (encoded["lidar"][np.isnan(ranges_m)] == 0).all()


def test_the_angles_of_scanners_are_constant() -> None:
    scans = np.stack([np.ones(3), [-1.0, 0.0, 1.0]], 1)
    lidar = {"ranges_m": np.ones((2, 3)), "elevations_rad": np.array([0.0, 0.1]), "azimuths_rad": scans[:, 1]}
    found = constants({"laser": {"scans": scans}, "lidar": lidar})
    assert found["laser_angles_rad"].tolist() == found["lidar_azimuths_rad"].tolist() == [-1.0, 0.0, 1.0]
    assert found["lidar_elevations_rad"].tolist() == [0.0, 0.1]


@given(st.data())
def test_whatever_an_imu_says_is_in_the_space(data: st.DataObject) -> None:
    imu = {name: data.draw(arrays.arrays(np.float64, (size,))) for name, size in IMU.items()}
    space = observation_space(["imu"], ROBOT)
    assert space.contains(encode({"imu": imu}, space))


def test_nothing_measured_is_zero_and_too_far_is_the_bound() -> None:
    depth_m = np.array([[np.nan, -np.inf, np.inf, 9.0], [0.5, 8.0, 7.5, 0.0]], np.float32)
    encoded = encode({"image_depth": depth_m}, observation_space(["image_depth"], ROBOT))
    assert encoded["image_depth"].tolist() == [[0.0, 0.0, 8.0, 8.0], [0.5, 8.0, 7.5, 0.0]]


def test_camera_models_are_no_observation() -> None:
    space = observation_space(["image_rgb", "image_rgb_info"], ROBOT)
    assert list(space.spaces) == ["image_rgb"]
    with pytest.raises(BenchbotError, match="nothing that can be learnt from"):
        observation_space(["image_rgb_info"], ROBOT)


@pytest.mark.parametrize("lacking", ["camera", "laser", "lidar", "poses"])
def test_a_robot_without_sizes_is_refused_by_name(lacking: str) -> None:
    robot = {key: value for key, value in ROBOT.items() if key != lacking}
    with pytest.raises(BenchbotError, match="The robot 'wagon' does not say how large") as caught:
        observation_space(["image_depth", "laser", "lidar", "poses"], robot)
    assert f"KeyError: '{lacking}'" in caught.value.why


def test_a_simulator_that_shows_another_size_is_found_out() -> None:
    space = observation_space(["image_depth"], ROBOT)
    with pytest.raises(BenchbotError, match="'image_depth' does not fit"):
        encode({"image_depth": np.zeros((3, 4), np.float32)}, space)
    with pytest.raises(BenchbotError, match="'laser' does not fit"):
        encode({"laser": {"scans": np.zeros((5, 2))}}, space)


def test_resized_pictures_keep_the_view_sideways() -> None:
    camera = resized(ROBOT, 64, 64)["camera"]
    assert (camera["width"], camera["height"]) == (64, 64)
    assert (camera["fx"], camera["fy"], camera["cx"], camera["cy"]) == (32, 32, 32, 32)
    assert ROBOT["camera"]["width"] == 4
