"""The keys of a robot's declaration that are ROS 2's: its topics, and the key `driver`, as they are written."""

from typing import Annotated, Literal

import msgspec


class Declared(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A mapping of a declaration: an unknown key is an error."""


class Qos(Declared, frozen=True):
    """Quality of service that a subscription or publisher is forced to; what is None is matched to the other side."""

    reliability: Literal["reliable", "best_effort"] | None = None
    durability: Literal["volatile", "transient_local"] | None = None
    depth: int = 5


class Topic(Declared, frozen=True):
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


class Connection(Declared, frozen=True):
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


class LocalisedByOdometry(Declared, frozen=True, tag_field="by", tag="odometry"):
    """The robot is where its odometry has led it from the scene's start pose."""


class LocalisedByTopic(Declared, frozen=True, tag_field="by", tag="topic"):
    """Localisation by a topic with the base's pose in the map: motion capture, AMCL, a simulator's truth.

    `initial_pose` is the topic on which it is told where the base starts (AMCL's /initialpose).
    """

    ros_topic: str
    ros_type: Literal[
        "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped"
    ]
    qos: Qos = Qos()
    initial_pose: str | None = None


class LocalisedByTransforms(Declared, frozen=True, tag_field="by", tag="tf"):
    """Localisation by the transform tree, which has the base's pose in the map; needs tf2_msgs."""

    initial_pose: str | None = None


class ReturnByService(Declared, frozen=True, tag_field="by", tag="service"):
    """The robot goes to its start when a std_srvs/srv/Trigger is called.

    `scene_node` is a node with the parameters `environment` (name:variant), `start_pose` and `seed`, which are set
    before: that of `benchbot bridge`.
    """

    ros_service: str
    scene_node: str | None = None


class ReturnByNavigation(Declared, frozen=True, tag_field="by", tag="navigation"):
    """The robot navigates to its start: a nav2_msgs/action/NavigateToPose server; needs nav2_msgs."""

    ros_action: str = "navigate_to_pose"


class ReturnByOperator(Declared, frozen=True, tag_field="by", tag="operator"):
    """A return by an operator, who puts the robot at its start and confirms it."""


class MovedByVelocity(Declared, frozen=True, tag_field="by", tag="velocity"):
    """Motion by BenchBot's own controller, which commands velocities."""


class MovedByNavigation(Declared, frozen=True, tag_field="by", tag="navigation"):
    """`move_next` by Nav2, which plans and drives; BenchBot's controller does what Nav2's tolerances leave of the way.

    A FollowPath server is given the straight way. A goal that is not reached within `timeout_s` is called off.
    """

    ros_action: str = "/navigate_to_pose"
    ros_type: Literal["nav2_msgs/action/NavigateToPose", "nav2_msgs/action/FollowPath"] = (
        "nav2_msgs/action/NavigateToPose"
    )
    timeout_s: float = 120.0


class Call(Declared, frozen=True):
    """A service that is called before or after a run: see `benchbot_robot_ros2.calls`. `data` is that of a SetBool."""

    ros_service: str
    ros_type: Literal["std_srvs/srv/Trigger", "std_srvs/srv/SetBool", "std_srvs/srv/Empty"] = "std_srvs/srv/Trigger"
    data: bool = True
    timeout_s: float = 10.0


class DeadMan(Declared, frozen=True):
    """A switch that an operator holds while the robot moves: std_msgs/msg/Bool, or a button of sensor_msgs/msg/Joy."""

    ros_topic: str
    ros_type: Literal["std_msgs/msg/Bool", "sensor_msgs/msg/Joy"]
    button: int = 0
    timeout_s: float = 0.3


class TakeOver(DeadMan, frozen=True):
    """A switch that a person holds who drives the robot by other means: see `benchbot_robot_ros2.take_over`."""

    timeout_s: float = 0.5


class Safety(Declared, frozen=True):
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


class Timing(Declared, frozen=True):
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


class StartTolerances(Declared, frozen=True):
    """The largest distance from the start pose at which a trial may begin, if the robot is localised in the map."""

    position_m: float = 0.05
    angle_deg: float = 3.0


class LocalisationBounds(Declared, frozen=True):
    """The bounds of what localisation may say; beyond them the robot stops.

    A step of at most `jump_m` and `jump_deg` against odometry is a correction. Of a topic that tells the place only now
    and then (AMCL's pose), the robot may be `unseen_m` away from where it was told last.
    """

    jump_m: float = 0.5
    jump_deg: float = 20.0
    unseen_m: float = 2.0


class DriverSettings(Declared, frozen=True):
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
