"""Made-up observations conform whatever the pose; each kind of damage to one is found out."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.channels import OBSERVATIONS
from benchbot.core.geometry import Pose
from benchbot.plugins.authoring.conformance.fake_robot import fake_observations
from benchbot.plugins.authoring.conformance.observations import CHECKS, check_value
from benchbot.plugins.authoring.conformance.properties import Violation


def sample(channel: str) -> Any:
    seen: Mapping[str, Any] = fake_observations([channel], Pose.planar(1.0, 2.0, 0.5), np.random.default_rng(0))
    return seen[channel]


@given(
    x=st.floats(-100, 100), y=st.floats(-100, 100), yaw_rad=st.floats(-10, 10), seed=st.integers(0, 2**32),
)  # fmt: skip
def test_samples_conform_wherever_the_robot_is(x: float, y: float, yaw_rad: float, seed: int) -> None:
    seen = fake_observations(OBSERVATIONS, Pose.planar(x, y, yaw_rad), np.random.default_rng(seed))
    for channel, value in seen.items():
        assert check_value(channel, value)


def test_every_channel_has_a_check() -> None:
    assert set(CHECKS) == set(OBSERVATIONS)


def changed(channel: str, **entries: Any) -> Any:
    return sample(channel) | entries


def depth(value: float) -> Any:
    image = sample("image_depth")
    image[5, 5] = value
    return image


def pose(**entries: Any) -> Any:
    poses = sample("poses")
    poses["camera"] |= entries
    return poses


def scans(range_m: float, angle_rad: float = 0.0) -> Any:
    laser = sample("laser")
    laser["scans"][3] = (range_m, angle_rad)
    return laser


@pytest.mark.parametrize(
    ("channel", "value", "words"),
    [
        ("image_rgb", [[0]], "is a list"),
        ("image_rgb", sample("image_rgb").astype(np.float32), "is float32"),
        ("image_rgb", sample("image_rgb")[..., :1], "Give (H, W, 3)"),
        ("image_depth", sample("image_depth").astype(np.float64), "is float64"),
        ("image_depth", sample("image_depth")[..., None], "Give (H, W)"),
        ("image_depth", depth(0.0), "never 0"),
        ("image_depth", depth(-1.0), "least depth is -1"),
        ("image_depth", depth(4500.0), "not millimetres"),
        ("image_rgb_info", {"height": 3}, "lacks frame_id"),
        ("image_rgb_info", changed("image_rgb_info", matrix_intrinsics=np.zeros((3, 3))), "Give [[fx, s, cx]"),
        ("image_rgb_info", changed("image_rgb_info", width=10), "not in the 10 x 48 image"),
        ("image_rgb_info", changed("image_rgb_info", matrix_projection=np.eye(3)), "Give (3, 4)"),
        ("image_rgb_info", changed("image_rgb_info", distortion_model="plumb_bob"), "Give both, or neither"),
        (
            "image_segment",
            changed("image_segment", instance_segment_img=np.ones((48, 64), np.uint16)),
            "class * 1000",
        ),
        ("image_segment", changed("image_segment", class_ids={"bottle": 1}), "have no name"),
        ("image_segment", changed("image_segment", class_ids={"bottle": 1, "chair": 1}), "each once"),
        ("image_segment", changed("image_segment", class_ids={"bottle": 1, "chair": 300}), "from 1 to 254"),
        ("laser", changed("laser", scans=np.zeros((4, 3))), "(4, 3)"),
        ("laser", scans(1.0, 90.0), "Give radians"),
        ("laser", scans(0.0), "REP-117"),
        ("laser", scans(11.0), "REP-117"),
        ("laser", changed("laser", range_min=20.0), "the smaller one first"),
        ("lidar", changed("lidar", azimuths_rad=np.zeros(5)), "Give (4, 5)"),
        ("lidar", changed("lidar", elevations_rad=np.array([0.0, 10.0, 20.0, 30.0])), "right angle"),
        ("imu", changed("imu", orientation_xyzw=np.ones(4)), "unit quaternion"),
        ("imu", changed("imu", angular_velocity_radps=np.array([0.0, 0.0, np.inf])), "infinite"),
        ("poses", {}, "mapping of frame to pose"),
        ("poses", pose(rotation_xyzw=np.array([1.0, 1.0, 0.0, 0.0])), "has the norm"),
        ("poses", pose(rotation_rpy=np.array([90.0, 0.0, 90.0])), "different rotations"),
        ("poses", pose(rotation_xyzw=np.array([1.0, 0.0, 0.0, 0.0])), "different rotations"),
        ("poses", pose(translation_xyz=np.array([np.nan, 0.0, 0.0])), "finite metres"),
        ("poses", {"camera": {"translation_xyz": np.zeros(3)}}, "lacks parent_frame"),
        ("goal", np.zeros(3), "Give (2,)"),
    ],
)
def test_damage_is_found_out(channel: str, value: Any, words: str) -> None:
    with pytest.raises(Violation) as found:
        check_value(channel, value)
    assert words in f"{found.value.detail} {found.value.fix}"
