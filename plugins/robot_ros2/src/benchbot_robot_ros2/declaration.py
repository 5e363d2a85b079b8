"""A ROS 2 robot's declaration: which topics, services and safety devices it has, read and checked once."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self, TypeVar

import msgspec

from benchbot.plugin import ACTIONS, MANIPULATION, OBSERVATIONS, BenchbotError, Pose
from benchbot_robot_ros2.arm import Arm
from benchbot_robot_ros2.footprint import Footprint
from benchbot_robot_ros2.names import Names, prefix_in
from benchbot_robot_ros2.ros import Graph

T = TypeVar("T")

ARRAY = "std_msgs/msg/Float64MultiArray"
JOINT_COMMANDS = (ARRAY, "sensor_msgs/msg/JointState")
"""The types that setpoints of an arm may have: of ros2_control's position controllers, and with names."""


class _Declared(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A mapping of a declaration: an unknown key is an error."""


class Qos(_Declared, frozen=True):
    """Quality of service that a subscription or publisher is forced to; what is None is matched to the other side."""

    reliability: Literal["reliable", "best_effort"] | None = None
    durability: Literal["volatile", "transient_local"] | None = None
    depth: int = 5


class Topic(_Declared, frozen=True):
    """A topic by its name and its type, written as ROS 2 does: `sensor_msgs/msg/Image`."""

    ros_topic: str
    ros_type: str
    qos: Qos = Qos()


class Signal(Topic, frozen=True, kw_only=True):
    """A topic that says yes or no by a field of its messages: see `benchbot_robot_ros2.signals`.

    Yes is a field that is true, or one of `equals`. Parts of the field's name are separated by dots, and each value of
    a list counts: `detections[].type`.
    """

    field: str = "data"
    equals: tuple[bool | int | float | str, ...] = ()


class Battery(Topic, frozen=True, kw_only=True):
    """A robot's sensor_msgs/msg/BatteryState: a trial does not begin below `minimum`, a share from 0 to 1.

    `full` is the percentage of a full battery: 1 by the message's definition, 100 of some drivers. `minimum_v` is the
    lowest voltage, for those that tell no percentage.
    """

    ros_type: Literal["sensor_msgs/msg/BatteryState"] = "sensor_msgs/msg/BatteryState"
    minimum: Annotated[float, msgspec.Meta(ge=0, le=1)] | None = None
    full: Annotated[float, msgspec.Meta(gt=0)] = 1.0
    minimum_v: float | None = None

    def __post_init__(self) -> None:
        if self.minimum is None and self.minimum_v is None:
            raise ValueError("it says neither minimum nor minimum_v")


class Connection(_Declared, frozen=True):
    """The ROS 2 connection of a channel or an action; its keys are those of BenchBot v2 in ROS 2's spelling.

    An observation has one topic, or several `topics` by the part of the observation that each carries. Its messages are
    turned into the observation by a callback (`benchbot_robot_ros2.callbacks`), by default the one of its own name.
    """

    connection: Literal["api_to_ros", "ros_to_api", "roscache_to_api"]
    ros_topic: str | None = None
    ros_type: str | None = None
    qos: Qos = Qos()
    topics: dict[str, Topic] = {}
    callback_robot: str | None = None

    def parts(self) -> dict[str, Topic]:
        """Return the topics by part; a single topic is the part named by the empty string."""
        if self.ros_topic is None or self.ros_type is None:
            return dict(self.topics)
        return {"": Topic(ros_topic=self.ros_topic, ros_type=self.ros_type, qos=self.qos)}


class LocalisedByOdometry(_Declared, frozen=True, tag_field="by", tag="odometry"):
    """The robot is where its odometry has led it from the scene's start pose."""


class LocalisedByTopic(_Declared, frozen=True, tag_field="by", tag="topic"):
    """Localisation by a topic with the base's pose in the map: motion capture, AMCL, a simulator's truth.

    `initial_pose` is the topic on which it is told where the base starts (AMCL's /initialpose).
    """

    ros_topic: str
    ros_type: Literal[
        "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped"
    ]
    qos: Qos = Qos()
    initial_pose: str | None = None


class LocalisedByTransforms(_Declared, frozen=True, tag_field="by", tag="tf"):
    """Localisation by the transform tree, which has the base's pose in the map; needs tf2_msgs."""

    initial_pose: str | None = None


class ReturnByService(_Declared, frozen=True, tag_field="by", tag="service"):
    """The robot goes to its start when a std_srvs/srv/Trigger is called.

    `scene_node` is a node with the parameters `environment` (name:variant), `start_pose` and `seed`, which are set
    before: that of `benchbot bridge`.
    """

    ros_service: str
    scene_node: str | None = None


class ReturnByNavigation(_Declared, frozen=True, tag_field="by", tag="navigation"):
    """The robot navigates to its start: a nav2_msgs/action/NavigateToPose server; needs nav2_msgs."""

    ros_action: str = "navigate_to_pose"


class ReturnByOperator(_Declared, frozen=True, tag_field="by", tag="operator"):
    """A return by an operator, who puts the robot at its start and confirms it."""


class MovedByVelocity(_Declared, frozen=True, tag_field="by", tag="velocity"):
    """Motion by BenchBot's own controller, which commands velocities."""


class MovedByNavigation(_Declared, frozen=True, tag_field="by", tag="navigation"):
    """`move_next` by Nav2, which plans and drives; BenchBot's controller does what Nav2's tolerances leave of the way.

    A FollowPath server is given the straight way. A goal that is not reached within `timeout_s` is called off.
    """

    ros_action: str = "/navigate_to_pose"
    ros_type: Literal["nav2_msgs/action/NavigateToPose", "nav2_msgs/action/FollowPath"] = (
        "nav2_msgs/action/NavigateToPose"
    )
    timeout_s: float = 120.0


class Call(_Declared, frozen=True):
    """A service that is called before or after a run: see `benchbot_robot_ros2.calls`. `data` is that of a SetBool."""

    ros_service: str
    ros_type: Literal["std_srvs/srv/Trigger", "std_srvs/srv/SetBool", "std_srvs/srv/Empty"] = "std_srvs/srv/Trigger"
    data: bool = True
    timeout_s: float = 10.0


class DeadMan(_Declared, frozen=True):
    """A switch that an operator holds while the robot moves: std_msgs/msg/Bool, or a button of sensor_msgs/msg/Joy."""

    ros_topic: str
    ros_type: Literal["std_msgs/msg/Bool", "sensor_msgs/msg/Joy"]
    button: int = 0
    timeout_s: float = 0.3


class TakeOver(DeadMan, frozen=True):
    """A switch that a person holds who drives the robot by other means: see `benchbot_robot_ros2.take_over`."""

    timeout_s: float = 0.5


class Safety(_Declared, frozen=True):
    """The conditions that stop the robot, besides BenchBot's own.

    `command_timeout_s` is the time for which a velocity command stays valid; `e_stop` and `collision` say yes when the
    button is pressed or the bumper touches something. `obstacles` are the channels that are looked at for contact ahead
    of a motion.
    """

    command_timeout_s: float = 0.15
    e_stop: Signal | None = None
    dead_man: DeadMan | None = None
    take_over: TakeOver | None = None
    collision: Signal | None = None
    battery: Battery | None = None
    obstacles: tuple[Literal["laser", "image_depth", "lidar"], ...] = ("laser",)


class Timing(_Declared, frozen=True):
    """Limits on the age of messages and on the time between them, in seconds.

    Messages of one observation are at most `sync_tolerance_s` apart by their stamps. Feedback (odometry, obstacles)
    older than `feedback_timeout_s` stops a moving robot, and so does a supervisor that is silent for longer than
    `heartbeat_timeout_s`, in wall time. A stamp more than `skew_s` from the node's clock is an error.
    `wait_s` is the time limit of waiting for a message, a service or a publisher.
    """

    sync_tolerance_s: float = 0.05
    feedback_timeout_s: float = 0.5
    heartbeat_timeout_s: float = 0.15
    skew_s: float = 2.0
    wait_s: float = 10.0


class StartTolerances(_Declared, frozen=True):
    """The largest distance from the start pose at which a trial may begin, if the robot is localised in the map."""

    position_m: float = 0.05
    angle_deg: float = 3.0


class LocalisationBounds(_Declared, frozen=True):
    """The bounds of what localisation may say; beyond them the robot stops.

    A step of at most `jump_m` and `jump_deg` against odometry is a correction. Of a topic that tells the place only now
    and then (AMCL's pose), the robot may be `unseen_m` away from where it was told last.
    """

    jump_m: float = 0.5
    jump_deg: float = 20.0
    unseen_m: float = 2.0


class DriverSettings(_Declared, frozen=True):
    """The key `driver` of a robot's declaration.

    The first group after `odometry` says which robot of several it is: see `Names` and `Graph`.
    """

    odometry: Topic

    namespace: str = ""
    frame_prefix: str = ""
    remap: dict[str, str] = {}
    domain: Annotated[int, msgspec.Meta(ge=0, le=232)] | None = None
    rmw: str | None = None

    before: tuple[Call, ...] = ()
    after: tuple[Call, ...] = ()

    use_sim_time: bool = False
    localisation: LocalisedByOdometry | LocalisedByTopic | LocalisedByTransforms = LocalisedByOdometry()
    return_to_start: ReturnByService | ReturnByNavigation | ReturnByOperator = ReturnByOperator()
    motion: MovedByVelocity | MovedByNavigation = MovedByVelocity()
    start_tolerances: StartTolerances = StartTolerances()
    localisation_bounds: LocalisationBounds = LocalisationBounds()
    safety: Safety = Safety()
    timing: Timing = Timing()

    @property
    def initial_pose(self) -> str | None:
        """The topic on which localisation is told where the robot starts."""
        return None if isinstance(self.localisation, LocalisedByOdometry) else self.localisation.initial_pose


@dataclass(frozen=True)
class Ros2Robot:
    """A robot as the driver needs it; `mounts` are poses of the robot's frames in its base frame.

    Names of topics and services are full ones, and frames have the ids that messages name. `reported` and `map_name`
    are what solutions know frames by, of any robot of a fleet.
    """

    name: str
    graph: Graph
    names: Names
    map_name: str
    global_frame: str
    base_frame: str
    reported: tuple[str, ...]
    mounts: dict[str, Pose]
    camera_frame: str | None
    laser_frame: str | None
    lidar_frame: str | None
    imu_frame: str | None
    footprint: Footprint
    observations: dict[str, Connection]
    command: Topic
    arm: Arm | None
    arm_commands: dict[str, Topic]
    settings: DriverSettings

    @classmethod
    def from_declaration(cls, robot: Mapping[str, Any]) -> Self:
        """Read a robot's declaration; raises BenchbotError saying which key is wrong, and how."""
        name = str(robot.get("name"))
        settings = _convert(robot.get("driver", {}), DriverSettings, name, "driver")
        names = Names(name, settings.namespace, prefix_in(settings.namespace, settings.frame_prefix), settings.remap)
        connections = {
            channel: _convert(names.in_all(connection), Connection, name, f"connections.{channel}")
            for channel, connection in robot["connections"].items()
        }
        commands = {channel: connection for channel, connection in connections.items() if channel in ACTIONS}
        _check_sideways(name, robot)
        arm = _convert(robot["arm"], Arm, name, "arm") if "arm" in robot else None
        _check_navigation(name, settings)
        mounts = _convert(robot.get("frames", {}), dict[str, _Mount], name, "frames")

        def frame(sensor: str) -> str | None:
            declared = robot.get(sensor, {}).get("frame")
            return None if declared is None else names.frame(declared)

        return cls(
            name=name,
            graph=_graph(names, settings),
            names=names,
            map_name=str(robot["global_frame"]).removeprefix("/"),
            global_frame=names.frame(str(robot["global_frame"])),
            base_frame=names.frame(str(robot["robot_frame"])),
            reported=tuple(map(str, robot["poses"])),
            mounts={names.frame(declared): mount.pose() for declared, mount in mounts.items()},
            camera_frame=frame("camera"),
            laser_frame=frame("laser"),
            lidar_frame=frame("lidar"),
            imu_frame=frame("imu"),
            footprint=_convert(robot.get("footprint", {}), _Footprint, name, "footprint").made(name),
            observations={
                channel: connection for channel, connection in connections.items() if channel in OBSERVATIONS
            },
            command=_one_command(name, {channel: commands[channel] for channel in commands.keys() - MANIPULATION}),
            arm=arm,
            arm_commands=_arm_commands(name, arm, connections),
            # Defaults may be names, too.
            settings=msgspec.convert(names.in_all(msgspec.to_builtins(settings)), DriverSettings),
        )


class _Footprint(_Declared, frozen=True):
    radius_m: float
    z_min_m: float = 0.03
    z_max_m: float = 2.0
    polygon: tuple[tuple[float, float], ...] = ()

    def made(self, robot: str) -> Footprint:
        try:
            return Footprint(self.radius_m, (self.z_min_m, self.z_max_m), self.polygon)
        except ValueError as error:
            raise _wrong(robot, "footprint", error) from error


class _Mount(_Declared, frozen=True):
    xyz: tuple[float, float, float]
    rpy_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def pose(self) -> Pose:
        return Pose.from_xyz_rpy_deg(self.xyz, self.rpy_deg)


def _graph(names: Names, settings: DriverSettings) -> Graph:
    moving, static = names.resolved("/tf"), names.resolved("/tf_static")
    return Graph(settings.namespace, names.resolved("/clock"), (moving, static), settings.domain, settings.rmw)


def _convert(value: Any, kind: type[T], robot: str, key: str) -> T:
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise _wrong(robot, key, error) from error


def _wrong(robot: str, key: str, error: Exception) -> BenchbotError:
    why = str(error)
    return BenchbotError(
        f"The robot '{robot}' cannot be driven: its declaration is wrong at '{key}'.",
        f"{why[:1].upper()}{why[1:]}.",
        "The keys are explained in docs/ros2.md; a whole declaration: benchbot show robot carter_ros2",
    )


def _check_sideways(name: str, robot: Mapping[str, Any]) -> None:
    """Raise BenchbotError for a base that is to drive sideways, and does not say how fast."""
    if "move_sideways" in robot["connections"] and "lateral_mps" not in robot.get("limits", {}):
        raise BenchbotError(
            f"The robot '{name}' cannot be driven sideways.",
            "It connects move_sideways, and its limits have no lateral_mps.",
            "Add the fastest speed to both sides, in m/s: limits: {lateral_mps: 0.5}",
        )


def _check_navigation(robot: str, settings: DriverSettings) -> None:
    """Raise BenchbotError where something else that is declared does not go with navigation."""
    if settings.safety.take_over is not None and isinstance(settings.motion, MovedByNavigation):
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: its declaration is wrong at 'driver.safety.take_over'.",
            "It is moved by navigation, which nothing tells that a person has the robot: its goal would go on, and be "
            "given up.",
            "Leave take_over out and let twist_mux put the joystick first, or declare motion: {by: velocity}.",
        )
    if settings.initial_pose is not None and isinstance(settings.return_to_start, ReturnByNavigation):
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: its declaration is wrong at 'driver.localisation.initial_pose'.",
            "It returns to its start by navigation, which needs to know where it is before, and ends somewhere near: "
            "told that it is exactly there, localisation would be wrong from then on.",
            "Leave initial_pose out and tell Nav2 once where the robot is, or declare another return_to_start.",
        )


def _one_command(robot: str, commands: Mapping[str, Connection]) -> Topic:
    """Return the one topic that all of a robot's actions command velocities on."""
    topics = {connection.parts().get("") for connection in commands.values()}
    topic = topics.pop() if len(topics) == 1 else None
    if topic is None or topic.ros_type not in ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"):
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: it has no one topic for velocity commands.",
            f"Its actions: {', '.join(commands) or 'none'}. All must name the same ros_topic, of the ros_type "
            "geometry_msgs/msg/Twist or geometry_msgs/msg/TwistStamped.",
            "Write for each: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/msg/Twist}",
        )
    return topic


def _arm_commands(robot: str, arm: Arm | None, connections: Mapping[str, Connection]) -> dict[str, Topic]:
    """Return the topics of an arm's setpoints by action."""
    asked = [channel for channel in connections if channel in MANIPULATION or channel == "joint_states"]
    if asked and arm is None:
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: its declaration is wrong at 'arm'.",
            f"connections has {' and '.join(asked)}, and no key 'arm' says which joints these are of.",
            "Write: arm: {joints: {shoulder: {radps: 1.0, radps2: 2.0}, …}, gripper: [left_finger, right_finger]}",
        )
    commands = {}
    for action in (channel for channel in asked if channel in MANIPULATION):
        topic = connections[action].parts().get("")
        why, fix = None, "Correct it (docs/ros2.md, Arms), or leave the action out."
        if action == "move_end_effector":
            why = "Over ROS 2 an arm is moved by its joints: nothing here knows its kinematics."
            fix = "Leave the action out, and let the solution find the joints and move them by move_joints."
        elif topic is None or topic.ros_type not in JOINT_COMMANDS:
            why = f"It needs a ros_topic of the ros_type {' or '.join(JOINT_COMMANDS)}."
        elif "joint_states" not in connections:
            why = "Where the arm is, has to be known: there is no connections.joint_states."
        if why is not None or topic is None:
            raise BenchbotError(
                f"The robot '{robot}' cannot be driven: its declaration is wrong at 'connections.{action}'.",
                str(why),
                fix,
            )
        commands[action] = topic
    return commands
