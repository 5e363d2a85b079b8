"""The motion of many robots of one kind as arrays: actions, drive, contact and odometry of all of them in one pass.

`benchbot.core.motion`, `dynamics`, `contact` and `odometry` say what one robot does; here the same operations are done
in the same order on arrays of all robots that still move, so that the results are theirs to the last bit, by EXACT
trigonometry.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields

import numpy as np
import numpy.typing as npt

from benchbot.core import motion
from benchbot.plugin import MotionConfig, Outcome
from benchbot.plugins.simulation import contact, dynamics, odometry
from benchbot.plugins.simulation.dynamics import DriveLimits, State
from benchbot.plugins.simulation.many_steering import BENT_RAD, Believed, Steering, believed, wrapped
from benchbot.plugins.simulation.poses import EXACT, Floats, Indices, Mask, Trigonometry
from benchbot.plugins.simulation.robot import Noise

Distances = Callable[[Indices, Floats, Floats], Floats]
"""Distances (M,) to the nearest obstacle of robots (M,) of these numbers, if they were at x and y (M,)."""

OUTCOMES = tuple(Outcome)
_REACHED, _BLOCKED, _COLLIDED, _TIMEOUT = (
    OUTCOMES.index(each) for each in (Outcome.REACHED, Outcome.BLOCKED, Outcome.COLLIDED, Outcome.TIMEOUT)
)


@dataclass
class States:
    """`dynamics.State` and `imu.Motion` of N robots, seconds and ticks since `load`, and who has touched something."""

    x: Floats
    y: Floats
    yaw_rad: Floats
    linear_mps: Floats
    angular_radps: Floats
    linear_mps2: Floats
    angular_radps2: Floats
    clock_s: Floats
    instant: npt.NDArray[np.int64]
    collided: Mask
    known_x: Floats
    known_y: Floats
    known_clearance_m: Floats
    """As `contact.Clearance` has it: the last place at which the clearance was looked up."""

    @classmethod
    def of(cls, count: int) -> "States":
        """Return the states of so many robots at rest at the origin."""
        kinds: dict[str, npt.DTypeLike] = {"instant": np.int64, "collided": np.bool_}
        return cls(*(np.zeros(count, kinds.get(each.name, np.float64)) for each in fields(cls)))


@dataclass
class ManyOdometry:
    """`odometry.Odometry` of N robots."""

    x: Floats
    y: Floats
    yaw_rad: Floats
    noise: Noise
    _normals: list[Iterator[tuple[float, float]]] = field(default_factory=list)

    @classmethod
    def of(cls, count: int, noise: Noise) -> "ManyOdometry":
        """Return the odometry of so many robots, which `begin` at their starts."""
        x, y, yaw_rad = np.zeros((3, count))
        return cls(x, y, yaw_rad, noise, [odometry.normals(0)] * count)

    def begin(self, robot: int, state: State, seed: int) -> None:
        """Put the estimate of a robot where it is."""
        self.x[robot], self.y[robot], self.yaw_rad[robot] = state.x, state.y, state.yaw_rad
        self._normals[robot] = odometry.normals(seed)

    def follow(self, robots: Indices, before: tuple[Floats, Floats, Floats], states: States, by: Trigonometry) -> None:
        """Update the estimates by the measured motion from the states before to those now."""
        x, y, yaw_rad = before
        turn_rad = states.yaw_rad[robots] - yaw_rad
        heading_rad = yaw_rad + turn_rad / 2
        way_m = (states.x[robots] - x) * by.cos(heading_rad) + (states.y[robots] - y) * by.sin(heading_rad)
        moved = (way_m != 0) | (turn_rad != 0)
        robots, way_m, turn_rad = robots[moved], way_m[moved], turn_rad[moved]
        errors = np.array([next(self._normals[robot]) for robot in robots.tolist()]).reshape(-1, 2)
        noise = self.noise
        way_m = way_m * (1.0 + noise.linear_bias + noise.linear * errors[:, 0])
        turn_rad = turn_rad * (1.0 + noise.angular_bias + noise.angular * errors[:, 1])
        pose = self.x[robots], self.y[robots], self.yaw_rad[robots]
        self.x[robots], self.y[robots], self.yaw_rad[robots] = _along_arc(pose, way_m, turn_rad, by)


class ManyMotion:
    """Moves N robots of one declaration. `odometry` is None where nobody is told of it."""

    def __init__(
        self,
        count: int,
        config: MotionConfig,
        limits: DriveLimits,
        radius_m: float,
        distances: Distances,
        period_s: float,
        odometry: ManyOdometry | None = None,
    ) -> None:
        self.states = States.of(count)
        self.odometry = odometry
        self._config, self._limits, self._radius_m = config, limits, radius_m
        self._distances, self._period_s, self.by = distances, period_s, EXACT

    def begin(self, robot: int, state: State) -> None:
        """Put a robot, at rest, at the start of a scene."""
        states = self.states
        for each in fields(states):
            getattr(states, each.name)[robot] = getattr(state, each.name, 0)
        self.forget(np.array([robot]))

    def forget(self, robots: Indices) -> None:
        """Look up clearances anew, since obstacles are elsewhere."""
        self.states.known_x[robots] = self.states.known_y[robots] = math.nan

    def execute(self, robots: Indices, straight: Mask, arguments: Floats) -> npt.NDArray[np.intp]:
        """Execute an action of each of these robots to its end; return numbers of `OUTCOMES` (M,).

        `straight` (M,) is True for move_distance with its argument in metres, False for move_angle in degrees.
        """
        outcomes = np.full(len(robots), _REACHED)
        begun = self._believed(robots)
        angles_rad = np.array([math.radians(angle) for angle in np.where(straight, 0.0, arguments).tolist()])
        kind = self._config, self._period_s, self.by
        steering = Steering(*kind, straight.copy(), begun, arguments, angles_rad)
        self._run(robots, steering, outcomes, np.arange(len(robots)))
        # A drive ends with the heading that it began with.
        again = np.flatnonzero(straight & (outcomes == _REACHED))
        if len(again):
            now = self._believed(robots)
            back_rad = wrapped(begun.yaw_rad - now.yaw_rad)
            steering = Steering(*kind, np.zeros(len(robots), bool), now, arguments, back_rad)
            self._run(robots, steering, outcomes, again)
        return outcomes

    def hold(self, robots: Indices, linear_mps: Floats, angular_radps: Floats, duration_s: float) -> None:
        """Hold a velocity for a while, in whole control ticks; who has touched something stays where it is."""
        ticks = max(1, round(duration_s / self._period_s))
        for _ in range(ticks):
            free = ~self.states.collided[robots]
            self._drive(robots[free], linear_mps[free], angular_radps[free], duration_s / ticks)

    def _believed(self, robots: Indices) -> Believed:
        """Return where the robots believe they are."""
        told = self.states if self.odometry is None else self.odometry
        return believed((told.x[robots], told.y[robots], told.yaw_rad[robots]), self.by)

    def _run(self, robots: Indices, steering: Steering, outcomes: npt.NDArray[np.intp], lanes: Indices) -> None:
        """As `motion._run` for `lanes`, which are numbers in `robots`; each goes at its own pace."""
        states, config = self.states, self._config
        resting = np.zeros(len(robots), bool)
        last_error, rest_began_s = np.full(len(robots), math.inf), np.zeros(len(robots))
        deadline_s = states.clock_s[robots] + config.phase_timeout_s
        while len(lanes):
            linear_mps, angular_radps = np.zeros((2, len(robots)))
            pursuing = lanes[~resting[lanes]]
            if len(pursuing):
                ended = np.full(len(pursuing), -1)
                hit = states.collided[robots[pursuing]]
                ended[hit] = _COLLIDED
                steered = pursuing[~hit]
                error, linear, angular = steering(self._believed(robots[steered]), steered)
                linear_mps[steered], angular_radps[steered] = linear, angular
                there = (error <= motion.FINE_SHARE) | ((last_error[steered] <= error) & (error <= 1.0))
                last_error[steered] = np.where(there, last_error[steered], error)
                late = ~there & (states.clock_s[robots[steered]] >= deadline_s[steered])
                told = np.where(there, _REACHED, np.where(late, _TIMEOUT, -1))
                if config.stops_before_contact:
                    on = np.flatnonzero(told < 0)
                    on = on[self._contact_ahead(robots[steered[on]], linear[on], angular[on])]
                    told[on] = _BLOCKED
                ended[~hit] = told
                stop = pursuing[ended >= 0]
                outcomes[stop] = ended[ended >= 0]
                resting[stop] = True
                rest_began_s[stop] = states.clock_s[robots[stop]]
                linear_mps[stop] = angular_radps[stop] = 0.0
            done = np.zeros(len(robots), bool)
            waiting = lanes[resting[lanes]]
            if len(waiting):
                still_at = robots[waiting]
                still = (abs(states.linear_mps[still_at]) < motion.REST_MPS) & (
                    abs(states.angular_radps[still_at]) < motion.REST_RADPS
                )
                still |= ~(states.clock_s[still_at] - rest_began_s[waiting] < motion.REST_TIMEOUT_S)
                done[waiting[still]] = True
            driven = lanes[~done[lanes]]
            self._drive(robots[driven], linear_mps[driven], angular_radps[driven], self._period_s)
            rested = lanes[done[lanes]]
            if len(rested):
                hit = states.collided[robots[rested]]
                outcomes[rested[hit]] = _COLLIDED
                checked = rested[~hit & (outcomes[rested] == _REACHED)]
                error, _, _ = steering(self._believed(robots[checked]), checked)
                # Where the robot brakes worse than planned, it may have left the goal again.
                again = checked[error > 1.0]
                resting[again], last_error[again] = False, math.inf
                done[again] = False
                lanes = lanes[~done[lanes]]

    def _drive(self, robots: Indices, linear_mps: Floats, angular_radps: Floats, duration_s: float) -> None:
        """As `KinematicSimulator.drive`, for all of these robots."""
        if not len(robots):
            return
        states = self.states
        before = states.x[robots], states.y[robots], states.yaw_rad[robots]
        linear_before, angular_before = states.linear_mps[robots], states.angular_radps[robots]
        start = (*before, linear_before, angular_before)
        (x, y, yaw_rad, linear, angular), hit = self._travel(
            robots, start, [_Command(linear_mps, angular_radps, np.full(len(robots), duration_s))], stops=True
        )
        states.x[robots], states.y[robots], states.yaw_rad[robots] = x, y, yaw_rad
        states.linear_mps[robots], states.angular_radps[robots] = linear, angular
        states.collided[robots] |= hit
        states.clock_s[robots] += duration_s
        states.instant[robots] += 1
        if self.odometry is not None:
            self.odometry.follow(robots, before, states, self.by)
        states.linear_mps2[robots] = (linear - linear_before) / duration_s
        states.angular_radps2[robots] = (angular - angular_before) / duration_s

    def _contact_ahead(self, robots: Indices, linear_mps: Floats, angular_radps: Floats) -> Mask:
        """As `KinematicSimulator.contact_ahead`, within one control tick."""
        states, period_s = self.states, self._period_s
        x, y, linear = states.x[robots], states.y[robots], states.linear_mps[robots]
        fastest_mps = np.maximum(abs(linear), abs(linear_mps))
        reach_m = fastest_mps * period_s + fastest_mps**2 / (2 * self._limits.linear_acceleration_mps2)
        near = np.flatnonzero(~(self._at_least_m(robots, x, y) > reach_m))
        near = near[~(self._exactly_m(robots[near], x[near], y[near]) > reach_m[near])]
        touches = np.zeros(len(robots), bool)
        if len(near):
            there = robots[near]
            start = (x[near], y[near], states.yaw_rad[there], linear[near], states.angular_radps[there])
            command = _Command(linear_mps[near], angular_radps[near], np.full(len(near), period_s))
            _, touches[near] = self._travel(there, start, [command, None], stops=False)
        return touches

    def _travel(
        self, robots: Indices, start: tuple[Floats, ...], commands: list["_Command | None"], *, stops: bool
    ) -> tuple[tuple[Floats, ...], Mask]:
        """As `contact.travel` along `dynamics.drive` of one command after the other; None is braking to rest.

        Return the last free states (x, y, yaw, velocities), and who had contact. Without `stops` the states of those
        who had are of no meaning.
        """
        limits, by = self._limits, self.by
        x, y, yaw_rad, linear, angular = (each.copy() for each in start)
        hit = np.zeros(len(robots), bool)
        for given in commands:
            command = given
            if command is None:
                braking_s = np.maximum(
                    abs(linear) / limits.linear_acceleration_mps2, abs(angular) / limits.angular_acceleration_radps2
                )
                command = _Command(np.zeros(len(robots)), np.zeros(len(robots)), braking_s)
            backwards_mps, forwards_mps = limits.linear_mps
            wanted_mps = np.minimum(np.maximum(command.linear_mps, backwards_mps), forwards_mps)
            wanted_radps = np.minimum(np.maximum(command.angular_radps, -limits.angular_radps), limits.angular_radps)
            longest_m = np.maximum(abs(linear), abs(wanted_mps)) * command.duration_s / dynamics.LONGEST_SUBSTEP_M
            widest = np.maximum(abs(angular), abs(wanted_radps)) * command.duration_s / dynamics.WIDEST_SUBSTEP_RAD
            count = np.ceil(np.maximum(np.maximum(1.0, longest_m), widest))
            from_mps, from_radps = linear.copy(), angular.copy()
            way_m, turned_rad = np.zeros((2, len(robots)))
            for index in range(1, int(count.max()) + 1):
                on = np.flatnonzero((index <= count) & ~hit)
                if not len(on):
                    break
                elapsed_s = command.duration_s[on] * (index / count[on])
                linear_acceleration, angular_acceleration = (
                    limits.linear_acceleration_mps2,
                    limits.angular_acceleration_radps2,
                )
                new_mps, way_so_far_m = _ramp(from_mps[on], wanted_mps[on], linear_acceleration, elapsed_s)
                new_radps, turned_so_far_rad = _ramp(from_radps[on], wanted_radps[on], angular_acceleration, elapsed_s)
                place = x[on], y[on], yaw_rad[on]
                new = _along_arc(place, way_so_far_m - way_m[on], turned_so_far_rad - turned_rad[on], by)
                way_m[on], turned_rad[on] = way_so_far_m, turned_so_far_rad
                touching = self._at_least_m(robots[on], new[0], new[1]) < 0
                hit[on[touching]] = True
                if stops:
                    for lane in np.flatnonzero(touching).tolist():
                        self._stop_at_contact(robots[on[lane]], place, new, lane)
                        linear[on[lane]] = angular[on[lane]] = 0.0
                free = on if stops else on[~touching]
                kept = slice(None) if stops else ~touching
                x[free], y[free], yaw_rad[free] = (each[kept] for each in new)
                moving = on[~touching]
                linear[moving], angular[moving] = new_mps[~touching], new_radps[~touching]
        return (x, y, yaw_rad, linear, angular), hit

    def _stop_at_contact(self, robot: int, free: tuple[Floats, ...], touching: tuple[Floats, ...], lane: int) -> None:
        """Put the pose `lane` of `touching` where contact begins."""
        here, there = (State(*(float(each[lane]) for each in pose)) for pose in (free, touching))
        robots = np.array([robot])

        def distance_m(x: float, y: float) -> float:
            return float(self._distances(robots, np.array([x]), np.array([y]))[0])

        end = contact.up_to_contact(here, there, contact.Clearance(distance_m, self._radius_m))
        for array, value in zip(touching, (end.x, end.y, end.yaw_rad), strict=True):
            array[lane] = value

    def _at_least_m(self, robots: Indices, x: Floats, y: Floats) -> Floats:
        """As `contact.Clearance.at_least_m`."""
        states = self.states
        away_x, away_y = x - states.known_x[robots], y - states.known_y[robots]
        free_m: Floats = states.known_clearance_m[robots] - np.sqrt(away_x * away_x + away_y * away_y)
        unknown = np.flatnonzero(~(free_m > 0))
        if len(unknown):
            free_m[unknown] = self._exactly_m(robots[unknown], x[unknown], y[unknown])
        return free_m

    def _exactly_m(self, robots: Indices, x: Floats, y: Floats) -> Floats:
        if not len(robots):
            return np.zeros(0)
        states = self.states
        clearance_m = self._distances(robots, x, y) - self._radius_m
        states.known_x[robots], states.known_y[robots] = x, y
        states.known_clearance_m[robots] = clearance_m
        return clearance_m


@dataclass(frozen=True)
class _Command:
    linear_mps: Floats
    angular_radps: Floats
    duration_s: Floats


def _ramp(start: Floats, target: Floats, acceleration: float, elapsed_s: Floats) -> tuple[Floats, Floats]:
    ramp_s = abs(target - start) / acceleration
    velocity = start + np.copysign(acceleration * elapsed_s, target - start)
    over = elapsed_s >= ramp_s
    return (
        np.where(over, target, velocity),
        np.where(
            over,
            (start + target) / 2 * ramp_s + target * (elapsed_s - ramp_s),
            (start + velocity) / 2 * elapsed_s,
        ),
    )


def _along_arc(
    pose: tuple[Floats, Floats, Floats], way_m: Floats, turn_rad: Floats, by: Trigonometry
) -> tuple[Floats, Floats, Floats]:
    x, y, yaw_rad = pose
    half_rad = turn_rad / 2
    bent = abs(half_rad) > BENT_RAD
    chord_m = way_m * np.where(bent, by.sin(half_rad) / np.where(bent, half_rad, 1.0), 1.0)
    heading_rad = yaw_rad + half_rad
    return x + chord_m * by.cos(heading_rad), y + chord_m * by.sin(heading_rad), yaw_rad + turn_rad
