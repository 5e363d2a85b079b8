"""ROS 2 in this process: its environment, and nodes, that may spin in a thread of their own."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from benchbot.plugin import BenchbotError

if TYPE_CHECKING:
    from rclpy.node import Node


class Graph(msgspec.Struct, frozen=True):
    """The graph that a robot is found in, and the names there of what every node uses.

    Without a `domain` it is that of ROS_DOMAIN_ID, without `rmw` that of RMW_IMPLEMENTATION.
    """

    namespace: str = ""
    clock: str = "/clock"
    transforms: tuple[str, str] = ("/tf", "/tf_static")
    domain: int | None = None
    rmw: str | None = None


HERE = Graph()
"""The graph that the environment's variables say."""


def prepare() -> None:
    """Set the variables that ROS 2 reads when it is imported, where the user has not set them.

    ROS 2 from PyPI finds its libraries below the environment's prefix; a ROS 2 installation that was sourced has said
    where it is already.
    """
    os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)
    os.environ.setdefault("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    with as_file(files("benchbot_robot_ros2") / "fastdds.xml") as profile:
        os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(profile))


def is_installed(rmw: str) -> bool:
    """Return whether a middleware is installed: a process that asks for one that is not, is ended by ROS 2."""
    prepare()
    index = Path("share/ament_index/resource_index/rmw_typesupport") / rmw
    return any((Path(prefix) / index).exists() for prefix in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep))


def _use(rmw: str) -> None:
    """Let this process speak a middleware; raises BenchbotError when it is not installed, or another one is spoken."""
    if not is_installed(rmw):
        raise BenchbotError(
            f"The robot speaks {rmw}, which is not installed.",
            "Its declaration says driver.rmw, and nobody can listen to one middleware with another for sure.",
            f"sudo apt install ros-jazzy-{rmw.replace('_', '-')} and source /opt/ros/jazzy/setup.bash, or leave "
            "driver.rmw out of the declaration.",
        )
    if "rclpy" not in sys.modules:
        os.environ["RMW_IMPLEMENTATION"] = rmw
    elif (spoken := os.environ["RMW_IMPLEMENTATION"]) != rmw:
        raise BenchbotError(
            f"The robot speaks {rmw}, and this process {spoken}.",
            "A process of ROS 2 speaks the middleware that it has begun with.",
            f"Start it with: RMW_IMPLEMENTATION={rmw}",
        )


@contextmanager
def node(name: str, *, namespace: str = "", use_sim_time: bool = False, graph: Graph = HERE) -> "Iterator[Node]":
    """Yield a node in a context of its own that spins only on request; without a namespace it is in the graph's.

    Raises BenchbotError when ROS 2 refuses to make it, saying why.
    """
    prepare()
    if graph.rmw is not None:
        _use(graph.rmw)
    namespace = namespace or graph.namespace
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
            validate_namespace(f"/{namespace.removeprefix('/')}")
            rclpy.init(context=context, domain_id=graph.domain, signal_handler_options=SignalHandlerOptions.NO)
            overrides = [Parameter("use_sim_time", Parameter.Type.BOOL, use_sim_time)]
            remaps = ["--ros-args", "-r", f"/clock:={graph.clock}"]
            made = rclpy.create_node(
                name, context=context, namespace=namespace, parameter_overrides=overrides, cli_args=remaps
            )
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
def running_node(name: str, *, use_sim_time: bool = False, graph: Graph = HERE) -> "Iterator[Node]":
    """Yield a node whose callbacks run, one at a time, in a thread that ends on leaving."""
    with node(name, use_sim_time=use_sim_time, graph=graph) as made:
        from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

        executor = SingleThreadedExecutor(context=made.context)
        executor.add_node(made)
        leaving = threading.Event()

        def spin() -> None:
            with suppress(ExternalShutdownException):
                while not leaving.is_set():
                    executor.spin_once()

        thread = threading.Thread(target=spin, name=f"ros-{name}", daemon=True)
        thread.start()
        try:
            yield made
        finally:
            # Ended by itself: what a shutdown destroys, a callback may just be about to use (InvalidHandle).
            executor.create_task(leaving.set)
            thread.join()
            executor.shutdown()
