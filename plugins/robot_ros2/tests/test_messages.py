import sys
from pathlib import Path

import pytest
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Quaternion, Transform, Twist
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import Image

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot_robot_ros2.messages import message_type, pose_message, pose_of, set_stamp, stamp_ns, transform_message


def test_a_message_type_is_found_by_its_name() -> None:
    assert message_type("sensor_msgs/msg/Image") is Image


@pytest.mark.parametrize(
    "name",
    ["", "Image", "sensor_msgs.msg/Image", "../msg/Image", "sensor_msgs/srv/SetCameraInfo", "sensor_msgs/msg/Image\n"],
)
def test_what_is_no_name_of_a_message_type_is_refused(name: str) -> None:
    with pytest.raises(BenchbotError, match="is not the name of a ROS 2 message type"):
        message_type(name)


def test_the_spelling_of_ros_1_is_corrected() -> None:
    with pytest.raises(BenchbotError) as caught:
        message_type("sensor_msgs/LaserScan")
    assert "Did you mean 'sensor_msgs/msg/LaserScan'?" in caught.value.why


def test_a_misspelt_message_is_corrected() -> None:
    with pytest.raises(BenchbotError) as caught:
        message_type("sensor_msgs/msg/Imagee")
    assert "Did you mean 'Image'?" in caught.value.why


def test_a_package_that_is_not_installed_comes_with_the_command_that_installs_it() -> None:
    with pytest.raises(BenchbotError, match="acme_msgs is not installed") as caught:
        message_type("acme_msgs/msg/Dynamite")
    assert "apt install ros-jazzy-acme-msgs" in caught.value.fix


def test_nothing_but_interface_packages_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in (tmp_path / "harmful", tmp_path / "harmful" / "msg"):
        folder.mkdir()
        (folder / "__init__.py").write_text("raise SystemExit('imported')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(BenchbotError, match="harmful is not installed"):
        message_type("harmful/msg/Anything")
    assert "harmful" not in sys.modules


def test_a_package_that_python_does_not_have_is_said_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    index = tmp_path / "share" / "ament_index" / "resource_index" / "rosidl_interfaces"
    index.mkdir(parents=True)
    (index / "cpp_only_msgs").write_text("msg/Thing.idl\nmsg/Thing.msg\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    with pytest.raises(BenchbotError, match="Python cannot load it") as caught:
        message_type("cpp_only_msgs/msg/Thing")
    assert "No module named 'cpp_only_msgs'" in caught.value.why


@given(st.integers(min_value=0, max_value=(2**31 - 1) * 10**9))
def test_a_stamp_keeps_every_nanosecond(nanoseconds: int) -> None:
    message = Image()
    set_stamp(message, nanoseconds)
    assert stamp_ns(message) == nanoseconds


def test_a_message_without_header_has_no_stamp() -> None:
    assert stamp_ns(Twist()) is None


@pytest.mark.parametrize("message", [pose_message, transform_message])
def test_poses_go_there_and_back(message: object) -> None:
    pose = Pose.from_xyz_rpy_deg((1.5, -2.0, 0.25), (10, -20, 130))
    assert callable(message)
    back = pose_of(message(pose))
    assert back.translation_xyz == pose.translation_xyz
    assert back.rotation_xyzw == pytest.approx(pose.rotation_xyzw, abs=1e-15)


def test_a_quaternion_is_normalised() -> None:
    turned = PoseMessage(orientation=Quaternion(x=0.0, y=0.0, z=2.0, w=0.0))
    assert pose_of(turned).rotation_xyzw == (0, 0, 1, 0)


@pytest.mark.parametrize(
    "message",
    [
        Transform(rotation=Quaternion(x=0.0, y=0.0, z=0.0, w=0.0)),
        PoseMessage(orientation=Quaternion(x=float("nan"))),
        pose_message(Pose((float("inf"), 0, 0))),
    ],
)
def test_what_is_no_pose_is_refused(message: object) -> None:
    with pytest.raises(ValueError, match="is no pose"):
        pose_of(message)
