"""Pixels and points: there and back again, through the camera's model, its lens and its pose."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.api import BenchbotError, Observations
from benchbot.core.channels import CameraModel
from benchbot.core.geometry import Pose
from benchbot.mapping import (
    in_frame,
    in_map_frame,
    pixel_rays,
    planar,
    point_cloud,
    project,
    rotation_matrix,
    unproject,
)
from benchbot.plugins.simulation.distortion import Distortion
from tests.plugins.mapping.casting import BOXES, OPTICAL, observe, views

Coordinates = st.floats(-10, 10)
LENSES = (None, Distortion(k1=-0.25, k2=0.06), Distortion(k1=0.1, p1=0.004, p2=-0.003, k3=0.01))


def camera(width: int = 40, height: int = 30, focal: float = 30.0, lens: Distortion | None = None) -> CameraModel:
    matrix = np.array([[focal, 0, width / 2 - 3], [0, focal * 1.05, height / 2 + 2], [0, 0, 1]])
    info = CameraModel(
        frame_id="camera", width=width, height=height, matrix_intrinsics=matrix, matrix_projection=np.eye(3, 4)
    )
    if lens is not None:
        info |= {"distortion_model": "plumb_bob", "distortion_coefficients": lens.coefficients()}
    return info


@st.composite
def poses(draw: st.DrawFn) -> Pose:
    x, y, z, w = (draw(st.floats(-1, 1)) for _ in range(4))
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    turned = (x / norm, y / norm, z / norm, w / norm) if norm > 0.1 else (0.0, 0.0, 0.0, 1.0)
    return Pose((draw(Coordinates), draw(Coordinates), draw(Coordinates)), turned)


@given(pose=poses(), lens=st.sampled_from(LENSES), focal=st.floats(20, 80), nearest_m=st.floats(0.3, 5))
def test_what_is_projected_again_is_where_it_was(
    pose: Pose, lens: Distortion | None, focal: float, nearest_m: float
) -> None:
    info, frame = camera(focal=focal, lens=lens), pose.record("map")
    depth_m = np.linspace(nearest_m, nearest_m + 4, 30 * 40, dtype=np.float32).reshape(30, 40)
    pixels, away_m = project(unproject(depth_m, info, frame).reshape(-1, 3), info, frame)

    v, u = np.mgrid[0:30, 0:40]
    np.testing.assert_allclose(pixels, np.stack([u.ravel(), v.ravel()], 1), atol=0.01)
    np.testing.assert_allclose(away_m, depth_m.ravel(), atol=1e-4)


@pytest.mark.parametrize("lens", [lens for lens in LENSES if lens])
def test_a_lens_is_that_of_the_simulator(lens: Distortion) -> None:
    """Points of a distorted picture were up to 15 cm off at 2 m when rays knew nothing of the lens."""
    info = camera(lens=lens)
    rays = pixel_rays(info)
    shown = np.linalg.inv(info["matrix_intrinsics"]) @ np.stack([*np.mgrid[0:40, 0:30].reshape(2, -1), np.ones(1200)])
    x, y = lens.undistort(shown[0], shown[1])

    np.testing.assert_allclose(rays.reshape(30, 40, 3)[..., 0].T.ravel(), x, atol=1e-6)
    np.testing.assert_allclose(rays.reshape(30, 40, 3)[..., 1].T.ravel(), y, atol=1e-6)
    assert np.abs(rays - pixel_rays(camera())).max() > 0.01


def test_depth_is_z_and_not_the_distance() -> None:
    points = unproject(np.full((30, 40), 2.0, np.float32), camera())

    np.testing.assert_allclose(points[..., 2], 2.0)
    assert np.linalg.norm(points, axis=-1).max() > 2.5


def test_invalid_depth_is_no_point_and_what_is_behind_is_in_no_picture() -> None:
    depth_m = np.full((30, 40), 2.0, np.float32)
    depth_m[0, :5] = [np.nan, np.inf, -np.inf, 0, -1]
    pixels, away_m = project([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], camera())

    assert np.isnan(unproject(depth_m, camera())).any(axis=-1).sum() == 5
    assert np.isnan(pixels[0]).all()
    np.testing.assert_allclose(pixels[1], [17, 17])
    np.testing.assert_array_equal(away_m, [-1, 1])


def test_another_model_of_a_lens_is_refused() -> None:
    info = camera() | {"distortion_model": "equidistant", "distortion_coefficients": np.ones(4)}

    with pytest.raises(BenchbotError, match="equidistant"):
        pixel_rays(info)


@given(pose=poses())
def test_frames_there_and_back_again(pose: Pose) -> None:
    points = np.array([[0.5, -0.2, 3.0], [0, 0, 0]], np.float32)

    np.testing.assert_allclose(
        in_frame(in_map_frame(points, pose.record("map")), pose.record("map")), points, atol=1e-5
    )


def test_rotations_are_those_of_the_core() -> None:
    pose = Pose.planar(0, 0, 0.7) @ OPTICAL

    np.testing.assert_allclose(rotation_matrix(pose.rotation_xyzw), pose.matrix()[:3, :3], atol=1e-12)


def test_the_ray_of_the_principal_point_goes_straight_ahead() -> None:
    matrix = np.array([[2.0, 0, 1], [0, 2, 2], [0, 0, 1]])
    info = CameraModel(frame_id="camera", width=4, height=3, matrix_intrinsics=matrix, matrix_projection=np.eye(3, 4))
    rays = pixel_rays(info).reshape(3, 4, 3)

    np.testing.assert_array_equal(rays[2, 1], [0, 0, 1])
    np.testing.assert_array_equal(rays[0, 3], [1, -1, 1])


def test_a_camera_heads_along_its_z_axis() -> None:
    pose = Pose.planar(1, 2, 0.5, z=1.0)

    assert planar(pose.record("map")) == pytest.approx((1, 2, 0.5))
    assert planar((pose @ OPTICAL).record("map"), axis=2) == pytest.approx((1, 2, 0.5))


def colored(camera_pose: Pose) -> Observations:
    """Return a frame in which each pixel's colour is its column and its row."""
    frame = observe(BOXES, camera_pose)
    info = frame["image_depth_info"]
    v, u = np.mgrid[0 : info["height"], 0 : info["width"]]
    frame["image_rgb"] = np.stack([u, v, np.zeros_like(u)], -1).astype(np.uint8)
    frame["image_rgb_info"] = info
    return frame


def test_points_have_the_colours_and_labels_of_their_pixels() -> None:
    frame = colored(views()[0])
    cloud = point_cloud(frame)
    labels = frame["image_segment"]["instance_segment_img"][cloud.rows, cloud.columns]
    chair = cloud.points[labels == 1001]

    assert cloud.colors is not None
    np.testing.assert_array_equal(cloud.colors[:, :2], np.stack([cloud.columns, cloud.rows], 1))
    assert (chair > np.array(BOXES[0][1]) - 0.01).all()
    assert (chair < np.array(BOXES[0][2]) + 0.01).all()


def test_a_colour_picture_of_another_camera_model_is_looked_up_where_points_appear() -> None:
    frame = colored(views()[0])
    info = frame["image_rgb_info"]
    # Twice as fine, and from the depth picture's column 75 on: the points on the left are not in it.
    matrix = np.diag([2.0, 2, 1]) @ info["matrix_intrinsics"]
    matrix[0, 2] -= 150
    height, width = 2 * info["height"], 2 * info["width"] - 150
    v, u = np.mgrid[0:height, 0:width]
    frame["image_rgb"] = np.stack([(u + 150) / 2, v / 2, np.zeros_like(u)], -1).astype(np.uint8)
    frame["image_rgb_info"] = info | {"matrix_intrinsics": matrix, "width": width, "height": height}
    cloud, all_points = point_cloud(frame), point_cloud(colored(views()[0]))

    assert cloud.colors is not None
    assert len(cloud.points) < len(all_points.points)
    assert (cloud.columns >= 75).all()
    np.testing.assert_allclose(cloud.colors[:, :2], np.stack([cloud.columns, cloud.rows], 1), atol=1)


@pytest.mark.parametrize(
    ("left_out", "said"),
    [
        ("image_depth", "The observation 'image_depth' is needed here, and the task does not give it."),
        ("poses", "The observation 'poses' is needed here, and the task does not give it."),
    ],
)
def test_what_the_task_does_not_give_is_named(left_out: str, said: str) -> None:
    frame: dict[str, Any] = dict(observe(BOXES, views()[0]))
    del frame[left_out]

    with pytest.raises(BenchbotError, match=said):
        point_cloud(frame)  # type: ignore[arg-type]


def test_a_picture_that_was_scaled_without_its_camera_model_is_told() -> None:
    frame = observe(BOXES, views()[0])
    frame["image_depth"] = frame["image_depth"][::2, ::2]

    with pytest.raises(BenchbotError, match="another size than its camera model") as caught:
        point_cloud(frame)

    assert "It has 80 x 45 pixels, and the model 160 x 90." in caught.value.why


def test_colour_of_another_camera_is_told() -> None:
    frame = colored(views()[0])
    frame["image_rgb_info"] = frame["image_rgb_info"] | {"frame_id": "other"}

    with pytest.raises(BenchbotError, match="Colour and depth are of two cameras"):
        point_cloud(frame)


def test_a_robot_without_a_camera_frame_is_told() -> None:
    frame = observe(BOXES, views()[0])
    frame["poses"] = {"base_link": frame["poses"]["camera"]}

    with pytest.raises(BenchbotError, match="The pose of the camera is not observed") as caught:
        point_cloud(frame)

    assert "base_link" in caught.value.why
