"""ROS 2 in this process: its environment, and nodes, that may spin in a thread of their own."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

from benchbot.plugin import BenchbotError

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
def node(name: str, *, namespace: str = "", use_sim_time: bool = False) -> "Iterator[Node]":
    """Yield a node in a context of its own that spins only on request.

    Raises BenchbotError when ROS 2 refuses to make it, saying why.
    """
    prepare()
    import rclpy
    from rclpy._rclpy_pybind11 import RCLError
    from rclpy.context import Context
    from rclpy.exceptions import InvalidNamespaceException
    from rclpy.parameter import Parameter
    from rclpy.signals import SignalHandlerOptions
    from rclpy.validate_namespace import validate_namespace

    context = Context()
    with ExitStack() as stack:
        stack.callback(context.try_shutdown)
        try:
            validate_namespace(f"/{namespace}")
            rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
            overrides = [Parameter("use_sim_time", Parameter.Type.BOOL, use_sim_time)]
            made = rclpy.create_node(name, context=context, namespace=namespace, parameter_overrides=overrides)
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
        stack.callback(made.destroy_node)
        yield made


@contextmanager
def running_node(name: str, *, use_sim_time: bool = False) -> "Iterator[Node]":
    """Yield a node whose callbacks run, one at a time, in a thread that ends on leaving."""
    with node(name, use_sim_time=use_sim_time) as made:
        from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

        executor = SingleThreadedExecutor(context=made.context)
        executor.add_node(made)

        def spin() -> None:
            with suppress(ExternalShutdownException):
                executor.spin()

        thread = threading.Thread(target=spin, name=f"ros-{name}", daemon=True)
        thread.start()
        try:
            yield made
        finally:
            executor.shutdown()
            thread.join()
