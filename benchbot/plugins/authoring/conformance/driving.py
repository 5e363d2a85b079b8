"""Properties of `drive`: directions, distances, limits, contact, and the actions on top of it."""

import math
from collections.abc import Mapping
from typing import Any, cast

from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Holonomic, Platform
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, Moved, drive, rest
from benchbot.plugins.authoring.conformance.properties import Violation, unchecked

SPEED_MPS, TURN_RADPS = 0.2, 0.4
HOLD_S, CONTACT_TIMEOUT_S = 1.0, 60.0
SIDEWAYS_M = 0.2
THROUGH_M = 0.5
"""Further than this beyond what the laser saw is through it."""


def drives_straight(bench: Bench, platform: Platform) -> str:
    """A linear velocity moves the base by its product with the duration: ahead if positive, back if negative."""
    sign = _free_direction(bench, platform)
    platform.load(bench.scene, SEED)
    moves = [
        (speed_mps, drive(platform, speed_mps, 0.0, HOLD_S)) for speed_mps in (sign * SPEED_MPS, -sign * SPEED_MPS)
    ]
    for speed_mps, moved in moves:
        seen = f"It moved by {moved.ahead_m:+.3g} m where {speed_mps * HOLD_S:+.3g} m were commanded."
        _require_share(moved.ahead_m / (speed_mps * HOLD_S), seen, "ahead, along +x of the base frame", "m/s")
        if abs(moved.left_m) > bench.position_tolerance_m or abs(moved.turned_rad) > bench.angle_tolerance_rad:
            raise Violation(
                f"It left the straight line by {moved.left_m:.3g} m and {math.degrees(moved.turned_rad):.3g} degrees.",
                "Drive straight at an angular velocity of zero.",
            )
    there_m, back_m = (moved.ahead_m for _, moved in moves)
    return f"{there_m:+.3f} m, then {back_m:+.3f} m, at {SPEED_MPS} m/s for {HOLD_S:g} s each"


def turns_left(bench: Bench, platform: Platform) -> str:
    """A positive angular velocity turns the base counter-clockwise, on the spot."""
    platform.load(bench.scene, SEED)
    moves = [(turn_radps, drive(platform, 0.0, turn_radps, HOLD_S)) for turn_radps in (TURN_RADPS, -TURN_RADPS)]
    for turn_radps, moved in moves:
        turned_deg, wanted_deg = math.degrees(moved.turned_rad), math.degrees(turn_radps * HOLD_S)
        seen = f"It turned by {turned_deg:+.3g} degrees where {wanted_deg:+.3g} were commanded."
        _require_share(turned_deg / wanted_deg, seen, "counter-clockwise about +z, in rad/s", "rad/s")
        if moved.distance_m > bench.position_tolerance_m:
            raise Violation("It left its place while it turned.", "Turn about the base frame's z axis.")
    left_deg, right_deg = (math.degrees(moved.turned_rad) for _, moved in moves)
    return f"{left_deg:+.1f}, then {right_deg:+.1f} degrees"


def keeps_time(bench: Bench, platform: Platform) -> str:
    """The clock advances by the duration of each `drive`, and never jumps back."""
    platform.load(bench.scene, SEED)
    last_s = platform.clock()
    for _ in range(5):
        platform.drive(0.0, 0.1, platform.control_period_s)
        passed_s, last_s = platform.clock() - last_s, platform.clock()
        if passed_s <= 0 or (not bench.real and abs(passed_s - platform.control_period_s) > 1e-6):
            raise Violation(
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
            raise Violation(
                f"It turns at {platform.velocity[1]:.3g} rad/s; its limit is {config.angular_limit_radps:g}.",
                "Enforce the limits of the robot's declaration in drive().",
            )
    rest(platform)
    platform.load(bench.scene, SEED)
    platform.drive(100.0, 0.0, platform.control_period_s)
    low, high = config.linear_limits_mps
    if not low * 1.01 <= platform.velocity[0] <= high * 1.01:
        raise Violation(
            f"It drives at {platform.velocity[0]:.3g} m/s; its limits are {low:g} to {high:g}.",
            "Enforce the limits of the robot's declaration in drive().",
        )
    return f"{low:g} to {high:g} m/s, {config.angular_limit_radps:g} rad/s"


def stops_at_contact(bench: Bench, platform: Platform) -> str:
    """The robot stops where it touches something, says so until the next `load`, and has predicted the contact."""
    platform.load(bench.scene, SEED)
    speed_mps = MotionConfig.from_robot(bench.spec.robot, "ground_truth").linear_limits_mps[1]
    period_s = platform.control_period_s
    foreseen = False
    start, seen_m = platform.pose(), _seen_ahead_m(bench, platform)
    while not platform.collided:
        if platform.clock() > CONTACT_TIMEOUT_S:
            driven_m = Moved.between(start, platform.pose()).ahead_m
            if driven_m > seen_m + THROUGH_M:
                raise Violation(
                    f"The robot drives through walls: it is {driven_m:.3g} m ahead, and its laser saw something "
                    f"{seen_m:.3g} m ahead.",
                    "Stop at contact with the scene's geometry, and say collided.",
                )
            raise unchecked(
                f"in {CONTACT_TIMEOUT_S:g} s straight ahead there was nothing to hit.", "Choose a scene with a wall."
            )
        foreseen = platform.contact_ahead(speed_mps, 0.0, period_s)
        platform.drive(speed_mps, 0.0, period_s)
    if not foreseen:
        raise Violation(
            "contact_ahead() was False right before the robot hit something.",
            "Say True where holding the command for horizon_s and then braking would touch something.",
        )
    into = drive(platform, speed_mps, 0.0, 1.0)
    if into.ahead_m > bench.position_tolerance_m:
        raise Violation(f"It went on by {into.ahead_m:.3g} m into what it had hit.", "Stop at contact.")
    if not platform.collided:
        raise Violation("It has forgotten that it hit something.", "Keep `collided` true until the next load().")
    platform.load(bench.scene, SEED)
    if platform.collided:
        raise Violation("It is still collided after load().", "Forget contact in load().")
    return "stopped, told, foreseen, and forgotten by load()"


def _seen_ahead_m(bench: Bench, platform: Platform) -> float:
    """Return how far the laser of a robot at the start sees straight ahead; inf where nothing is there, or no laser."""
    if "laser" not in bench.channels:
        return math.inf
    ranges_m, angles_rad = platform.observe(["laser"])["laser"]["scans"].T
    return float(ranges_m[abs(angles_rad).argmin()])


def reaches_goals(bench: Bench, platform: Platform) -> str:
    """The actions of solutions, which are sequences of `drive`, reach their goals."""
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
            raise Violation(
                f"{action} of {next(iter(arguments.values())):g} ended with '{outcome}'.",
                "Follow commands closely; declare `limits` with accelerations that the robot really has.",
            )
    return f"{len(offered)} actions reached their goal"


def drives_sideways(bench: Bench, platform: Platform) -> str:
    """The action move_sideways leads to the left where positive, to the right where negative, without a turn."""
    if "move_sideways" not in bench.spec.robot["connections"]:
        return "not offered"
    config = MotionConfig.from_robot(bench.spec.robot, "ground_truth")
    if not hasattr(platform, "contact_beside"):
        raise Violation(
            "It has no drive_sideways() and contact_beside().",
            "Implement benchbot.plugin.Holonomic, or remove move_sideways from the robot's connections.",
        )
    holonomic, free = cast(Holonomic, platform), []
    for wanted_m in (SIDEWAYS_M, -SIDEWAYS_M):
        platform.load(bench.scene, SEED)
        if holonomic.contact_beside(math.copysign(SPEED_MPS, wanted_m), 0.0, HOLD_S + 0.5):
            continue
        before = platform.pose()
        execute(platform, "move_sideways", {"distance": wanted_m}, None, config)
        moved = Moved.between(before, platform.pose())
        seen = f"It moved by {moved.left_m:+.3g} m to its left where {wanted_m:+.3g} m were commanded."
        _require_share(moved.left_m / wanted_m, seen, "to the left, along +y of the base frame", "m/s")
        if abs(moved.ahead_m) > bench.position_tolerance_m or abs(moved.turned_rad) > bench.angle_tolerance_rad:
            raise Violation(
                f"It went {moved.ahead_m:+.3g} m ahead and turned by {math.degrees(moved.turned_rad):+.3g} degrees.",
                "Drive along +y of the base frame alone in drive_sideways().",
            )
        free.append(moved.left_m)
    if not free:
        raise unchecked("there is no room beside the start pose.", "Choose a scene with 0.3 m of room on one side.")
    return ", ".join(f"{left_m:+.3f} m" for left_m in free)


def _free_direction(bench: Bench, platform: Platform) -> float:
    platform.load(bench.scene, SEED)
    for sign in (1.0, -1.0):
        if not platform.contact_ahead(sign * SPEED_MPS, 0.0, HOLD_S + 0.5):
            return sign
    raise unchecked("there is no room to drive at the start pose.", "Choose a scene with 0.5 m of room.")


def _require_share(share: float, seen: str, positive: str, unit: str) -> None:
    """Raise `Violation` unless the share of the commanded motion that was driven is positive and near 1."""
    if share <= 0:
        raise Violation(seen, f"Positive is {positive} (REP-103).")
    if not 0.5 <= share <= 1.2:
        raise Violation(seen, f"Take the command in {unit} and hold it for duration_s, within the robot's limits.")
