"""`benchbot bridge ros2`: a simulated robot as a ROS 2 robot."""

import os
import signal
from collections.abc import Callable
from contextlib import ExitStack, closing
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Device, Seed, group

if TYPE_CHECKING:
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
    stamped: Annotated[
        bool, typer.Option("--stamped", help="Obey geometry_msgs/msg/TwistStamped instead of Twist.")
    ] = False,
    has_map: Annotated[bool, typer.Option("--map", help="Publish the scene's occupancy map.")] = False,
    map_transform: Annotated[
        bool,
        typer.Option(" /--no-map-transform", help="Leave map → odom to AMCL or slam_toolbox.", show_default=False),
    ] = True,
    device: Device = "auto",
    namespace: Annotated[str, typer.Option(metavar="NAME", help="Put topics and services below it.")] = "",
    frame_prefix: Annotated[
        str | None,
        typer.Option(metavar="PREFIX", help="Put it before the names of all frames; NAMESPACE/ when not given."),
    ] = None,
) -> None:
    """Present a simulated robot as a ROS 2 robot, in its own simulated time; Ctrl-C ends it."""
    from benchbot.plugin import Catalog, cache_dir, load_plugins
    from benchbot_robot_ros2 import ros
    from benchbot_robot_ros2.bridge.camera import Camera
    from benchbot_robot_ros2.bridge.clock import SharedTime
    from benchbot_robot_ros2.bridge.fitting import drivers
    from benchbot_robot_ros2.bridge.node import Bridge
    from benchbot_robot_ros2.bridge.occupancy_map import MapServer
    from benchbot_robot_ros2.bridge.pace import SimulatedTime, WallTime
    from benchbot_robot_ros2.bridge.robot import NODE, BridgedRobot, find_robot, find_scene
    from benchbot_robot_ros2.bridge.state import StatePublisher
    from benchbot_robot_ros2.bridge.transforms import Transforms, transforms_installed
    from benchbot_robot_ros2.bridge.type_watch import TypeWatch
    from benchbot_robot_ros2.bridge.world import World

    catalog = Catalog(load_plugins())
    declaration = find_robot(catalog, robot).data
    scene = find_scene(catalog, declaration, environment)
    if frame_prefix is None:
        frame_prefix = f"{namespace}/" if namespace else ""
    bridged = BridgedRobot(declaration, namespace, {"device": device}, str(cache_dir()), frame_prefix, stamped)
    if bridged.unpresented:
        console.note(
            "The bridge presents a base and its sensors. It does not present: "
            f"{', '.join(bridged.unpresented)}. Use them without ROS 2: benchbot run."
        )

    ended = Event()

    def interrupt(*_: Any) -> None:
        # Once is enough: what is let go of now must not be interrupted.
        _on_end(signal.SIG_IGN)
        ended.set()
        raise KeyboardInterrupt

    def finish(*_: Any) -> None:
        # An exception in the midst of rclpy may be lost there, or leave a lock behind that its end waits for: only the
        # second signal interrupts, such as a reset that hangs.
        if ended.is_set():
            interrupt()
        ended.set()

    _on_end(interrupt)
    with ExitStack() as stack:
        try:
            node = stack.enter_context(ros.node(NODE, namespace=namespace))
            camera = stack.enter_context(closing(Camera(bridged, camera_rate_hz))) if bridged.pictures else None
            console.note(
                f"Loading {environment}; the very first time, the simulator compiles itself (up to a minute) …"
            )
            platform = stack.enter_context(closing(bridged.create(catalog.plugins)))
            period_s = platform.control_period_s
            world = World(
                platform,
                SimulatedTime(period_s),
                declaration.get("noise", {}),
                holonomic="lateral_mps" in declaration.get("limits", {}) and hasattr(platform, "drive_sideways"),
            )
            maps = MapServer(node, bridged) if has_map else None
            the_bridge = Bridge(catalog, bridged, world, camera, maps, (scene, seed))
            the_bridge.load()
            # Only now, since who claims /clock publishes on it at once: another bridge may be waiting to hear that.
            clock = None if wall_time else SharedTime(node, period_s)
            world.live_in(clock or WallTime(period_s))
            has_transforms = transforms_installed()
            transforms = Transforms(node, bridged, map_transform=map_transform) if has_transforms else None
            state = StatePublisher(node, bridged, clock=clock, transforms=transforms, laser_rate_hz=laser_rate_hz)
            if not has_transforms:
                console.note(
                    "tf2_msgs is not installed, so there is no /tf: a ROS 2 installation has it, PyPI does not."
                )
            fitting = drivers(catalog, bridged, simulated=not wall_time, transforms=has_transforms)
            _on_end(finish)
            console.note(*_ready(bridged, environment, fitting))
            the_bridge.run(node, state, TypeWatch(node, bridged, console.note, clock), ended)
        except KeyboardInterrupt:
            pass
    console.note("The bridge has ended.")


def _on_end(handler: Callable[..., Any] | signal.Handlers) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)


def _ready(robot: "BridgedRobot", environment: str, drivers: dict[str, list[str]]) -> list[str]:
    """Return what the user is told; `drivers` are declared robots and what each asks in vain, the best first."""
    domain = os.environ.get("ROS_DOMAIN_ID") or "0"
    space = f"/{robot.namespace}".rstrip("/")
    told = [f"{robot.name} in {environment} is a ROS 2 robot now: domain {domain}, topics under {space}/."]
    best = next(iter(drivers), None)
    if best is not None and not drivers[best]:
        told.append(
            f"The robot {best} fits it: benchbot submit --robot {best} --env {environment} --task TASK --native python "
            "my_solution.py drives it."
        )
        return [*told, "Ctrl-C ends it."]
    nearest = ""
    if best is not None:
        first, others = drivers[best][0], len(drivers[best]) - 1
        nearest = f" The nearest is {best}, which asks in vain for {first}{f', and {others} more' if others else ''}."
    told.append(f"No installed robot of type ros2 fits it, so BenchBot can drive it by none.{nearest}")
    told.append(
        f"Make one: benchbot show robot {best or 'carter_ros2'} > my_robot.yaml; correct its name, topics and frames "
        "(docs/ros2.md, 'Declare your robot')."
    )
    return [*told, "Ctrl-C ends it."]
