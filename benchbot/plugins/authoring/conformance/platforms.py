"""The conformance of platforms: simulators, and drivers of real robots."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot.core.platform import Localisation, Platform
from benchbot.core.records import RobotDriver, Simulator
from benchbot.plugins.authoring.conformance import driving, sensing
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, Declared, Moved, drive, find_record, make_bench
from benchbot.plugins.authoring.conformance.comparing import check_comparability
from benchbot.plugins.authoring.conformance.properties import (
    Violation,
    check_properties,
    leaves_nothing_open,
    obtain,
    told_once,
)
from benchbot.plugins.authoring.conformance.types import has_the_right_types

START_TOLERANCE_M, START_TOLERANCE_RAD = 1e-3, 1e-3

Property = Callable[[Bench, Platform], str]


def check_simulator(
    simulator: Simulator | str,
    robot: Declared,
    environment: Declared,
    *,
    localisation: Localisation = "ground_truth",
    cache_dir: Path | None = None,
) -> list[Finding]:
    """Return findings on whether a simulator conforms to `benchbot.core.platform`, with one robot in one environment.

    Each is given by its name or its declaration. The robot needs half a metre of room ahead of its start or behind
    it, and something to hit within a minute straight ahead. `cache_dir` may hold compiled kernels.
    """
    create = find_record("simulators", simulator).create
    bench = make_bench(create, robot, environment, localisation, cache_dir)
    return _check(bench, ALWAYS | SIMULATED, None if localisation == "noisy" else environment)


def check_robot_driver(
    driver: RobotDriver | str,
    robot: Declared,
    environment: Declared,
    *,
    position_tolerance_m: float = 0.05,
    angle_tolerance_rad: float = 0.1,
    cache_dir: Path | None = None,
) -> list[Finding]:
    """Return findings on whether a driver conforms to `benchbot.core.platform`. THE ROBOT MOVES.

    It moves by 0.2 m ahead or back and by 30 degrees; nothing is hit on purpose. It has to stand at the environment's
    start pose; requests to the operator are printed. Tolerances are those of the localisation.
    """
    bench = make_bench(
        find_record("robot_drivers", driver).create,
        robot,
        environment,
        "ground_truth",
        cache_dir,
        real=True,
        position_tolerance_m=position_tolerance_m,
        angle_tolerance_rad=angle_tolerance_rad,
    )
    return _check(bench, ALWAYS)


def _check(bench: Bench, properties: Mapping[str, Property], comparable: Declared | None = None) -> list[Finding]:
    """Return the findings; also on comparability where an environment is given to compare in."""
    finding, created = obtain("create", lambda: bench.create(bench.spec), lambda _: str(bench.spec.robot["name"]))
    findings = [finding]
    for platform in created:
        try:
            findings += check_properties({"members": _has_every_member}, bench, platform)
            if findings[-1].level is Level.OK:
                findings += check_properties({"types": has_the_right_types}, bench, platform)
            # All else would only say again, property by property, what has the wrong type.
            if findings[-1].level is Level.OK:
                findings += check_properties(properties, bench, platform)
                findings += sensing.check_channels(bench, platform)
                if comparable is not None:
                    findings += check_comparability(bench, platform, comparable, findings)
                findings += check_properties(LAST, bench, platform)
        finally:
            findings += check_properties({"close at the end": _closes}, platform)
    return told_once(findings)


def _has_every_member(bench: Bench, platform: Platform) -> str:
    """The platform has every member of the Protocol."""
    members = [name for name in vars(Platform) if not name.startswith("_")]
    # Reading a property may need a loaded scene; looking it up in the class does not.
    missing = [name for name in members if not hasattr(type(platform), name) and name not in vars(platform)]
    if missing:
        raise Violation(
            f"{type(platform).__name__} lacks {', '.join(missing)}.", "See benchbot.core.platform.Platform for each."
        )
    return type(platform).__name__


def _has_a_sensible_control_period(bench: Bench, platform: Platform) -> str:
    """The control period is one that motion can be controlled with."""
    period_s = platform.control_period_s
    if not 1e-3 <= period_s <= 0.5:
        raise Violation(f"control_period_s is {period_s!r}.", "Give seconds per control tick: 0.05 is 20 Hz.")
    return f"{period_s:g} s"


def _starts_clean(bench: Bench, platform: Platform) -> str:
    """`load` puts the robot where the scene says, at rest and unharmed, clock at zero; also after it has moved."""
    for again in (False, True):
        platform.load(bench.scene, SEED)
        when = "after a second load" if again else "after load"
        _require_clean_start(bench, platform, when)
        drive(platform, 0.1, 0.3, 0.3)
    return "at the start pose, at rest, clock at zero, also when loaded again"


def _require_clean_start(bench: Bench, platform: Platform, when: str) -> None:
    tolerance_s = 5.0 if bench.real else 1e-9
    if not 0 <= platform.clock() <= tolerance_s:
        raise Violation(f"clock() is {platform.clock():g} s {when}.", "Set the clock back to zero in load().")
    if platform.collided:
        raise Violation(
            f"The robot is collided {when}.", "Forget contact in load(), or choose a start pose that is free."
        )
    if any(platform.velocity):
        raise Violation(f"velocity is {platform.velocity} {when}.", "Put the robot at rest in load().")
    tolerance_m = bench.position_tolerance_m if bench.real else START_TOLERANCE_M
    tolerance_rad = bench.angle_tolerance_rad if bench.real else START_TOLERANCE_RAD
    for name, pose in (("pose()", platform.pose()), ("odometry()", platform.odometry())):
        off = Moved.between(bench.scene.start_pose, pose)
        if off.distance_m > tolerance_m:
            away = f"{name} is {off.distance_m:.3g} m away from the scene's start pose {when}."
            raise Violation(away, "Put it at scene.start_pose.")
        if abs(off.turned_rad) > tolerance_rad:
            turned_deg = math.degrees(abs(off.turned_rad))
            raise Violation(
                f"{name} is turned by {turned_deg:.3g} degrees from the scene's start pose {when}.",
                "A declaration's quaternion is w, x, y, z; Scene.start_pose reads it.",
            )


def _has_rigid_poses(bench: Bench, platform: Platform) -> str:
    """`pose` and `odometry` are rigid transforms, at the start and after moving."""
    platform.load(bench.scene, SEED)
    for _ in range(2):
        for name, pose in (("pose()", platform.pose()), ("odometry()", platform.odometry())):
            _require_rigid(name, pose)
        drive(platform, 0.1, 0.3, 0.3)
    return "unit quaternions, finite positions"


def _require_rigid(name: str, pose: Pose) -> None:
    if not isinstance(pose, Pose):
        raise Violation(f"{name} is a {type(pose).__name__}.", "Return a benchbot.core.geometry.Pose.")
    if not all(map(math.isfinite, (*pose.translation_xyz, *pose.rotation_xyzw))):
        raise Violation(f"{name} is {pose}.", "Return finite numbers.")
    norm = math.hypot(*pose.rotation_xyzw)
    if abs(norm - 1) > 1e-6:
        raise Violation(f"The quaternion of {name} has the norm {norm:g}.", "Return a unit quaternion, x, y, z, w.")


def _rests(bench: Bench, platform: Platform) -> str:
    """A robot that is commanded to stand still does so."""
    platform.load(bench.scene, SEED)
    moved = drive(platform, 0.0, 0.0, 0.5)
    if moved.distance_m > bench.position_tolerance_m:
        raise Violation(f"It moved by {moved.distance_m:.3g} m at drive(0, 0, …).", "Stand still at zero.")
    return "does not move at drive(0, 0, …)"


def _halts(bench: Bench, platform: Platform) -> str:
    """`halt` is harmless to a simulator; a real robot does not drive after it."""
    platform.load(bench.scene, SEED)
    platform.halt("The conformance kit asks for it.")
    if not bench.real:
        return "nothing to do"
    try:
        platform.drive(0.1, 0.0, platform.control_period_s)
    except BenchbotError as error:
        if not error.ends_run:
            raise Violation("The error after halt() does not end the run.", "Raise it with ends_run=True.") from error
        return "refuses to drive"
    raise Violation("It drives after halt().", "Stop the robot and raise a BenchbotError(ends_run=True) in drive().")


def _closes_twice(bench: Bench, platform: Platform) -> str:
    """`close` may be called twice, and without a load."""
    for loaded in (False, True):
        another = bench.create(bench.spec)
        if loaded:
            another.load(bench.scene, SEED)
        another.close()
        another.close()
    return "twice, loaded or not"


def _leaves_nothing_open(bench: Bench, platform: Platform) -> str:
    """Fresh platforms that are used and closed leave nothing open."""

    def use() -> None:
        with bench.fresh() as fresh:
            fresh.load(bench.scene, SEED)
            fresh.observe(bench.channels)
            fresh.drive(0.0, 0.0, fresh.control_period_s)

    return leaves_nothing_open(use)


def _closes(platform: Platform) -> str:
    platform.close()
    return "closed"


ALWAYS: dict[str, Property] = {
    "control period": _has_a_sensible_control_period,
    "clean start": _starts_clean,
    "rigid poses": _has_rigid_poses,
    "rest": _rests,
    "observe: what was asked": sensing.returns_what_is_asked,
    "observe: one instant": sensing.observes_one_instant,
    "observe: frames": sensing.has_its_frames,
    "observe: left alone": sensing.leaves_observations_alone,
    "drive: straight": driving.drives_straight,
    "drive: turns": driving.turns_left,
    "drive: time": driving.keeps_time,
    "drive: limits": driving.keeps_its_limits,
    "drive: actions": driving.reaches_goals,
    "drive: sideways": driving.drives_sideways,
}
SIMULATED: dict[str, Property] = {
    "drive: contact": driving.stops_at_contact,
    "seeds: repeated": sensing.repeats_itself,
    "seeds: another": sensing.changes_only_noise_with_the_seed,
    "many cameras": sensing.observes_together_as_alone,
}
LAST: dict[str, Property] = {"nothing left": _leaves_nothing_open, "close": _closes_twice, "halt": _halts}
