import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.channels import CameraModel
from benchbot.core.geometry import Pose
from benchbot_task_semslam.mapping.projection import in_frame, in_map_frame, pixel_rays, rotation_matrix
from plugins.task_semslam.tests.casting import OPTICAL

Coordinates = st.floats(-10, 10)


@given(Coordinates, Coordinates, st.floats(-4, 4))
def test_there_and_back_again(x: float, y: float, yaw_rad: float) -> None:
    pose = (Pose.planar(x, y, yaw_rad, z=1.0) @ OPTICAL).record("map")
    points = np.array([[0.5, -0.2, 3.0], [0, 0, 0]], np.float32)

    np.testing.assert_allclose(in_frame(in_map_frame(points, pose), pose), points, atol=1e-5)


def test_rotations_are_those_of_the_core() -> None:
    pose = Pose.planar(0, 0, 0.7) @ OPTICAL

    np.testing.assert_allclose(rotation_matrix(pose.rotation_xyzw), pose.matrix()[:3, :3], atol=1e-12)


def test_the_ray_of_the_principal_point_goes_straight_ahead() -> None:
    matrix = np.array([[2.0, 0, 1], [0, 2, 2], [0, 0, 1]])
    info = CameraModel(frame_id="camera", width=4, height=3, matrix_intrinsics=matrix, matrix_projection=np.eye(3, 4))
    rays = pixel_rays(info).reshape(3, 4, 3)

    np.testing.assert_array_equal(rays[2, 1], [0, 0, 1])
    np.testing.assert_array_equal(rays[0, 3], [1, -1, 1])
