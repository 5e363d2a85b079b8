"""`benchbot bridge ros2`: a simulated robot as a ROS 2 robot."""

import os
import signal
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Seed, group

if TYPE_CHECKING:
    from benchbot.plugin import Catalog
    from benchbot_robot_ros2.bridge.robot import BridgedRobot

app = group("Present a simulated robot as a real one.")


@app.callback()
def bridge() -> None:
    """Present a simulated robot as a real one."""


@app.command()
def ros2(
    robot: Annotated[str, typer.Option("--robot", "-r", metavar="ROBOT", help="The simulated robot.")],
    environment: Annotated[
        str, typer.Option("--env", "-e", "--environment", metavar="NAME:VARIANT", help="The scene that it is in.")
    ],
    seed: Seed = 0,
    camera_rate_hz: Annotated[
        float, typer.Option(metavar="HZ", min=0.1, help="Take so many pictures a second, at most.")
    ] = 5.0,
    laser_rate_hz: Annotated[float, typer.Option(metavar="HZ", min=0.1, help="Scan so often a second.")] = 10.0,
    wall_time: Annotated[
        bool, typer.Option("--wall-time", help="Stamp with the system's time, and publish no /clock.")
    ] = False,
    arch: Annotated[str, typer.Option(metavar="ARCH", help="What rays are traced on: cpu or cuda.")] = "cpu",
    namespace: Annotated[str, typer.Option(metavar="NAME", help="Put topics and services below it.")] = "",
) -> None:
    """Present a simulated robot as a ROS 2 robot, in its own simulated time; Ctrl-C ends it."""
    from benchbot.plugin import Catalog, cache_dir, load_plugins
    from benchbot_robot_ros2 import ros
    from benchbot_robot_ros2.bridge.camera import Camera
    from benchbot_robot_ros2.bridge.node import Bridge
    from benchbot_robot_ros2.bridge.pace import SimulatedTime, WallTime
    from benchbot_robot_ros2.bridge.robot import NODE, BridgedRobot, find_robot, find_scene
    from benchbot_robot_ros2.bridge.state import StatePublisher, transforms_installed
    from benchbot_robot_ros2.bridge.world import World

    catalog = Catalog(load_plugins())
    declaration = find_robot(catalog, robot).data
    scene = find_scene(catalog, declaration, environment)
    bridged = BridgedRobot(declaration, namespace, {"arch": arch}, str(cache_dir()))

    for signal_number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signal_number, _interrupt)
    with ExitStack() as stack:
        try:
            node = stack.enter_context(ros.node(NODE, namespace=namespace))
            camera = stack.enter_context(closing(Camera(bridged, camera_rate_hz))) if bridged.pictures else None
            console.note(
                f"Loading {environment}; the very first time, the simulator compiles itself (up to a minute) …"
            )
            platform = stack.enter_context(closing(bridged.create(catalog.plugins)))
            robot_time = WallTime() if wall_time else SimulatedTime(platform.control_period_s)
            the_bridge = Bridge(catalog, bridged, World(platform, robot_time), camera, scene, seed)
            the_bridge.load()
            state = StatePublisher(node, bridged, simulated=not wall_time, laser_rate_hz=laser_rate_hz)
            if not transforms_installed():
                console.note(
                    "tf2_msgs is not installed, so there is no /tf: a ROS 2 installation has it, PyPI does not."
                )
            console.note(*_ready(bridged, environment, _drivers(catalog, declaration["type"])))
            the_bridge.run(node, state)
        except KeyboardInterrupt:
            console.note("The bridge has ended.")


def _interrupt(*_: Any) -> NoReturn:
    # Once is enough: what is let go of now must not be interrupted.
    for signal_number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signal_number, signal.SIG_IGN)
    raise KeyboardInterrupt


def _drivers(catalog: "Catalog", world: str) -> list[str]:
    """Return the declared ROS 2 robots that run in environments of the simulator's type."""
    robots = catalog.pool("robots").values()
    return [robot.name for robot in robots if robot.data["type"] == "ros2" and world in robot.data.get("runs_in", ())]


def _ready(robot: "BridgedRobot", environment: str, driven_as: list[str]) -> list[str]:
    domain = os.environ.get("ROS_DOMAIN_ID") or "0"
    prefix = f"/{robot.namespace}".rstrip("/")
    told = [f"{robot.name} in {environment} is a ROS 2 robot now: domain {domain}, topics under {prefix}/."]
    if driven_as and not prefix:
        told.append(f"benchbot submit --robot {driven_as[0]} --env {environment} … drives it.")
    return [*told, "Ctrl-C ends it."]
