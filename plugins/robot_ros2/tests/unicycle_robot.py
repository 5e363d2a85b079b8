"""A robot for the tests, in a process of its own: a unicycle in front of a wall, that misbehaves when told to.

`python unicycle_robot.py OPTIONS` with a JSON object that changes some of `DEFAULTS`. Once it says "ready", a JSON
object on its standard input changes more of them; each line is answered by one with the robot's true state. The end of
the input ends the robot.
"""

import json
import math
import os
import subprocess
import sys
import threading
import time
from functools import partial
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped, Twist
from irobot_create_msgs.msg import HazardDetection, HazardDetectionVector
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import (
    BatteryState,
    CameraInfo,
    CompressedImage,
    Image,
    JointState,
    Joy,
    LaserScan,
    PointCloud2,
    PointField,
)
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

from benchbot.core.geometry import Pose

DEFAULTS: dict[str, Any] = {
    "namespace": "",  # of its topics and services, all but /clock
    "remap": {},  # by ROS 2
    "frame_prefix": "",  # of its frames, all but the map
    "simulated": False,  # publishes /clock
    "pace": 1.0,  # seconds of simulated time per second
    "clock_offset_s": 0.0,  # of /clock and stamps
    "wall_x_m": 5.0,
    "low_wall_x_m": 5.0,  # that the lidar sees and the laser does not
    "odometry_delay_s": 0.0,
    "twist_noise": 0.0,
    "odometry_scale": 1.0,  # what odometry makes of a metre
    "off_start_m": 0.0,  # where a reset puts the robot
    "collides": False,
    "silent": [],  # topics that nothing comes on
    "absent": [],  # topics that do not exist
    "stale": [],  # topics whose stamps stand still
    "stamp_offset_s": {},  # by topic
    "frames": {},  # other frames, by topic
    "reliability": {},  # by topic
    "compressed": False,  # the image has another type than usual
    "pressed": False,  # the emergency stop
    "held": True,  # the dead-man switch
    "hand": None,  # the velocities that a person commands, whose button a joystick tells of
    "pushed": None,  # of the joystick's button; by default it is pushed while a person commands
    "charge": 1.0,  # of the battery
    "refuses": [],  # services that refuse what is asked of them
    "hazards": [],  # types of hazards that are told with a stamp of zero
    "motion_pace": None,  # from the first velocity command on; its own clock is what is looked at then
    "lidar": False,  # publishes the wall on /points, seen by two rings below the laser
    "amcl": False,  # publishes where it is on /amcl_pose, ten times a second
    "transforms": False,  # publishes on /tf where "odom" is in "map", and "base_link" in "odom"
    "untold": [],  # frames whose transform does not come any more
    "scanner_yaw_deg": 0.0,  # how the scanner is really mounted
    "depth": None,  # publishes 32FC1 pictures on /depth, and how many units a metre has in them
    "depth_rows": 96,  # of these pictures
    "mounts": {},  # what /tf_static says: [parent, x, y, z, roll_deg, pitch_deg, yaw_deg] by frame
    "arm": False,  # publishes /joint_states, and listens to /arm/commands and /gripper/commands
    "joints": ["wheel", "finger_2", "elbow", "shoulder", "finger_1"],  # that /joint_states tells of
    "states_every": 2,  # how many ticks of 0.02 s lie between two of these
    "stuck": {},  # where a joint cannot go beyond, by name
    "place_off_m": 0.0,  # how far localisation is wrong
    "amcl_off_m": 0.0,  # how far AMCL is wrong until it is told the pose on /initialpose; None where it is silent
    "amcl_is_deaf": False,  # it takes no initial pose
    "strike": None,  # what the robot does `beyond_m` of its way: {"kill": [signal, pid, …]}, {"run": […]}, {"set": {…}}
}
TICK_S, ACCELERATION_MPS2, ACCELERATION_RADPS2, COMMAND_TIMEOUT_S = 0.02, 2.0, 4.0, 0.2
MUX_TIMEOUT_S = 0.5
RADIUS_M, LASER_X_M, BEAMS = 0.2, 0.05, 72
TOPICS = {
    "/odom": Odometry,
    "/truth": Odometry,
    "/scan": LaserScan,
    "/image": Image,
    "/camera_info": CameraInfo,
    "/collision": Bool,
    "/e_stop": Bool,
    "/dead_man": Bool,
    "/battery": BatteryState,
    "/joy": Joy,
    "/hazards": HazardDetectionVector,
    "/clock": Clock,
    "/points": PointCloud2,
    "/tf": TFMessage,
    "/tf_static": TFMessage,
    "/depth": Image,
    "/depth_info": CameraInfo,
    "/amcl_pose": PoseWithCovarianceStamped,
    "/joint_states": JointState,
}
SERVICES = {"claim": Trigger, "release": Trigger, "power": SetBool}
FRAMES = {"/odom": "odom", "/truth": "map", "/scan": "lidar", "/image": "camera", "/camera_info": "camera"}
FRAMES |= {"/depth": "camera", "/depth_info": "camera", "/points": "lidar", "/joint_states": ""}
SERVO_S = 0.03
DEPTH_WIDTH, DEPTH_FOCAL, CAMERA_X_M = 64, 64.0, 0.1


class Robot:
    def __init__(self, options: dict[str, Any]) -> None:
        self.options = DEFAULTS | options
        remaps = [word for pair in self.options["remap"].items() for word in ("-r", ":=".join(pair))]
        self.node = rclpy.create_node(
            "unicycle", namespace=self.options["namespace"], cli_args=["--ros-args", *remaps] if remaps else []
        )
        self.x = self.y = self.yaw = self.v = self.u = self.w = self.travelled = self.turned = 0.0
        self.collided = False
        self.backwards_m, self.heard_under_hand, self.handed_s = 0.0, 0, math.inf
        self.command, self.commanded_s, self.first_s = (0.0, 0.0, 0.0), -math.inf, -math.inf
        self.time_s = 100.0
        # By the robot's clock: the strike, the last velocity that came, the first zero after it, the rest after that.
        self.struck_s: float | None = None
        self.moved_s: float | None = None
        self.zeroed_s: float | None = None
        self.rested_s: float | None = None
        self.frozen: dict[str, float] = {}
        self.late: list[tuple[float, Odometry]] = []
        self.random = np.random.default_rng(0)
        self.joints = dict.fromkeys(("wheel", "shoulder", "elbow", "finger_1", "finger_2"), 0.0)
        self.told, self.longest_step, self.setpoints = dict(self.joints), dict(self.joints), 0
        self.publishers = {topic: self._publisher(topic, kind) for topic, kind in TOPICS.items()}
        self.send("/tf_static", self.mounts())
        self.node.create_subscription(Twist, "cmd_vel", self._on_first_command, 1)
        self.node.create_subscription(Twist, "nav_vel", self._on_second_command, 1)
        self.node.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_initial_pose, 1)
        if self.options["arm"]:
            self.node.create_subscription(Float64MultiArray, "arm/commands", self._on_arm, 1)
            self.node.create_subscription(JointState, "gripper/commands", self._on_joints, 1)
        self.node.create_service(Trigger, "reset", self._on_reset)
        self.called: list[str] = []
        for service, kind in SERVICES.items():
            self.node.create_service(kind, service, partial(self._on_call, service))

    def _publisher(self, topic: str, kind: Any) -> Any:
        unpublished = {"/clock": not self.options["simulated"], "/tf": not self.options["transforms"]}
        unpublished["/points"] = not self.options["lidar"]
        unpublished["/joint_states"] = not self.options["arm"]
        unpublished["/amcl_pose"] = not self.options["amcl"]
        unpublished["/tf_static"] = not self.options["mounts"]
        unpublished["/depth"] = unpublished["/depth_info"] = self.options["depth"] is None
        if topic in self.options["absent"] or unpublished.get(topic):
            return None
        if topic == "/image" and self.options["compressed"]:
            kind = CompressedImage
        reliability = self.options["reliability"].get(topic, "reliable")
        profile = QoSProfile(depth=5, reliability=ReliabilityPolicy[reliability.upper()])
        if topic == "/tf_static":
            profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
        name = topic if topic == "/clock" else topic.removeprefix("/")
        return self.node.create_publisher(kind, name, profile)

    def _on_first_command(self, message: Twist) -> None:
        self.first_s = self.time_s
        self._on_command(message)

    def _on_second_command(self, message: Twist) -> None:
        # As twist_mux, with a timeout of half a second.
        if self.time_s - self.first_s > MUX_TIMEOUT_S:
            self._on_command(message)

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        if not self.options["amcl_is_deaf"]:
            self.options["amcl_off_m"] = message.pose.pose.position.x - self.x

    def _on_command(self, message: Twist) -> None:
        self.command, self.commanded_s = (message.linear.x, message.angular.z, message.linear.y), self.time_s
        # A guard needs a moment to notice a person, a long one where it is busy, and says for another to stop.
        self.heard_under_hand += self.options["hand"] is not None and self.clock_s() - self.handed_s > 2.0
        if any(self.command):
            self.moved_s, self.zeroed_s, self.rested_s = self.clock_s(), None, None
            self.options["pace"] = self.options["motion_pace"] or self.options["pace"]
        elif self.zeroed_s is None:
            self.zeroed_s = self.clock_s()

    def _on_arm(self, message: Float64MultiArray) -> None:
        self._on_joints(JointState(name=["shoulder", "elbow"], position=message.data))

    def _on_joints(self, message: JointState) -> None:
        self.setpoints += 1
        for name, position in zip(message.name, message.position, strict=True):
            self.longest_step[name] = max(self.longest_step[name], abs(position - self.told[name]))
            self.told[name] = position

    def _on_reset(self, _request: Any, response: Any) -> Any:
        self.x, self.y, self.yaw, self.v, self.u, self.w = self.options["off_start_m"], 0.0, 0.0, 0.0, 0.0, 0.0
        self.travelled = 0.0
        self.collided = False
        response.success = True
        return response

    def _on_call(self, service: str, request: Any, response: Any) -> Any:
        self.called.append(service + str(getattr(request, "data", "")))
        response.success = service not in self.options["refuses"]
        response.message = "" if response.success else f"{service}: somebody else has it"
        return response

    def clock_s(self) -> float:
        """Return the robot's time, which nobody sets."""
        return self.time_s if self.options["simulated"] else time.monotonic()

    def strike(self, blow: dict[str, Any]) -> None:
        self.struck_s = self.clock_s()
        number, *pids = blow.get("kill", [0])
        for pid in pids:
            os.kill(pid, number)
        if "run" in blow:
            subprocess.run(blow["run"], check=True)
        self.options |= blow.get("set", {})

    def servo(self, dt: float) -> None:
        """Let each joint follow what it was told, as a controller of position does."""
        for name, told in self.told.items():
            way = (told - self.joints[name]) * (1 - math.exp(-dt / SERVO_S))
            stop = self.options["stuck"].get(name)
            if stop is not None and abs(self.joints[name] + way) > abs(stop):
                way = stop - self.joints[name]
            self.joints[name] += way

    def joint_states(self) -> JointState:
        names = [name for name in self.options["joints"] if name in self.joints]
        message = JointState(name=names, position=[self.joints[name] for name in names])
        message.effort = [0.0 if name == "wheel" else 7.0 for name in names]
        return self.headed(message, "/joint_states")

    def now_s(self) -> float:
        simulated: float = self.time_s + self.options["clock_offset_s"]
        return simulated if self.options["simulated"] else time.time()

    def advance(self, dt: float, tick: int) -> None:
        self.time_s += dt
        wanted = self.command if self.time_s - self.commanded_s < COMMAND_TIMEOUT_S else (0.0, 0.0, 0.0)
        # As twist_mux does: who has the joystick is heard first.
        wanted = (*self.options["hand"], 0.0) if self.options["hand"] else wanted
        self.handed_s = math.inf if self.options["hand"] is None else min(self.handed_s, self.clock_s())
        self.backwards_m += max(0.0, -self.v * dt)
        self.v += max(-ACCELERATION_MPS2 * dt, min(ACCELERATION_MPS2 * dt, wanted[0] - self.v))
        self.w += max(-ACCELERATION_RADPS2 * dt, min(ACCELERATION_RADPS2 * dt, wanted[1] - self.w))
        self.u += max(-ACCELERATION_MPS2 * dt, min(ACCELERATION_MPS2 * dt, wanted[2] - self.u))
        cos, sin = math.cos(self.yaw + self.w * dt / 2), math.sin(self.yaw + self.w * dt / 2)
        x = self.x + (self.v * cos - self.u * sin) * dt
        if self.options["collides"] or x + RADIUS_M > self.options["wall_x_m"]:
            self.collided, self.v, self.u, x = True, 0.0, 0.0, self.x
        self.y += (self.v * sin + self.u * cos) * dt
        self.x, self.yaw, self.travelled = x, self.yaw + self.w * dt, self.travelled + abs(self.v) * dt
        self.turned += abs(self.w) * dt
        if (self.v, self.u, self.w) == (0.0, 0.0, 0.0) and self.rested_s is None:
            self.rested_s = self.clock_s()
        self.servo(dt)
        blow = self.options["strike"]
        if blow is not None and self.struck_s is None and self.travelled > blow["beyond_m"]:
            self.strike(blow)
        self.publish(tick)

    def publish(self, tick: int) -> None:
        if self.options["simulated"]:
            self.send("/clock", Clock(clock=stamp(self.now_s())))
        self.late.append((self.time_s + self.options["odometry_delay_s"], self.odometry("/odom")))
        while self.late and self.late[0][0] <= self.time_s + 1e-9:
            self.send("/odom", self.late.pop(0)[1])
        self.send("/truth", self.odometry("/truth"))
        if self.options["transforms"]:
            self.send("/tf", self.transforms())
        self.send("/e_stop", Bool(data=self.options["pressed"]))
        self.send("/dead_man", Bool(data=self.options["held"]))
        pushed = self.options["hand"] is not None if self.options["pushed"] is None else self.options["pushed"]
        self.send("/joy", Joy(buttons=[0, int(pushed)]))
        self.send("/battery", BatteryState(percentage=self.options["charge"]))
        hazards = [HazardDetection(type=kind) for kind in self.options["hazards"]]
        self.send("/hazards", HazardDetectionVector(detections=hazards))
        if tick % self.options["states_every"] == 0:
            self.send("/joint_states", self.joint_states())
        if tick % 5 == 0:
            truth = self.odometry("/truth")
            if self.options["amcl_off_m"] is not None:
                truth.pose.pose.position.x += self.options["amcl_off_m"]
                self.send("/amcl_pose", PoseWithCovarianceStamped(header=truth.header, pose=truth.pose))
            self.send("/scan", self.scan())
            self.send("/points", self.points())
            self.send("/image", self.image())
            info = CameraInfo(width=8, height=6, k=[4.0, 0, 3.5, 0, 4.0, 2.5, 0, 0, 1.0])
            info.p = [4.0, 0, 3.5, 0, 0, 4.0, 2.5, 0, 0, 0, 1.0, 0]
            self.send("/camera_info", self.headed(info, "/camera_info"))
            self.send("/depth", self.depth())
            rows = self.options["depth_rows"]
            k = [DEPTH_FOCAL, 0, (DEPTH_WIDTH - 1) / 2, 0, DEPTH_FOCAL, (rows - 1) / 2, 0, 0, 1.0]
            info = CameraInfo(width=DEPTH_WIDTH, height=rows, k=k, p=[*k[:3], 0, *k[3:6], 0, *k[6:], 0])
            self.send("/depth_info", self.headed(info, "/depth_info"))
            self.send("/collision", Bool(data=self.collided))

    def send(self, topic: str, message: Any) -> None:
        publisher = self.publishers[topic]
        if publisher is not None and topic not in self.options["silent"]:
            publisher.publish(message)

    def headed(self, message: Any, topic: str) -> Any:
        now_s = self.now_s()
        if topic in self.options["stale"]:
            now_s = self.frozen.setdefault(topic, now_s)
        message.header.stamp = stamp(max(0.0, now_s + self.options["stamp_offset_s"].get(topic, 0.0)))
        message.header.frame_id = self.frame(self.options["frames"].get(topic, FRAMES[topic]))
        return message

    def frame(self, name: str) -> str:
        return name if name == "map" else f"{self.options['frame_prefix']}{name}"

    def odometry(self, topic: str) -> Odometry:
        message = self.headed(Odometry(child_frame_id=self.frame("base_link")), topic)
        scale = self.options["odometry_scale"] if topic == "/odom" else 1.0
        # Odometry has its own origin, and heads elsewhere.
        x, y, yaw = self.x * scale, self.y * scale, self.yaw
        if topic == "/odom":
            x, y, yaw = 3.0 - y, 4.0 + x, yaw + math.pi / 2
        else:
            x += self.options["place_off_m"]
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        noise = self.options["twist_noise"] * self.random.standard_normal(2)
        message.twist.twist.linear.x, message.twist.twist.angular.z = self.v + noise[0], self.w + noise[1]
        message.twist.twist.linear.y = self.u
        return message

    def transforms(self) -> TFMessage:
        place, base = (TransformStamped(child_frame_id=self.frame(name)) for name in ("odom", "base_link"))
        place.header.frame_id = "map"
        place.transform.translation.x, place.transform.translation.y = self.options["place_off_m"] - 4.0, 3.0
        place.transform.rotation.z, place.transform.rotation.w = -math.sqrt(0.5), math.sqrt(0.5)
        seen = self.odometry("/odom")
        base.header.frame_id, base.header.stamp = self.frame("odom"), seen.header.stamp
        place.header.stamp = seen.header.stamp
        base.transform.translation.x = seen.pose.pose.position.x
        base.transform.translation.y = seen.pose.pose.position.y
        base.transform.rotation = seen.pose.pose.orientation
        untold = [self.frame(name) for name in self.options["untold"]]
        told = [one for one in (place, base) if one.child_frame_id not in untold]
        return TFMessage(transforms=told)

    def mounts(self) -> TFMessage:
        told = []
        for frame, (parent, x, y, z, *rpy_deg) in self.options["mounts"].items():
            one = TransformStamped(child_frame_id=frame)
            one.header.frame_id = parent
            one.transform.translation.x, one.transform.translation.y, one.transform.translation.z = x, y, z
            turned = one.transform.rotation
            turned.x, turned.y, turned.z, turned.w = Pose.from_xyz_rpy_deg((x, y, z), rpy_deg).rotation_xyzw
            told.append(one)
        return TFMessage(transforms=told)

    def depth(self) -> Any:
        """Return the wall, as a camera sees it that looks ahead."""
        slopes = (np.arange(DEPTH_WIDTH) - (DEPTH_WIDTH - 1) / 2) / DEPTH_FOCAL
        away = math.cos(self.yaw) + slopes * math.sin(self.yaw)
        camera_x = self.x + CAMERA_X_M * math.cos(self.yaw)
        with np.errstate(divide="ignore"):
            row = np.where(away > 1e-6, (self.options["wall_x_m"] - camera_x) / away, np.inf)
        pixels = np.tile((row * (self.options["depth"] or 1.0)).astype("<f4"), (self.options["depth_rows"], 1))
        picture = Image(height=self.options["depth_rows"], width=DEPTH_WIDTH, encoding="32FC1", step=4 * DEPTH_WIDTH)
        picture.data = pixels.tobytes()
        return self.headed(picture, "/depth")

    def scan(self) -> LaserScan:
        angles = -math.pi + np.arange(BEAMS) * 2 * math.pi / BEAMS
        laser_x = self.x + LASER_X_M * math.cos(self.yaw)
        towards = np.cos(angles + self.yaw + math.radians(self.options["scanner_yaw_deg"]))
        with np.errstate(divide="ignore"):
            ranges = np.where(towards > 1e-6, (self.options["wall_x_m"] - laser_x) / towards, np.inf)
        message = LaserScan(angle_min=-math.pi, angle_increment=2 * math.pi / BEAMS, range_min=0.05, range_max=30.0)
        message.angle_max = float(angles[-1])
        message.ranges = ranges.astype(np.float32).tolist()
        return self.headed(message, "/scan")

    def points(self) -> PointCloud2:
        # Two rings of three beams.
        angles = np.radians([-20.0, 0.0, 20.0])
        ahead = self.options["low_wall_x_m"] - self.x - LASER_X_M
        rings = [
            np.stack([np.full(3, ahead), ahead * np.tan(angles), -ahead / np.cos(angles) * math.tan(down_rad)], 1)
            for down_rad in (math.radians(15.0), math.radians(10.0))
        ]
        fields = [PointField(name=axis, offset=4 * i, datatype=7, count=1) for i, axis in enumerate("xyz")]
        message = PointCloud2(height=2, width=3, fields=fields, point_step=12, row_step=36)
        message.data = np.stack(rings).astype("<f4").tobytes()
        return self.headed(message, "/points")

    def image(self) -> Any:
        if self.options["compressed"]:
            return self.headed(CompressedImage(format="jpeg"), "/image")
        # The brightness tells how far the robot has come, in centimetres.
        value = round(100 * self.x) % 256
        return self.headed(Image(height=6, width=8, encoding="rgb8", step=24, data=bytes([value] * 144)), "/image")

    def state(self) -> dict[str, Any]:
        names: tuple[str, ...] = ("x", "y", "yaw", "v", "u", "w", "turned", "collided", "called", "struck_s", "moved_s")
        names += ("zeroed_s", "rested_s", "backwards_m", "heard_under_hand", "joints", "longest_step", "setpoints")
        return {name: getattr(self, name) for name in names} | {"time_s": self.clock_s()}


def stamp(seconds: float) -> Time:
    return Time(sec=int(seconds), nanosec=int(seconds % 1 * 1e9))


def main() -> None:
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    robot = Robot(json.loads(sys.argv[1]) if len(sys.argv) > 1 else {})
    lock, over = threading.Lock(), threading.Event()

    def obey() -> None:
        for line in sys.stdin:
            with lock:
                robot.options.update(json.loads(line))
                print(json.dumps(robot.state()), flush=True)
        over.set()  # whoever started this robot is gone

    threading.Thread(target=obey, daemon=True).start()
    print("ready", flush=True)
    tick, due_s, last_s = 0, time.monotonic(), time.monotonic()
    while not over.is_set():
        rclpy.spin_once(robot.node, timeout_sec=max(0.0, due_s - time.monotonic()))
        now_s = time.monotonic()
        if now_s < due_s:
            continue
        simulated = robot.options["simulated"]
        with lock:
            robot.advance(TICK_S if simulated else now_s - last_s, tick)
        last_s, tick = now_s, tick + 1
        due_s = max(due_s, now_s - TICK_S) + (TICK_S / robot.options["pace"] if simulated else TICK_S)
    robot.node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
