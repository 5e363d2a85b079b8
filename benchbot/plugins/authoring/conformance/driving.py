"""Properties of `drive`: directions, distances, limits, contact, and the three actions on top of it."""

import math
from collections.abc import Mapping
from typing import Any

from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Platform
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, Moved, drive, rest
from benchbot.plugins.authoring.conformance.properties import Wrong, unchecked

SPEED_MPS, TURN_RADPS = 0.2, 0.4
HOLD_S, MOST_S = 1.0, 60.0


def drives_straight(bench: Bench, platform: Platform) -> str:
    """A linear velocity moves the base along its x axis: positive ahead, negative back, as far as it says."""
    sign = _free_direction(bench, platform)
    platform.load(bench.scene, SEED)
    there = drive(platform, sign * SPEED_MPS, 0.0, HOLD_S)
    back = drive(platform, -sign * SPEED_MPS, 0.0, HOLD_S)
    for moved, direction in ((there, sign), (back, -sign)):
        _went(bench, moved, direction * SPEED_MPS * HOLD_S)
    return f"{there.ahead_m:+.3f} m, then {back.ahead_m:+.3f} m, at {SPEED_MPS} m/s for {HOLD_S:g} s each"


def turns_left(bench: Bench, platform: Platform) -> str:
    """A positive angular velocity turns the base counter-clockwise, on the spot."""
    platform.load(bench.scene, SEED)
    left = drive(platform, 0.0, TURN_RADPS, HOLD_S)
    right = drive(platform, 0.0, -TURN_RADPS, HOLD_S)
    for moved, wanted_rad in ((left, TURN_RADPS * HOLD_S), (right, -TURN_RADPS * HOLD_S)):
        turned = f"It turned by {math.degrees(moved.turned_rad):+.3g} degrees where "
        turned += f"{math.degrees(wanted_rad):+.3g} were commanded."
        if moved.turned_rad * wanted_rad <= 0:
            raise Wrong(turned, "Positive is counter-clockwise about +z, in rad/s (REP-103).")
        if not 0.5 <= moved.turned_rad / wanted_rad <= 1.2:
            raise Wrong(turned, "Take the command in rad/s and hold it for duration_s, within the robot's limits.")
        if math.hypot(moved.ahead_m, moved.left_m) > bench.position_tolerance_m:
            raise Wrong("It left its place while it turned.", "Turn about the base frame's z axis.")
    return f"{math.degrees(left.turned_rad):+.1f}, then {math.degrees(right.turned_rad):+.1f} degrees"


def keeps_time(bench: Bench, platform: Platform) -> str:
    """The clock advances by what `drive` was told, and never jumps back."""
    platform.load(bench.scene, SEED)
    last_s = platform.clock()
    for _ in range(5):
        platform.drive(0.0, 0.1, platform.control_period_s)
        passed_s, last_s = platform.clock() - last_s, platform.clock()
        if passed_s <= 0 or (not bench.real and abs(passed_s - platform.control_period_s) > 1e-6):
            raise Wrong(
                f"The clock went on by {passed_s:g} s in a drive() of {platform.control_period_s:g} s.",
                "Count the seconds since load(): simulated ones in a simulator, in real time on a robot.",
            )
    return "as long as it drives"


def keeps_its_limits(bench: Bench, platform: Platform) -> str:
    """A command beyond the robot's limits is cut to them."""
    config = MotionConfig.from_robot(bench.spec.robot, "ground_truth")
    platform.load(bench.scene, SEED)
    for _ in range(5):
        platform.drive(0.0, 100.0, platform.control_period_s)
        if abs(platform.velocity[1]) > config.angular_limit_radps * 1.01:
            raise Wrong(
                f"It turns at {platform.velocity[1]:.3g} rad/s; its limit is {config.angular_limit_radps:g}.",
                "Enforce the limits of the robot's declaration in drive().",
            )
    rest(platform)
    platform.load(bench.scene, SEED)
    platform.drive(100.0, 0.0, platform.control_period_s)
    low, high = config.linear_limits_mps
    if not low * 1.01 <= platform.velocity[0] <= high * 1.01:
        raise Wrong(
            f"It drives at {platform.velocity[0]:.3g} m/s; its limits are {low:g} to {high:g}.",
            "Enforce the limits of the robot's declaration in drive().",
        )
    return f"{low:g} to {high:g} m/s, {config.angular_limit_radps:g} rad/s"


def stops_at_contact(bench: Bench, platform: Platform) -> str:
    """The robot stops where it touches something, says so until the next `load`, and has seen it coming."""
    platform.load(bench.scene, SEED)
    speed_mps = MotionConfig.from_robot(bench.spec.robot, "ground_truth").linear_limits_mps[1]
    period_s = platform.control_period_s
    foreseen = False
    while not platform.collided:
        if platform.clock() > MOST_S:
            raise unchecked(f"in {MOST_S:g} s straight ahead there was nothing to hit.", "Choose a scene with a wall.")
        foreseen = platform.contact_ahead(speed_mps, 0.0, period_s)
        platform.drive(speed_mps, 0.0, period_s)
    if not foreseen:
        raise Wrong(
            "contact_ahead() was False right before the robot hit something.",
            "Say True where holding the command for horizon_s and then braking would touch something.",
        )
    into = drive(platform, speed_mps, 0.0, 1.0)
    if into.ahead_m > bench.position_tolerance_m:
        raise Wrong(f"It went on by {into.ahead_m:.3g} m into what it had hit.", "Stop at contact.")
    if not platform.collided:
        raise Wrong("It has forgotten that it hit something.", "Keep `collided` true until the next load().")
    platform.load(bench.scene, SEED)
    if platform.collided:
        raise Wrong("It is still collided after load().", "Forget contact in load().")
    return "stopped, told, foreseen, and forgotten by load()"


def reaches_goals(bench: Bench, platform: Platform) -> str:
    """The actions that solutions take come to their end, on top of `drive`."""
    sign = _free_direction(bench, platform)
    config = MotionConfig.from_robot(bench.spec.robot, "ground_truth")
    tasks: tuple[tuple[str, Mapping[str, Any]], ...] = (
        ("move_angle", {"angle": 30.0}),
        ("move_angle", {"angle": -30.0}),
        ("move_distance", {"distance": sign * 0.2}),
    )
    offered = [task for task in tasks if task[0] in bench.spec.robot["connections"]]
    platform.load(bench.scene, SEED)
    for action, arguments in offered:
        outcome = execute(platform, action, arguments, None, config)
        if outcome is not Outcome.REACHED:
            raise Wrong(
                f"{action} of {next(iter(arguments.values())):g} ended with '{outcome}'.",
                "Follow commands closely; declare `limits` with accelerations that the robot really has.",
            )
    return f"{len(offered)} actions reached their goal"


def _free_direction(bench: Bench, platform: Platform) -> float:
    platform.load(bench.scene, SEED)
    for sign in (1.0, -1.0):
        if not platform.contact_ahead(sign * SPEED_MPS, 0.0, HOLD_S + 0.5):
            return sign
    raise unchecked("there is no room to drive at the start pose.", "Choose a scene with 0.5 m of room.")


def _went(bench: Bench, moved: Moved, wanted_m: float) -> None:
    told = f"It moved by {moved.ahead_m:+.3g} m where {wanted_m:+.3g} m were commanded."
    if moved.ahead_m * wanted_m <= 0:
        raise Wrong(told, "Positive is ahead, along +x of the base frame (REP-103).")
    if not 0.5 <= moved.ahead_m / wanted_m <= 1.2:
        raise Wrong(told, "Take the command in m/s and hold it for duration_s, within the robot's limits.")
    if abs(moved.left_m) > bench.position_tolerance_m or abs(moved.turned_rad) > bench.angle_tolerance_rad:
        raise Wrong(
            f"It left the straight line by {moved.left_m:.3g} m and {math.degrees(moved.turned_rad):.3g} degrees.",
            "Drive straight at an angular velocity of zero.",
        )
