"""A robot's servers in a process of their own, each with its way to answer; says in JSON lines what it was asked.

Services /home/{well,refused,silent,leaving}; actions /go/{well,refused,given_up,for_ever,never_cancelled,silent};
the node /scenes has the parameters of a scene. The end of its input ends it.
"""

import json
import os
import sys
import threading
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from nav2_msgs.action import NavigateToPose
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger


def say(**what: Any) -> None:
    print(json.dumps(what), flush=True)


def hang() -> None:
    threading.Event().wait()


def end_with_input() -> None:
    """End at the end of the input: with the test, however that ends."""
    sys.stdin.read()
    os._exit(0)


def offer_scenes() -> Node:
    node = rclpy.create_node("scenes")
    node.declare_parameters("", [("environment", ""), ("start_pose", [0.0]), ("seed", 0)])

    def check(parameters: list[Parameter]) -> SetParametersResult:
        values = {parameter.name: parameter.value for parameter in parameters}
        say(parameters={name: list(value) if name == "start_pose" else value for name, value in values.items()})
        known = values.get("environment") != "moon:2"
        return SetParametersResult(successful=known, reason="" if known else "no environment is called moon")

    node.add_on_set_parameters_callback(check)
    return node


def offer_services(node: Node) -> None:
    def well(_: Any, response: Any) -> Any:
        say(home="well")
        response.success = True
        return response

    def refused(_: Any, response: Any) -> Any:
        response.message = "the brake is on"
        return response

    def silent(_: Any, response: Any) -> Any:
        hang()
        return response

    def leaving(_: Any, response: Any) -> Any:
        node.destroy_service(services["leaving"])
        hang()
        return response

    services = {
        answer.__name__: node.create_service(
            Trigger, f"/home/{answer.__name__}", answer, callback_group=ReentrantCallbackGroup()
        )
        for answer in (well, refused, silent, leaving)
    }


def offer_navigation(node: Node, kind: str) -> None:
    def accept(_: Any) -> GoalResponse:
        if kind == "silent":
            hang()
        return GoalResponse.REJECT if kind == "refused" else GoalResponse.ACCEPT

    def cancel(_: Any) -> CancelResponse:
        return CancelResponse.REJECT if kind == "never_cancelled" else CancelResponse.ACCEPT

    def drive(handle: Any) -> Any:
        pose = handle.request.pose
        position, rotation = pose.pose.position, pose.pose.orientation
        say(goal=[pose.header.frame_id, position.x, position.y, rotation.z, rotation.w])
        if kind == "well":
            handle.succeed()
        elif kind == "given_up":
            handle.abort()
            return NavigateToPose.Result(error_code=208, error_msg="no path to the goal")
        else:
            while not handle.is_cancel_requested:
                time.sleep(0.02)
            handle.canceled()
            say(cancelled=kind)
        return NavigateToPose.Result()

    ActionServer(
        node,
        NavigateToPose,
        f"/go/{kind}",
        drive,
        goal_callback=accept,
        cancel_callback=cancel,
        callback_group=ReentrantCallbackGroup(),
    )


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("robot")
    offer_services(node)
    for kind in ("well", "refused", "given_up", "for_ever", "never_cancelled", "silent"):
        offer_navigation(node, kind)
    node.create_subscription(Twist, "/cmd_vel", lambda message: None, 1)
    executor = MultiThreadedExecutor(num_threads=8)
    executor.add_node(node)
    executor.add_node(offer_scenes())
    threading.Thread(target=end_with_input, daemon=True).start()
    say(ready=True)
    executor.spin()


if __name__ == "__main__":
    main()
