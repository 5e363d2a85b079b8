"""A stand-in for Nav2, in a process of its own: it drives the test robot as its actions ask, and misbehaves when told.

`python nav2.py OPTIONS` with a JSON object that changes some of `DEFAULTS`. It offers /navigate_to_pose and
/follow_path, is localised by /truth, and publishes on /nav_vel, or where it is told. It says in JSON lines what it was
asked. The end of its input ends it.
"""

import json
import math
import os
import sys
import threading
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from nav2_msgs.action import FollowPath, NavigateToPose
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor

DEFAULTS: dict[str, Any] = {
    "velocity_topic": "/nav_vel",
    "short_m": 0.1,  # how near to its goal it ends
    "gives_up": 0,  # the error code with which it gives up at once
    "refuses": False,
    "refuses_to_cancel": False,
    "cancels_after_s": 0.0,
    "drives_on": False,  # after a goal was called off
    "dies_beyond_m": math.inf,
}
PERIOD_S = 0.05
FASTEST_MPS, FASTEST_RADPS = 0.4, 0.8


class Nav2:
    def __init__(self, options: dict[str, Any]) -> None:
        self.options = DEFAULTS | options
        self.node = rclpy.create_node("controller_server")
        self.pose = (0.0, 0.0, 0.0)
        self.is_over = False
        self.publisher = self.node.create_publisher(Twist, self.options["velocity_topic"], 1)
        self.node.create_subscription(Odometry, "/truth", self._on_truth, 1)
        for kind, name in ((NavigateToPose, "/navigate_to_pose"), (FollowPath, "/follow_path")):
            ActionServer(
                self.node,
                kind,
                name,
                lambda handle, kind=kind: self._drive(handle, kind),
                goal_callback=lambda _: GoalResponse.REJECT if self.options["refuses"] else GoalResponse.ACCEPT,
                cancel_callback=lambda _: (
                    CancelResponse.REJECT if self.options["refuses_to_cancel"] else CancelResponse.ACCEPT
                ),
                callback_group=ReentrantCallbackGroup(),
            )

    def _on_truth(self, message: Odometry) -> None:
        at, turn = message.pose.pose.position, message.pose.pose.orientation
        self.pose = at.x, at.y, 2 * math.atan2(turn.z, turn.w)

    def _drive(self, handle: Any, kind: Any) -> Any:
        asked = handle.request
        poses = asked.path.poses if kind is FollowPath else [asked.pose]
        position, rotation = poses[-1].pose.position, poses[-1].pose.orientation
        yaw = 2 * math.atan2(rotation.z, rotation.w)
        say(goal=[kind.__name__, poses[-1].header.frame_id, position.x, position.y, yaw], poses=len(poses))
        if self.options["gives_up"]:
            handle.abort()
            return kind.Result(error_code=self.options["gives_up"], error_msg="as the test wants it")
        begin = self.pose[:2]
        while not handle.is_cancel_requested:
            command = self._towards(position.x, position.y, yaw)
            self.publisher.publish(command)
            if math.dist(begin, self.pose[:2]) > self.options["dies_beyond_m"]:
                os._exit(1)
            if command == Twist():
                handle.succeed()
                return kind.Result()
            time.sleep(PERIOD_S)
        time.sleep(self.options["cancels_after_s"])
        handle.canceled()
        say(cancelled=kind.__name__)
        if self.options["drives_on"]:
            threading.Thread(target=self._drive_on, daemon=True).start()
        self.publisher.publish(Twist())
        return kind.Result()

    def _drive_on(self) -> None:
        while True:
            message = Twist()
            message.linear.x = FASTEST_MPS
            self.publisher.publish(message)
            time.sleep(PERIOD_S)

    def _towards(self, goal_x: float, goal_y: float, goal_yaw: float) -> Twist:
        x, y, yaw = self.pose
        message, left = Twist(), math.hypot(goal_x - x, goal_y - y)
        bearing = goal_yaw - yaw if left < self.options["short_m"] else math.atan2(goal_y - y, goal_x - x) - yaw
        bearing = math.remainder(bearing, 2 * math.pi)
        if left >= self.options["short_m"] and abs(bearing) < 0.5:
            message.linear.x = min(FASTEST_MPS, left)
        if left >= self.options["short_m"] or abs(bearing) > 0.2:
            message.angular.z = max(-FASTEST_RADPS, min(FASTEST_RADPS, 2 * bearing))
        return message


def say(**what: Any) -> None:
    print(json.dumps(what), flush=True)


def main() -> None:
    rclpy.init()
    nav2 = Nav2(json.loads(sys.argv[1]) if len(sys.argv) > 1 else {})
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(nav2.node)

    def end_with_input() -> None:
        sys.stdin.read()
        os._exit(0)

    threading.Thread(target=end_with_input, daemon=True).start()
    say(ready=True)
    executor.spin()


if __name__ == "__main__":
    main()
