"""The declared ROS 2 robots by which a bridged robot can be driven, and why others cannot."""

from collections.abc import Iterator

from benchbot.plugin import BenchbotError, Catalog, MotionConfig, Pose
from benchbot_robot_ros2.bridge.robot import (
    COLLISION,
    COMMAND,
    GROUND_TRUTH,
    NODE,
    ODOMETRY,
    RESET,
    BridgedRobot,
    topics,
)
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import LocalisedByTopic, LocalisedByTransforms, ReturnByService, Topic
from benchbot_robot_ros2.observing import frame_of

ODOMETRY_TYPE = "nav_msgs/msg/Odometry"
NEAR_M = 1e-3


def drivers(catalog: Catalog, robot: BridgedRobot, *, simulated: bool, transforms: bool) -> dict[str, list[str]]:
    """Return what each ROS 2 robot that runs in the simulator's environments asks in vain of a bridged one.

    The robots of which the list is empty drive it; those that observe most come first.
    """
    found: dict[str, tuple[int, list[str]]] = {}
    for base, common in catalog.pool("robots").items():
        name = f"{base}@{robot.namespace}" if robot.namespace else base
        declared = catalog.find("robots", name) or common
        if declared.data["type"] != "ros2" or robot.declaration["type"] not in declared.data.get("runs_in", ()):
            continue
        try:
            driver = Ros2Robot.from_declaration(declared.data)
        except BenchbotError as error:
            found[declared.name] = 0, [error.title]
            continue
        lacks = [*_lacks(driver, robot, simulated=simulated, transforms=transforms)]
        lacks += _differs(driver, MotionConfig.from_robot(declared.data, "ground_truth"), robot)
        found[declared.name] = len(driver.observations), lacks
    ranked = sorted(found.items(), key=lambda item: (len(item[1][1]), -item[1][0], item[0]))
    return {name: lacks for name, (_, lacks) in ranked}


def _lacks(driver: Ros2Robot, robot: BridgedRobot, *, simulated: bool, transforms: bool) -> Iterator[str]:
    """Yield the topics, services and frames of a driver's robot that the bridge does not offer."""
    space = f"/{robot.namespace}".rstrip("/")
    offered = {Topic(ros_topic=f"{space}/{COMMAND}", ros_type=robot.command_type)}
    for name, ros_type in ((ODOMETRY, ODOMETRY_TYPE), (GROUND_TRUTH, ODOMETRY_TYPE), (COLLISION, "std_msgs/msg/Bool")):
        offered.add(Topic(ros_topic=f"{space}/{name}", ros_type=ros_type))
    for channel in filter(robot.has, driver.observations):
        for topic in topics(channel).values() if channel != "poses" else ():
            offered.add(Topic(ros_topic=space + topic.ros_topic, ros_type=topic.ros_type))
    settings = driver.settings
    asked: list[Topic | LocalisedByTopic] = [driver.command, settings.odometry]
    asked += [topic for connection in driver.observations.values() for topic in connection.parts().values()]
    asked += [settings.localisation] if isinstance(settings.localisation, LocalisedByTopic) else []
    asked += [settings.safety.collision] if settings.safety.collision else []
    known = {(topic.ros_topic, topic.ros_type) for topic in offered}
    for wanted in asked:
        if (wanted.ros_topic, wanted.ros_type) not in known:
            yield f"{wanted.ros_topic} ({wanted.ros_type})"
    if isinstance(settings.localisation, LocalisedByTransforms) and not transforms:
        yield "transforms: tf2_msgs is not installed"
    back = settings.return_to_start
    if isinstance(back, ReturnByService) and back.ros_service != f"{space}/{RESET}":
        yield f"the service {back.ros_service}"
    elif isinstance(back, ReturnByService) and back.scene_node not in (None, f"{space}/{NODE}"):
        yield f"the node {back.scene_node}"
    if settings.use_sim_time != simulated:
        yield f"driver.use_sim_time: {str(settings.use_sim_time).lower()}"


def _differs(driver: Ros2Robot, motion: MotionConfig, robot: BridgedRobot) -> Iterator[str]:
    """Yield the frames, the size and the speeds of a driver's robot that are not those of the bridged one."""
    if driver.global_frame != robot.map_frame:
        yield f"global_frame: {driver.global_frame}, not {robot.map_frame}"
    if driver.base_frame != robot.base_frame:
        yield f"robot_frame: {driver.base_frame}, not {robot.base_frame}"
    sensors = {frame_of(channel, driver): channel for channel in filter(robot.has, driver.observations)}
    for frame, channel in sensors.items():
        if frame is not None and frame != robot.sensor_frame(channel):
            yield f"the frame {frame} of {channel}, which is {robot.sensor_frame(channel)}"
    for frame, place in robot.declaration.get("frames", {}).items():
        declared = driver.mounts.get(robot.frame(frame))
        mount = Pose.from_xyz_rpy_deg(place["xyz"], place.get("rpy_deg", (0.0, 0.0, 0.0)))
        if declared is not None and not _near(declared, mount):
            yield f"another place of the frame {robot.frame(frame)}"
    if driver.footprint.radius_m < float(robot.declaration["footprint"]["radius_m"]):
        yield f"footprint.radius_m: {driver.footprint.radius_m:g}, less than that of the robot"
    most = MotionConfig.from_robot(robot.declaration, "ground_truth")
    if (
        motion.linear_limits_mps[1] > most.linear_limits_mps[1]
        or motion.linear_limits_mps[0] < most.linear_limits_mps[0]
        or motion.angular_limit_radps > most.angular_limit_radps
    ):
        yield "limits above those of the robot"


def _near(first: Pose, second: Pose) -> bool:
    off = first.inverse() @ second
    return max(map(abs, (*off.translation_xyz, *off.rotation_xyzw[:3]))) < NEAR_M
