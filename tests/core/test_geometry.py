import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.geometry import Pose, wrap_angle_rad

coordinate = st.floats(-100, 100)
angle = st.floats(-10, 10)
component = st.floats(-1, 1)


@st.composite
def poses(draw: st.DrawFn) -> Pose:
    quaternion = draw(st.tuples(component, component, component, component).filter(lambda q: math.hypot(*q) > 0.1))
    return Pose.from_wxyz_xyz([*quaternion, draw(coordinate), draw(coordinate), draw(coordinate)])


@given(poses(), poses())
def test_composition_is_the_product_of_the_matrices(a: Pose, b: Pose) -> None:
    np.testing.assert_allclose((a @ b).matrix(), a.matrix() @ b.matrix(), atol=1e-9)


@given(poses())
def test_a_pose_and_its_inverse_cancel(pose: Pose) -> None:
    np.testing.assert_allclose((pose @ pose.inverse()).matrix(), np.eye(4), atol=1e-9)


@given(poses())
def test_a_matrix_gives_its_pose_back(pose: Pose) -> None:
    np.testing.assert_allclose(Pose.from_matrix(pose.matrix()).matrix(), pose.matrix(), atol=1e-9)


@given(coordinate, coordinate, angle)
def test_a_planar_pose_has_its_heading(x: float, y: float, yaw: float) -> None:
    pose = Pose.planar(x, y, yaw)
    assert math.cos(pose.yaw_rad - yaw) == pytest.approx(1)
    assert pose.rpy_rad[:2] == pytest.approx((0, 0))


def test_v2_poses_are_normalised() -> None:
    pose = Pose.from_wxyz_xyz([0.7, 0, 0, -0.7, 1.2, 1.5, 0.3])
    assert math.degrees(pose.yaw_rad) == pytest.approx(-90)
    assert math.hypot(*pose.rotation_xyzw) == pytest.approx(1)


@pytest.mark.parametrize(("values", "what"), [([1, 0, 0], "7 numbers"), ([0, 0, 0, 0, 1, 2, 3], "length zero")])
def test_bad_poses_are_refused(values: list[float], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        Pose.from_wxyz_xyz(values)


@given(angle)
def test_wrapping_keeps_the_direction(radians: float) -> None:
    wrapped = wrap_angle_rad(radians)
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped - radians) == pytest.approx(1)


def test_a_mount_turns_about_the_fixed_axes_x_then_y_then_z() -> None:
    optical = Pose.from_xyz_rpy_deg((0.1, 0.2, 1.0), (-90, 0, -90))
    assert np.allclose(optical.matrix()[:3, :3], [[0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # z forwards, x right, y down
    assert optical.translation_xyz == (0.1, 0.2, 1.0)
    assert np.allclose(np.degrees(Pose.from_xyz_rpy_deg((0, 0, 0), (10, 20, 30)).rpy_rad), (10, 20, 30))


def test_poses_are_reported_in_float64() -> None:
    record = Pose.planar(1, 2, 0.5).record("map")
    assert record["parent_frame"] == "map"
    assert record["translation_xyz"].tolist() == [1, 2, 0]
    assert record["rotation_rpy"] == pytest.approx([0, 0, 0.5])
    assert {record[key].dtype for key in ("translation_xyz", "rotation_rpy", "rotation_xyzw")} == {np.dtype(np.float64)}
