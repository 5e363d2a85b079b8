"""Checks of a robot's transforms against its declared mounts and its localisation."""

from collections.abc import Iterator
from contextlib import suppress

from benchbot.plugin import Finding, Level, Pose
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import LocalisedByTransforms
from benchbot_robot_ros2.doctor import message_checks
from benchbot_robot_ros2.transforms import TransformTree, TwoTreesError


def check(robot: Ros2Robot, tree: TransformTree | None, *, published: bool) -> Iterator[Finding]:
    """Say whether each frame is where it is declared, and whether the robot is localised.

    `tree` is None without tf2_msgs; `published` says whether anybody publishes transforms at all.
    """
    needed = isinstance(robot.settings.localisation, LocalisedByTransforms)
    if tree is None or not published:
        missing = f"nothing publishes {' or '.join(robot.graph.transforms)}" if tree else "tf2_msgs is not installed"
        fix = (
            "Start robot_state_publisher with the robot's URDF."
            if tree
            else "Install ROS 2's tf2_msgs (sudo apt install ros-jazzy-tf2-msgs), and source ROS 2."
        )
        if needed:
            yield Finding(Level.BROKEN, "transforms", f"{missing}, but the robot is localised by tf", fix)
        else:
            yield Finding(Level.WARNING, "transforms", f"{missing}: mounts are used as declared, unchecked", fix)
        for name in _frames(robot):
            if robot.names.frame(name) not in robot.mounts:
                mend = f"Measure it, and add under frames: {name}: {{xyz: [x, y, z], rpy_deg: [roll, pitch, yaw]}}"
                yield Finding(Level.BROKEN, f"frame {name}", "its mount is neither declared nor known from tf", mend)
        return
    if needed:
        yield _localised(robot, tree)
    for name in _frames(robot):
        yield _mount(robot, tree, name)


def mounted(robot: Ros2Robot, tree: TransformTree | None, name: str | None) -> Pose | None:
    """Return where the driver takes a frame to be in the base frame; None when it is not known."""
    if tree is not None and name is not None:
        with suppress(LookupError):
            return tree.lookup(robot.base_frame, name)
    return robot.mounts.get(name or "")


def _frames(robot: Ros2Robot) -> list[str]:
    """Return the frames, as they are declared, whose place on the robot must be known."""
    declared = {frame.removeprefix(robot.names.frame_prefix): None for frame in robot.mounts}
    camera = robot.camera_frame and robot.camera_frame.removeprefix(robot.names.frame_prefix)
    names = dict.fromkeys([*declared, *robot.reported, *([camera] if camera else [])])
    base = robot.base_frame.removeprefix(robot.names.frame_prefix)
    return [name for name in names if name not in (base, "initial_pose", "camera") or name == camera]


def _localised(robot: Ros2Robot, tree: TransformTree) -> Finding:
    try:
        tree.lookup(robot.global_frame, robot.base_frame)
    except LookupError as error:
        fix = "Start localisation (AMCL, SLAM), and give it the robot's initial pose."
        return Finding(Level.BROKEN, "transforms", _sentence(error), fix)
    return Finding(Level.OK, "transforms", f"{robot.base_frame} is known in {robot.global_frame}")


def _mount(robot: Ros2Robot, tree: TransformTree, name: str) -> Finding:
    frame = robot.names.frame(name)
    declared = robot.mounts.get(frame)
    try:
        measured = tree.lookup(robot.base_frame, frame)
        fixed = tree.newest_ns(robot.base_frame, frame) is None
    except TwoTreesError as error:
        fix = "Publish the transform between the two (robot_state_publisher, with the robot's whole URDF)."
        return Finding(Level.BROKEN, f"frame {name}", _sentence(error), fix)
    except LookupError as error:
        level = Level.BROKEN if declared is None else Level.WARNING
        fix = "Correct the frame's name in the declaration, or add the frame to the robot's URDF."
        return Finding(level, f"frame {name}", _sentence(error), fix)
    return message_checks.mount(name, declared, measured, fixed=fixed)


def _sentence(error: LookupError) -> str:
    # str() of a KeyError is the repr of its text.
    return str(error.args[0]) if error.args else str(error)
