"""What stock software subscribes to, from its public sources: the table that docs/ros2.md shows and a test goes by."""

from dataclasses import dataclass

RELIABLE, BEST_EFFORT, LATCHED = "reliable", "best effort", "reliable, transient local"


@dataclass(frozen=True)
class Subscription:
    """One subscription; `checked` names the check of `stock_node` and says it in words."""

    software: str
    topic: str
    ros_type: str
    qos: str
    check: str
    source: str


NAV2, SLAM_TOOLBOX = "github.com/ros-navigation/navigation2", "github.com/SteveMacenski/slam_toolbox"
ROBOT_LOCALIZATION, RTABMAP = "github.com/cra-ros-pkg/robot_localization", "github.com/introlab/rtabmap_ros"
GEOMETRY2, RVIZ, RCLCPP = "github.com/ros2/geometry2", "github.com/ros2/rviz", "github.com/ros2/rclcpp"
RTABMAP_SUBSCRIBER = f"{RTABMAP}: rtabmap_sync/src/impl/CommonDataSubscriberDepth.cpp"

SCAN, ODOMETRY, IMAGE = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "sensor_msgs/msg/Image"
MAP, CAMERA_INFO = "nav_msgs/msg/OccupancyGrid", "sensor_msgs/msg/CameraInfo"

SUBSCRIPTIONS = (
    Subscription("Nav2: amcl", "/scan", SCAN, BEST_EFFORT, "scan", f"{NAV2}: nav2_amcl/src/amcl_node.cpp"),
    Subscription("Nav2: amcl", "/map", MAP, LATCHED, "map", f"{NAV2}: nav2_amcl/src/amcl_node.cpp"),
    Subscription(
        "Nav2: static layer", "/map", MAP, LATCHED, "map", f"{NAV2}: nav2_costmap_2d/plugins/static_layer.cpp"
    ),
    Subscription(
        "Nav2: obstacle layer",
        "/scan",
        SCAN,
        BEST_EFFORT,
        "scan",
        f"{NAV2}: nav2_costmap_2d/plugins/obstacle_layer.cpp",
    ),
    Subscription(
        "Nav2: obstacle layer",
        "/points",
        "sensor_msgs/msg/PointCloud2",
        BEST_EFFORT,
        "cloud",
        f"{NAV2}: nav2_costmap_2d/plugins/obstacle_layer.cpp",
    ),
    Subscription(
        "Nav2: controller server", "/odom", ODOMETRY, RELIABLE, "odometry", f"{NAV2}: nav2_util/src/odometry_utils.cpp"
    ),
    Subscription("slam_toolbox", "/scan", SCAN, BEST_EFFORT, "scan", f"{SLAM_TOOLBOX}: src/slam_toolbox_common.cpp"),
    Subscription("RTAB-Map", "/camera/color/image_raw", IMAGE, RELIABLE, "colour", RTABMAP_SUBSCRIBER),
    Subscription("RTAB-Map", "/camera/depth/image_raw", IMAGE, RELIABLE, "depth", RTABMAP_SUBSCRIBER),
    Subscription("RTAB-Map", "/camera/color/camera_info", CAMERA_INFO, RELIABLE, "camera model", RTABMAP_SUBSCRIBER),
    Subscription("RTAB-Map", "/odom", ODOMETRY, RELIABLE, "odometry", RTABMAP_SUBSCRIBER),
    Subscription("RTAB-Map", "/scan", SCAN, RELIABLE, "scan", RTABMAP_SUBSCRIBER),
    Subscription(
        "robot_localization", "/odom", ODOMETRY, BEST_EFFORT, "odometry", f"{ROBOT_LOCALIZATION}: src/ros_filter.cpp"
    ),
    Subscription(
        "robot_localization",
        "/imu",
        "sensor_msgs/msg/Imu",
        BEST_EFFORT,
        "inertia",
        f"{ROBOT_LOCALIZATION}: src/ros_filter.cpp",
    ),
    Subscription(
        "tf2", "/tf", "tf2_msgs/msg/TFMessage", RELIABLE, "transforms", f"{GEOMETRY2}: tf2_ros/include/tf2_ros/qos.hpp"
    ),
    Subscription(
        "tf2",
        "/tf_static",
        "tf2_msgs/msg/TFMessage",
        LATCHED,
        "transforms",
        f"{GEOMETRY2}: tf2_ros/include/tf2_ros/qos.hpp",
    ),
    Subscription(
        "RViz: robot model",
        "/robot_description",
        "std_msgs/msg/String",
        LATCHED,
        "description",
        f"{RVIZ}: rviz_default_plugins/src/rviz_default_plugins/displays/robot_model/robot_model_display.cpp",
    ),
    Subscription(
        "use_sim_time: true",
        "/clock",
        "rosgraph_msgs/msg/Clock",
        BEST_EFFORT,
        "clock",
        f"{RCLCPP}: rclcpp/include/rclcpp/qos.hpp",
    ),
)

CHECKS = {
    "scan": "10 Hz; its frame is in the tree at its time; as many ranges as angles, within its limits; `scan_time`",
    "map": "in the frame `map`; free cells about the robot, occupied ones about the room",
    "cloud": "`x`, `y` and `z` are float32; its frame is in the tree",
    "odometry": "20 Hz; from `odom` to `base_link`; covariances positive definite, below RTAB-Map's 9999",
    "colour": "`rgb8`; its frame is in the tree; stamped as depth, at most 5 Hz",
    "depth": "`32FC1`, metres, as many pixels as colour",
    "camera model": "`plumb_bob` of five numbers; `k`, `r` and `p` of a pinhole camera; stamped as colour",
    "inertia": "20 Hz; no orientation (-1); +9.8 m/s² upwards; other covariances positive definite",
    "transforms": "one tree, one parent for each frame: `map`, `odom`, `base_link`, `base_footprint` and the sensors'",
    "description": "URDF, whose links are frames of the tree",
    "clock": "20 Hz, one publisher; never back",
}
"""What is checked of the messages of each kind."""


def table() -> str:
    """Return the table in Markdown."""
    rows = ["| software | topic and type | asks for | checked |", "|---|---|---|---|"]
    rows += [
        f"| [{item.software}](https://{_link(item.source)}) | `{item.topic}` `{item.ros_type}` | {item.qos} | "
        f"{CHECKS[item.check]} |"
        for item in SUBSCRIPTIONS
    ]
    return "\n".join(rows)


def _link(source: str) -> str:
    repository, _, path = source.partition(": ")
    branch = {NAV2: "jazzy", RTABMAP: "jazzy-devel", SLAM_TOOLBOX: "ros2", ROBOT_LOCALIZATION: "ros2"}
    return f"{repository}/blob/{branch.get(repository, 'jazzy')}/{path}"
