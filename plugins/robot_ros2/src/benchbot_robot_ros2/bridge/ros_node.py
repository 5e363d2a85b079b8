"""A ROS 2 node that spins only when its owner says so."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from benchbot.core.errors import BenchbotError
from benchbot_robot_ros2 import ros

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.qos import QoSProfile


@contextmanager
def node(name: str, namespace: str) -> "Iterator[Node]":
    """Yield a node in a context of its own; raises BenchbotError when ROS 2 refuses to make it, saying why."""
    ros.prepare()
    import rclpy
    from rclpy._rclpy_pybind11 import RCLError
    from rclpy.context import Context
    from rclpy.exceptions import InvalidNamespaceException
    from rclpy.signals import SignalHandlerOptions
    from rclpy.validate_namespace import validate_namespace

    context = Context()
    try:
        validate_namespace(f"/{namespace}")
        rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
        made = rclpy.create_node(name, context=context, namespace=namespace)
    except InvalidNamespaceException as error:
        raise BenchbotError(
            f"'{namespace}' is not a namespace of ROS 2.",
            "A namespace is made of letters, digits and underscores, in levels between slashes.",
            "For example: --namespace robot_1",
        ) from error
    except RCLError as error:
        raise BenchbotError(
            "ROS 2 does not start.",
            str(error),
            "Look at the environment variables ROS_DOMAIN_ID (0 to 232), RMW_IMPLEMENTATION and "
            "FASTRTPS_DEFAULT_PROFILES_FILE.",
        ) from error
    try:
        yield made
    finally:
        made.destroy_node()
        rclpy.shutdown(context=context)


def sending(depth: int) -> "QoSProfile":
    """Return the quality of service of what is sent: reliable, since that serves every subscriber.

    A best-effort publisher is not heard by those that ask for reliability, such as RViz and Nav2's by default.
    """
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE)
