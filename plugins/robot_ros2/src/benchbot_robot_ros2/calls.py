"""Services that are called before the first trial of a run, to claim, power or stand a robot, and after the last."""

import sys
import time
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError
from benchbot_robot_ros2.declaration_keys import Call
from benchbot_robot_ros2.failures import failed

if TYPE_CHECKING:
    from rclpy.node import Node

_POLL_S = 0.02


def before(node: "Node", robot: str, calls: Iterable[Call]) -> None:
    """Call services in their order; raises BenchbotError with what the first one says that refuses.

    The node's callbacks run in another thread.
    """
    for call in calls:
        _make(node, robot, call)


def after(node: "Node", robot: str, calls: Iterable[Call]) -> None:
    """Call services, the last one first. All are called; one that refuses is told on stderr."""
    for call in reversed(tuple(calls)):
        try:
            _make(node, robot, call)
        except BenchbotError as error:
            print(f"After the run: {error.title} {error.why}", file=sys.stderr, flush=True)


def _make(node: "Node", robot: str, call: Call) -> None:
    deadline_s = time.monotonic() + call.timeout_s
    kind = _service_type(call)
    request = kind.Request(data=call.data) if call.ros_type == "std_srvs/srv/SetBool" else kind.Request()
    client = node.create_client(kind, call.ros_service)
    try:
        while not client.service_is_ready():
            _wait(deadline_s, robot, call, "nobody offers it")
        answer = client.call_async(request)
        while not answer.done():
            _wait(deadline_s, robot, call, "it did not answer")
        response = answer.result()
    finally:
        node.executor.create_task(node.destroy_client, client)
    if not getattr(response, "success", True):
        raise _refused(robot, call, f"it answered: {response.message or 'no success, and no word why'}")


def _wait(deadline_s: float, robot: str, call: Call, problem: str) -> None:
    if time.monotonic() > deadline_s:
        raise _refused(robot, call, f"{problem} within {call.timeout_s:g} s")
    time.sleep(_POLL_S)


def _refused(robot: str, call: Call, why: str) -> BenchbotError:
    data = " '{data: " + str(call.data).lower() + "}'" if call.ros_type == "std_srvs/srv/SetBool" else ""
    return failed(
        f"The robot '{robot}' did not do what {call.ros_service} asks of it.",
        f"The service {call.ros_service} ({call.ros_type}): {why}.",
        f"Mend what it says; to try it alone: ros2 service call {call.ros_service} {call.ros_type}{data}",
    )


def _service_type(call: Call) -> Any:
    from std_srvs import srv

    return getattr(srv, call.ros_type.rpartition("/")[2])
