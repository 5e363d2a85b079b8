"""ROS 2 in this process: its environment, and nodes that spin in a thread of their own."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.node import Node


def prepare() -> None:
    """Set the variables that ROS 2 reads when it is imported, where the user has not set them.

    ROS 2 from PyPI finds its libraries below the environment's prefix; a ROS 2 installation that was sourced has said
    where it is already.
    """
    os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)
    os.environ.setdefault("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    with as_file(files("benchbot_robot_ros2") / "fastdds.xml") as profile:
        os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(profile))


@contextmanager
def running_node(name: str, *, use_sim_time: bool = False) -> "Iterator[Node]":
    """Yield a node in a context of its own, whose callbacks run, one at a time, in a thread that ends on leaving."""
    prepare()
    import rclpy
    from rclpy.context import Context
    from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
    from rclpy.parameter import Parameter
    from rclpy.signals import SignalHandlerOptions

    context = Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    try:
        overrides = [Parameter("use_sim_time", Parameter.Type.BOOL, use_sim_time)]
        node = rclpy.create_node(name, context=context, parameter_overrides=overrides)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)

        def spin() -> None:
            with suppress(ExternalShutdownException):
                executor.spin()

        thread = threading.Thread(target=spin, name=f"ros-{name}", daemon=True)
        thread.start()
        try:
            yield node
        finally:
            executor.shutdown()
            thread.join()
            node.destroy_node()
    finally:
        rclpy.shutdown(context=context)
