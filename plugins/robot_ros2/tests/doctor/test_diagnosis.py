"""`benchbot doctor --robot` against robots on real DDS, well and ill."""

import pytest
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, Joy, LaserScan
from std_msgs.msg import Bool, String

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Level
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.doctor import diagnosis
from plugins.robot_ros2.tests.doctor.cart import Cart, broken, examine, worst


@pytest.fixture
def cart(domain: int) -> Cart:
    return Cart()


def test_nothing_is_broken_on_a_healthy_robot(cart: Cart) -> None:
    with cart.running():
        found = examine()
    assert broken(found) == []
    for subject in ("graph", "clock", "topic /scan", "camera /camera/camera_info", "laser /scan", "return to start"):
        assert worst(found[subject]).level is Level.OK, found[subject]
    assert "/cart listens" in found["velocity /cmd_vel"][0].detail
    assert "released" in found["e-stop"][0].detail
    assert worst(found["dead-man switch"]).level is Level.WARNING


def test_an_empty_domain_is_one_finding_and_not_one_per_topic(domain: int) -> None:
    found = examine(seconds=0.3)
    assert broken(found) == ["graph"]
    assert str(domain) in found["graph"][0].detail
    assert "LOCALHOST" in found["graph"][0].fix


def test_topics_under_other_names_types_and_frames_are_named(cart: Cart) -> None:
    del cart.types["/camera/image_raw"]
    cart.types |= {"/camera/rgb/image_raw": Image, "/odom": String}
    cart.laser_frame = "laser_link"
    cart.silent = {"/camera/camera_info"}
    cart.pressed = True
    cart.listens = {"/cmd_vel": TwistStamped}
    with cart.running():
        found = examine()
    assert "did you mean /camera/rgb/image_raw?" in found["topic /camera/image_raw"][0].detail
    assert "std_msgs/msg/String" in found["topic /odom"][0].detail
    assert "'laser_link'" in worst(found["topic /scan"]).detail
    assert "/cart publishes it, but nothing came" in found["topic /camera/camera_info"][0].detail
    assert found["e-stop"][0].detail == "it is pressed"
    assert "geometry_msgs/msg/TwistStamped" in found["velocity /cmd_vel"][0].detail


def test_incompatible_qos_old_stamps_and_unreadable_images_are_named(cart: Cart) -> None:
    cart.qos["/odom"] = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    cart.stamp_offset_s = -60.0
    cart.encoding = "nonsense"
    reliable = {"ros_topic": "/odom", "ros_type": "nav_msgs/msg/Odometry", "qos": {"reliability": "reliable"}}
    with cart.running():
        found = examine({"driver": {"odometry": reliable, "return_to_start": {"by": "navigation"}}})
    assert "reliability best_effort" in found["topic /odom"][0].detail
    assert "/cart" in found["topic /odom"][0].detail
    assert "60.0" in worst(found["topic /scan"]).detail
    assert "chrony" in worst(found["topic /scan"]).fix
    assert "nonsense" in found["image_rgb"][0].detail
    assert "nobody offers the action /navigate_to_pose" in found["return to start"][0].detail


def test_velocity_commands_nobody_hears_and_somebody_else_gives_are_named(cart: Cart) -> None:
    cart.listens = {"/base/cmd_vel": TwistStamped}
    cart.also = {"/cmd_vel": Twist}
    cart.services = []
    with cart.running():
        found = examine()
    nobody, rival = found["velocity /cmd_vel"]
    assert nobody.level is Level.BROKEN
    assert "/base/cmd_vel" in nobody.detail
    assert rival.level is Level.WARNING
    assert "/cart commands velocities, too" in rival.detail
    assert "nobody offers the service /reset" in found["return to start"][0].detail


def test_safety_devices_that_will_not_work_are_named(cart: Cart) -> None:
    cart.types |= {"/joy": Joy, "/bumper": Bool}
    cart.pressed = True
    safety = {
        "dead_man": {"ros_topic": "/joy", "ros_type": "sensor_msgs/msg/Joy", "button": 4},
        "take_over": {"ros_topic": "/joy", "ros_type": "sensor_msgs/msg/Joy", "button": 2},
        "collision": {"ros_topic": "/bumper", "ros_type": "std_msgs/msg/Bool"},
    }
    with cart.running():
        found = examine({"driver": {"safety": safety}})
    assert "the joystick has 2" in found["dead-man switch"][0].detail
    assert "button 2 is declared, but the joystick has 2" in found["take-over switch"][0].detail
    assert found["collision"][0].level is Level.WARNING
    assert "none is declared" in found["e-stop"][0].detail


def test_the_services_of_a_runs_beginning_and_end_are_looked_for_and_not_called(cart: Cart) -> None:
    cart.services = ["/reset", "/claim"]
    power = {"ros_service": "/claim", "ros_type": "std_srvs/srv/SetBool"}
    with cart.running():
        found = examine(
            {"driver": {"before": [{"ros_service": "/claim"}], "after": [{"ros_service": "/let_go"}, power]}}
        )
    right, wrong = found["service /claim"]
    assert right.level is Level.OK
    assert wrong.detail == "it is no std_srvs/srv/SetBool"
    assert found["service /let_go"][0].detail == "nobody offers it"


def test_a_robot_that_cannot_see_ahead_is_refused_before_anything_is_looked_at(domain: int) -> None:
    with pytest.raises(BenchbotError, match="cannot see what is ahead"):
        examine({"driver": {"safety": {"obstacles": ["image_depth"]}}, "stops_before_contact": True})


def test_two_robots_in_one_domain_are_named(cart: Cart) -> None:
    with cart.running(), ros.running_node("intruder") as other:
        other.create_publisher(LaserScan, "/scan", 1)
        found = examine()
    assert "/cart and /intruder publish it" in worst(found["topic /scan"]).detail


@pytest.mark.parametrize(("declared", "published"), [(True, False), (False, True), (True, True)])
def test_simulated_time_must_be_declared_and_published(cart: Cart, *, declared: bool, published: bool) -> None:
    if published:
        cart.also["/clock"] = Clock
    with cart.running():
        found = examine({"driver": {"use_sim_time": declared}})
    finding = worst(found["clock"])
    if declared:
        assert finding.level is Level.BROKEN
        assert ("stands still" if published else "nothing publishes /clock") in finding.detail
    else:
        assert finding.level is Level.WARNING
        assert "use_sim_time: true" in finding.fix


@pytest.mark.parametrize(
    ("variable", "value", "level"),
    [
        ("ROS_DOMAIN_ID", "seven", Level.BROKEN),
        ("ROS_DOMAIN_ID", "200", Level.WARNING),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", Level.BROKEN),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCAL", Level.BROKEN),
        ("RMW_IMPLEMENTATION", "rmw_imaginary_cpp", Level.BROKEN),
    ],
)
def test_a_wrong_environment_is_named_before_ros_starts(
    monkeypatch: pytest.MonkeyPatch, variable: str, value: str, level: Level
) -> None:
    monkeypatch.setenv(variable, value)
    finding = worst(list(diagnosis.environment()))
    assert finding.level is level
    assert value in finding.detail
    assert finding.fix


def test_a_robot_that_nav2_drives_needs_nav2_and_a_topic_of_its_own(cart: Cart) -> None:
    cart.also["/cmd_vel"] = Twist
    amcl = {
        "by": "topic",
        "ros_topic": "/amcl_pose",
        "ros_type": "geometry_msgs/msg/PoseWithCovarianceStamped",
        "initial_pose": "/initialpose",
    }
    with cart.running():
        found = examine({"driver": {"motion": {"by": "navigation"}, "localisation": amcl}})
    assert [(finding.level, finding.detail) for finding in found["motion"]] == [
        (Level.BROKEN, "nobody offers the action /navigate_to_pose")
    ]
    assert "nobody subscribes to /initialpose" in found["initial pose"][0].detail
    assert worst(found["velocity /cmd_vel"]).level is Level.BROKEN
    assert "/cart commands velocities, too" in worst(found["velocity /cmd_vel"]).detail
