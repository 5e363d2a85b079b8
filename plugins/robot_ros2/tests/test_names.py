"""Names of one robot of several, by the rules of ROS 2."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot_robot_ros2.names import Names

WORD = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,5}", fullmatch=True)
RELATIVE = st.lists(WORD, min_size=1, max_size=3).map("/".join)


@pytest.mark.parametrize(
    ("declared", "full"),
    [
        ("scan", "/tb03/scan"),
        ("platform/odom", "/tb03/platform/odom"),
        ("/e_stop", "/e_stop"),
        ("/tf", "/tb03/tf"),
        ("front/image", "/lab/camera"),
    ],
)
def test_relative_names_are_in_the_namespace_and_remapped_at_last(declared: str, full: str) -> None:
    names = Names("turtlebot4", "tb03", remap={"/tf": "tf", "front/image": "/lab/camera"})
    assert names.resolved(declared) == full


@given(RELATIVE, RELATIVE, RELATIVE)
def test_two_namespaces_share_no_relative_name_and_every_absolute_one(name: str, one: str, other: str) -> None:
    first, second = Names("cart", one), Names("cart", f"{other}/{one}")
    assert first.resolved(f"/{name}") == second.resolved(f"/{name}") == f"/{name}"
    assert first.resolved(name) != second.resolved(name)
    assert first.resolved(first.resolved(name)) == first.resolved(name)


def test_without_a_namespace_a_relative_name_is_at_the_root() -> None:
    assert Names("cart").resolved("scan") == "/scan"
    assert Names("cart", "/lab/tb03/").resolved("scan") == "/lab/tb03/scan"


@pytest.mark.parametrize("namespace", ["3", "tb 03", "tb-03", "a//b"])
def test_what_is_no_namespace_is_refused(namespace: str) -> None:
    with pytest.raises(BenchbotError, match="is no name in ROS 2") as caught:
        Names("cart", namespace).resolved("scan")
    assert "--robot NAME@robot_1" in caught.value.fix


def test_frames_get_the_prefix_unless_they_are_absolute() -> None:
    names = Names("cart", frame_prefix="tb03/")
    assert names.frame("base_link") == "tb03/base_link"
    assert names.frame("/map") == "map"


def test_every_name_in_settings_is_resolved_and_nothing_else() -> None:
    settings = {"by": "service", "ros_service": "reset", "deep": [{"ros_topic": "odom", "ros_type": "nav_msgs/msg/A"}]}
    assert Names("cart", "r1").in_all(settings) == {
        "by": "service",
        "ros_service": "/r1/reset",
        "deep": [{"ros_topic": "/r1/odom", "ros_type": "nav_msgs/msg/A"}],
    }
