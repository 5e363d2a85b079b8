"""Properties of a platform's beginning and end: members, the clean start, rigid poses, rest, close."""

import math

from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.platform import Platform
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, drive
from benchbot.plugins.authoring.conformance.properties import Wrong

MEMBERS = (
    "load", "observe", "drive", "contact_ahead", "pose", "odometry", "velocity", "collided", "clock", "halt", "close",
    "control_period_s",
)  # fmt: skip
START_TOLERANCE_M, START_TOLERANCE_RAD = 1e-3, 1e-3


def has_every_member(bench: Bench, platform: Platform) -> str:
    """Everything that the Protocol names is there."""
    # A property may need a loaded scene to be read; that it is there can be told from the class.
    missing = [name for name in MEMBERS if not hasattr(type(platform), name) and name not in vars(platform)]
    if missing:
        raise Wrong(
            f"{type(platform).__name__} lacks {', '.join(missing)}.", "See benchbot.core.platform.Platform for each."
        )
    return type(platform).__name__


def ticks_sensibly(bench: Bench, platform: Platform) -> str:
    """The control period is one that motion can be controlled with."""
    period_s = platform.control_period_s
    if not 1e-3 <= period_s <= 0.5:
        raise Wrong(f"control_period_s is {period_s!r}.", "Give seconds per control tick: 0.05 is 20 Hz.")
    return f"{period_s:g} s"


def starts_clean(bench: Bench, platform: Platform) -> str:
    """`load` puts the robot where the scene says, at rest and unharmed, clock at zero; also after it has moved."""
    for again in (False, True):
        platform.load(bench.scene, SEED)
        when = "after a second load" if again else "after load"
        _is_clean(bench, platform, when)
        drive(platform, 0.1, 0.3, 0.3)
    return "at the start pose, at rest, clock at zero, also when loaded again"


def _is_clean(bench: Bench, platform: Platform, when: str) -> None:
    tolerance_s = 5.0 if bench.real else 1e-9
    if not 0 <= platform.clock() <= tolerance_s:
        raise Wrong(f"clock() is {platform.clock():g} s {when}.", "Set the clock back to zero in load().")
    if platform.collided:
        raise Wrong(f"The robot is collided {when}.", "Forget contact in load(), or choose a start pose that is free.")
    if any(platform.velocity):
        raise Wrong(f"velocity is {platform.velocity} {when}.", "Put the robot at rest in load().")
    start = bench.scene.start_pose
    tolerance_m = bench.position_tolerance_m if bench.real else START_TOLERANCE_M
    tolerance_rad = bench.angle_tolerance_rad if bench.real else START_TOLERANCE_RAD
    for name, pose in (("pose()", platform.pose()), ("odometry()", platform.odometry())):
        away_m = math.dist(pose.translation_xyz[:2], start.translation_xyz[:2])
        if away_m > tolerance_m:
            raise Wrong(
                f"{name} is {away_m:.3g} m away from the scene's start pose {when}.", "Put it at scene.start_pose."
            )
        turned_rad = abs(wrap_angle_rad(pose.yaw_rad - start.yaw_rad))
        if turned_rad > tolerance_rad:
            raise Wrong(
                f"{name} is turned by {math.degrees(turned_rad):.3g} degrees from the scene's start pose {when}.",
                "A declaration's quaternion is w, x, y, z; Scene.start_pose reads it.",
            )


def poses_are_rigid(bench: Bench, platform: Platform) -> str:
    """`pose` and `odometry` are rigid transforms, at the start and on the way."""
    platform.load(bench.scene, SEED)
    for _ in range(2):
        for name, pose in (("pose()", platform.pose()), ("odometry()", platform.odometry())):
            _is_rigid(name, pose)
        drive(platform, 0.1, 0.3, 0.3)
    return "unit quaternions, finite positions"


def _is_rigid(name: str, pose: Pose) -> None:
    if not isinstance(pose, Pose):
        raise Wrong(f"{name} is a {type(pose).__name__}.", "Return a benchbot.core.geometry.Pose.")
    if not all(map(math.isfinite, (*pose.translation_xyz, *pose.rotation_xyzw))):
        raise Wrong(f"{name} is {pose}.", "Return finite numbers.")
    norm = math.hypot(*pose.rotation_xyzw)
    if abs(norm - 1) > 1e-6:
        raise Wrong(f"The quaternion of {name} has the norm {norm:g}.", "Return a unit quaternion, x, y, z, w.")


def rests_where_it_is(bench: Bench, platform: Platform) -> str:
    """A robot that is told to stand still does."""
    platform.load(bench.scene, SEED)
    moved = drive(platform, 0.0, 0.0, 0.5)
    if math.hypot(moved.ahead_m, moved.left_m) > bench.position_tolerance_m:
        raise Wrong(
            f"It moved by {math.hypot(moved.ahead_m, moved.left_m):.3g} m at drive(0, 0, …).", "Stand still at zero."
        )
    return "does not move at drive(0, 0, …)"


def halts_when_told(bench: Bench, platform: Platform) -> str:
    """`halt` is harmless to a simulator; a real robot does not drive after it."""
    from benchbot.core.errors import BenchbotError

    platform.load(bench.scene, SEED)
    platform.halt("The conformance kit asks for it.")
    if not bench.real:
        return "nothing to do"
    try:
        platform.drive(0.1, 0.0, platform.control_period_s)
    except BenchbotError as error:
        if not error.ends_run:
            raise Wrong("The error after halt() does not end the run.", "Raise it with ends_run=True.") from error
        return "refuses to drive"
    raise Wrong("It drives after halt().", "Stop the robot and raise a BenchbotError(ends_run=True) in drive().")


def closes_twice(bench: Bench, platform: Platform) -> str:
    """`close` may be called twice, and without a load."""
    for loaded in (False, True):
        another = bench.create(bench.spec)
        if loaded:
            another.load(bench.scene, SEED)
        another.close()
        another.close()
    return "twice, loaded or not"
