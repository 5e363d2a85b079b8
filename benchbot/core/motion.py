"""Motion: the actions of the base, written once on top of the platform, so that simulated and real robots behave alike.

Every action is a sequence of phases. A phase reads the believed pose once per control tick, returns the distance to its
goal and a command that reduces it, and ends with the robot at rest.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple, Protocol, Self, cast

from benchbot.core.channels import MANIPULATION
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.platform import Holonomic, Localisation, Manipulator, Platform

# The pose controller of Siegwart, Nourbakhsh, Scaramuzza, "Introduction to Autonomous Mobile Robots" (2nd ed., §3.6.2),
# also Corke, "Robotics, Vision and Control" (§4.1.4), with the gains of BenchBot v2. Stable, by its condition, where
# k_alpha + 5/3 k_beta - 2/pi k_rho > 0 (here 2.06).
K_RHO, K_ALPHA, K_BETA = 2.0, 10.0, -4.0
# A goal behind the robot is approached in reverse; a bit more than a right angle, as in v2, prefers driving forwards.
REVERSE_BEYOND_RAD = 1.05 * math.pi / 2
# So near, a bearing changes faster than a robot turns, and a curve would swing. A robot that starts there, or comes
# there and heads past its goal by more than a curve from afar leaves, turns on the spot and drives straight.
NEAR_M, ASTRAY_RAD = 0.1, math.radians(30.0)
# It turns until a straight way misses the goal by the first share of the tolerance, and again beyond the second.
AIMED_SHARE, MISSING_SHARE = 0.1, 0.75
# Per metre driven and per square metre: critically damped return to a straight line.
K_HEADING, K_LATERAL = 4.0, 4.0
# How much of the declared acceleration is planned with; the rest is a reserve for following the plan.
PLANNED_SHARE = 0.8
# A phase does not stop at the rim of its tolerance but goes on while it gets closer, down to this share of it.
FINE_SHARE = 0.05
REST_MPS, REST_RADPS, REST_TIMEOUT_S = 1e-3, 1e-3, 5.0


class Outcome(StrEnum):
    """The end of an action."""

    REACHED = "reached"
    BLOCKED = "blocked"
    COLLIDED = "collided"
    TIMEOUT = "timeout"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True)
class MotionConfig:
    """Tolerances, limits and time-outs of motion; the defaults are v2's (reference controller constants).

    The accelerations are those that braking is planned with; keep them at or below what the platform can do.
    """

    localisation: Localisation = "ground_truth"
    stops_before_contact: bool = False
    speed_factor: float = 1.0
    linear_limits_mps: tuple[float, float] = (-0.6, 1.5)
    angular_limit_radps: float = 1.0
    linear_acceleration_mps2: float = 1.0
    angular_acceleration_radps2: float = 2.0
    position_tolerance_m: float = 0.01
    angle_tolerance_rad: float = math.radians(1.0)
    phase_timeout_s: float = 30.0
    lateral_limit_mps: float = 0.0

    @classmethod
    def from_robot(cls, robot: Mapping[str, Any], localisation: Localisation) -> Self:
        """Return the configuration that a robot declaration asks for.

        Reads `stops_before_contact`, `speed_factor`, `limits` {linear_mps: [backwards, forwards], angular_radps,
        linear_acceleration_mps2, angular_acceleration_radps2, lateral_mps of a holonomic base} and `tolerances`
        {position_m, angle_deg}; raises BenchbotError when one of them makes no sense.
        """
        limits, tolerances = robot.get("limits", {}), robot.get("tolerances", {})
        backwards, forwards = _range(limits.get("linear_mps", cls.linear_limits_mps))
        return cls(
            localisation=localisation,
            stops_before_contact=bool(robot.get("stops_before_contact", False)),
            speed_factor=float(robot.get("speed_factor", 1.0)),
            linear_limits_mps=(backwards, forwards),
            angular_limit_radps=_positive(limits, "angular_radps", cls.angular_limit_radps),
            linear_acceleration_mps2=_positive(limits, "linear_acceleration_mps2", cls.linear_acceleration_mps2),
            angular_acceleration_radps2=_positive(
                limits, "angular_acceleration_radps2", cls.angular_acceleration_radps2
            ),
            position_tolerance_m=_positive(tolerances, "position_m", cls.position_tolerance_m, "tolerances"),
            angle_tolerance_rad=math.radians(
                _positive(tolerances, "angle_deg", math.degrees(cls.angle_tolerance_rad), "tolerances")
            ),
            lateral_limit_mps=_positive(limits, "lateral_mps", 0.5) if "lateral_mps" in limits else 0.0,
        )


class Navigator(Platform, Protocol):
    """A platform that may have a way of its own to go to a pose, such as the navigation of a robot."""

    def navigate(self, goal: Pose) -> Iterator[Outcome | None]:
        """Go to a pose: yield None after every control tick and, at rest, the outcome; nothing where `drive` steers."""


def execute(
    platform: Platform, action: str, arguments: Mapping[str, Any], goal: Pose | None, config: MotionConfig
) -> Outcome:
    """Execute one action of `benchbot.core.channels.ACTIONS` to its end; the robot is at rest afterwards.

    `arguments` are `distance` (m, negative is backwards, or to the right) for move_distance and move_sideways, and
    `angle` (degrees, CCW, any number of turns) for move_angle; `goal` is the pose in the map frame for move_next. The
    robot's place is `platform.pose()`, or `platform.odometry()` when localisation is noisy. REACHED means within
    `position_tolerance_m` and `angle_tolerance_rad` of the goal by that pose. Where the platform is a `Navigator`, it
    is steered for what its navigation leaves of the way. Actions of an arm are those of the platform, a `Manipulator`:
    UNREACHABLE means that nothing has moved, since no positions of the joints within their limits lead there.
    """
    if action in MANIPULATION:
        *_, ended = cast(Manipulator, platform).manipulate(action, arguments)
        return Outcome.REACHED if ended is None else Outcome(ended)
    if action == "move_next" and goal is not None and hasattr(platform, "navigate"):
        for ended in cast(Navigator, platform).navigate(goal):
            if ended not in (None, Outcome.REACHED):
                return cast(Outcome, ended)
    for phase in _phases(platform, action, arguments, goal, config):
        outcome = _run(platform, phase, config)
        if outcome is not Outcome.REACHED:
            return outcome
    return Outcome.REACHED


class Steering(NamedTuple):
    """A phase's current error in units of its tolerance, and the command that makes it smaller.

    The velocity is along +x of the base, or along +y where the phase is `sideways`.
    """

    error: float
    speed_mps: float
    angular_radps: float
    sideways: bool = False

    def drive(self, platform: Platform, duration_s: float) -> None:
        """Apply the command for one control tick."""
        if self.sideways:
            cast(Holonomic, platform).drive_sideways(self.speed_mps, self.angular_radps, duration_s)
        else:
            platform.drive(self.speed_mps, self.angular_radps, duration_s)

    def meets_contact(self, platform: Platform, horizon_s: float) -> bool:
        """Return whether the command, held and braked from, would touch something."""
        if self.sideways:
            return cast(Holonomic, platform).contact_beside(self.speed_mps, self.angular_radps, horizon_s)
        return platform.contact_ahead(self.speed_mps, self.angular_radps, horizon_s)


Phase = Callable[[Pose], Steering]


def _phases(
    platform: Platform, action: str, arguments: Mapping[str, Any], goal: Pose | None, config: MotionConfig
) -> Iterator[Phase]:
    period_s = platform.control_period_s
    start = _believed_pose(platform, config)
    if action == "move_distance":
        yield _straight(start, float(arguments.get("distance", 0.0)), config, period_s)
        yield _turn_to(start, _believed_pose(platform, config), config, period_s)
    elif action == "move_sideways":
        _require_holonomic(platform, config)
        yield _sideways(start, float(arguments.get("distance", 0.0)), config, period_s)
        yield _turn_to(start, _believed_pose(platform, config), config, period_s)
    elif action == "move_angle":
        yield _turn(start, math.radians(float(arguments.get("angle", 0.0))), config, period_s)
    elif action == "move_next" and goal is not None:
        if math.dist(start.translation_xyz[:2], goal.translation_xyz[:2]) > config.position_tolerance_m:
            yield _approach(start, goal, config, period_s)
        yield _turn_to(goal, _believed_pose(platform, config), config, period_s)
    else:
        raise ValueError(f"no such motion: {action!r} with goal {goal}")


def _run(platform: Platform, phase: Phase, config: MotionConfig) -> Outcome:
    deadline_s = platform.clock() + config.phase_timeout_s
    while True:
        outcome = _pursue(platform, phase, config, deadline_s)
        _come_to_rest(platform)
        if platform.collided:
            return Outcome.COLLIDED
        # Where the robot brakes worse than planned, it may have left the goal again.
        if outcome is not Outcome.REACHED or phase(_believed_pose(platform, config)).error <= 1.0:
            return outcome


def _pursue(platform: Platform, phase: Phase, config: MotionConfig, deadline_s: float) -> Outcome:
    """Steer as the phase says, for as long as that helps; the robot may still move afterwards."""
    period_s = platform.control_period_s
    last_error = math.inf
    while not platform.collided:
        steering = phase(_believed_pose(platform, config))
        if steering.error <= FINE_SHARE or last_error <= steering.error <= 1.0:
            return Outcome.REACHED
        last_error = steering.error
        if platform.clock() >= deadline_s:
            return Outcome.TIMEOUT
        if config.stops_before_contact and steering.meets_contact(platform, period_s):
            return Outcome.BLOCKED
        steering.drive(platform, period_s)
    return Outcome.COLLIDED


def _come_to_rest(platform: Platform) -> None:
    started_s = platform.clock()
    while platform.clock() - started_s < REST_TIMEOUT_S:
        linear_mps, angular_radps = platform.velocity
        lateral_mps: float = getattr(platform, "lateral_mps", 0.0)
        if max(abs(linear_mps), abs(lateral_mps)) < REST_MPS and abs(angular_radps) < REST_RADPS:
            return
        platform.drive(0.0, 0.0, platform.control_period_s)


def _straight(start: Pose, distance_m: float, config: MotionConfig, period_s: float) -> Phase:
    """Drive along the x axis of `start`, steering back to it where the believed pose has left it."""
    to_start = start.inverse()

    def steer(pose: Pose) -> Steering:
        on_line = to_start @ pose
        along_m, lateral_m, _ = on_line.translation_xyz
        remaining_m = distance_m - along_m
        linear_mps = _linear(remaining_m, config, period_s)
        angular_radps = -K_HEADING * abs(linear_mps) * on_line.yaw_rad - K_LATERAL * linear_mps * lateral_m
        limit = config.angular_limit_radps * config.speed_factor
        return Steering(
            abs(remaining_m) / config.position_tolerance_m,
            linear_mps,
            max(-limit, min(limit, angular_radps)),
        )

    return steer


def _sideways(start: Pose, distance_m: float, config: MotionConfig, period_s: float) -> Phase:
    """Drive along the y axis of `start`, and keep its heading."""
    to_start = start.inverse()
    limit_mps = config.lateral_limit_mps * config.speed_factor

    def steer(pose: Pose) -> Steering:
        from_start = to_start @ pose
        remaining_m = distance_m - from_start.translation_xyz[1]
        speed_mps = _braking_speed(abs(remaining_m), config.linear_acceleration_mps2, period_s)
        return Steering(
            abs(remaining_m) / config.position_tolerance_m,
            math.copysign(min(speed_mps, limit_mps), remaining_m),
            _angular(-from_start.yaw_rad, config, period_s),
            sideways=True,
        )

    return steer


def _require_holonomic(platform: Platform, config: MotionConfig) -> None:
    if config.lateral_limit_mps and hasattr(platform, "contact_beside"):
        return
    raise BenchbotError(
        "The robot cannot drive sideways.",
        "Its simulator or driver moves a base that drives ahead and turns only."
        if config.lateral_limit_mps
        else "Its declaration connects move_sideways, and its limits have no lateral_mps.",
        "Remove move_sideways from the robot's connections, or declare a holonomic base of a type that drives it, such "
        "as sim_taichi or ros2, with limits: {lateral_mps: 0.5}.",
        failure=FailureClass.PLATFORM,
    )


def _turn(start: Pose, angle_rad: float, config: MotionConfig, period_s: float) -> Phase:
    """Turn on the spot by an angle, which may be more than a full turn."""
    turned_rad, last_yaw_rad = 0.0, start.yaw_rad

    def steer(pose: Pose) -> Steering:
        nonlocal turned_rad, last_yaw_rad
        turned_rad += wrap_angle_rad(pose.yaw_rad - last_yaw_rad)
        last_yaw_rad = pose.yaw_rad
        remaining_rad = angle_rad - turned_rad
        return Steering(abs(remaining_rad) / config.angle_tolerance_rad, 0.0, _angular(remaining_rad, config, period_s))

    return steer


def _turn_to(goal: Pose, start: Pose, config: MotionConfig, period_s: float) -> Phase:
    """Turn on the spot, the short way, to the heading of `goal`."""
    return _turn(start, wrap_angle_rad(goal.yaw_rad - start.yaw_rad), config, period_s)


def _approach(start: Pose, goal: Pose, config: MotionConfig, period_s: float) -> Phase:
    """Drive to a pose on a curve, forwards or in reverse; what is left of the heading is for another phase."""
    x, y, _ = (start.inverse() @ goal).translation_xyz
    reverse_rad = math.pi if abs(math.atan2(y, x)) > REVERSE_BEYOND_RAD else 0.0
    settle = _settle(reverse_rad, config, period_s)
    is_settling = math.hypot(x, y) <= NEAR_M

    def steer(pose: Pose) -> Steering:
        nonlocal is_settling
        x, y, _ = (pose.inverse() @ goal).translation_xyz
        rho_m = math.hypot(x, y)
        bearing_rad = math.atan2(y, x) + reverse_rad
        alpha_rad = wrap_angle_rad(bearing_rad)
        if config.position_tolerance_m < rho_m <= NEAR_M and abs(alpha_rad) > ASTRAY_RAD:
            is_settling = True
        if is_settling:
            return settle(x, y)
        beta_rad = wrap_angle_rad(goal.yaw_rad - pose.yaw_rad - bearing_rad)
        angular_radps = K_ALPHA * alpha_rad + K_BETA * beta_rad
        # Both speeds are scaled alike, so that every limit keeps the curvature that the controller asks for.
        linear_mps = K_RHO * rho_m * (-1.0 if reverse_rad else 1.0)
        wanted_mps = _linear(math.copysign(rho_m, linear_mps), config, period_s)
        limit_radps = config.angular_limit_radps * config.speed_factor
        scale = min(
            wanted_mps / linear_mps if linear_mps else 0.0,
            limit_radps / abs(angular_radps) if angular_radps else math.inf,
        )
        return Steering(rho_m / config.position_tolerance_m, scale * linear_mps, scale * angular_radps)

    return steer


def _settle(reverse_rad: float, config: MotionConfig, period_s: float) -> Callable[[float, float], Steering]:
    """Turn to a near goal at (x, y) in the base frame, or, at `reverse_rad` of pi, away from it, and drive straight."""
    is_turning = True

    def steer(x: float, y: float) -> Steering:
        nonlocal is_turning, reverse_rad
        error = math.hypot(x, y) / config.position_tolerance_m
        is_turning = abs(y) > config.position_tolerance_m * (AIMED_SHARE if is_turning else MISSING_SHARE)
        if not is_turning:
            return Steering(error, _linear(x, config, period_s), 0.0)
        alpha_rad = wrap_angle_rad(math.atan2(y, x) + reverse_rad)
        if abs(alpha_rad) > math.pi - ASTRAY_RAD:
            # It has driven past the goal.
            reverse_rad = math.pi - reverse_rad
            alpha_rad = wrap_angle_rad(alpha_rad + math.pi)
        return Steering(error, 0.0, _angular(alpha_rad, config, period_s))

    return steer


def _linear(remaining_m: float, config: MotionConfig, period_s: float) -> float:
    """Return the fastest velocity within the limits that still stops at the signed distance `remaining_m`."""
    backwards_mps, forwards_mps = config.linear_limits_mps
    speed_mps = _braking_speed(abs(remaining_m), config.linear_acceleration_mps2, period_s)
    return (
        min(speed_mps, forwards_mps * config.speed_factor)
        if remaining_m >= 0
        else max(-speed_mps, backwards_mps * config.speed_factor)
    )


def _angular(remaining_rad: float, config: MotionConfig, period_s: float) -> float:
    """Return the fastest turn within the limit that still stops at the signed angle `remaining_rad`."""
    speed_radps = _braking_speed(abs(remaining_rad), config.angular_acceleration_radps2, period_s)
    return math.copysign(min(speed_radps, config.angular_limit_radps * config.speed_factor), remaining_rad)


def _braking_speed(remaining: float, acceleration: float, period_s: float) -> float:
    """Return the speed v with v t + v² / 2a = remaining: one more tick at v, then braking, ends at the goal."""
    planned = PLANNED_SHARE * acceleration
    return planned * (math.sqrt(period_s**2 + 2 * remaining / planned) - period_s)


def _believed_pose(platform: Platform, config: MotionConfig) -> Pose:
    return platform.odometry() if config.localisation == "noisy" else platform.pose()


def _range(value: Any) -> tuple[float, float]:
    try:
        backwards, forwards = (float(bound) for bound in value)
    except (TypeError, ValueError):
        backwards = forwards = math.nan
    if not backwards <= 0 < forwards < math.inf:
        raise BenchbotError(
            f"The robot's limits.linear_mps is {value!r}.",
            "It must be two numbers: the fastest speed backwards (zero or negative) and forwards (positive).",
            "Write for example: linear_mps: [-0.6, 1.5]",
        )
    return backwards, forwards


def _positive(values: Mapping[str, Any], key: str, default: float, group: str = "limits") -> float:
    value = values.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise BenchbotError(
            f"The robot's {group}.{key} is {value!r}.",
            "It must be a positive number.",
            f"Write for example: {key}: {default:g}",
        )
    return float(value)
