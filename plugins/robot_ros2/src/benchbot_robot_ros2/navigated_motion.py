"""Motion of a robot by Nav2: its goal is followed under all that watches over a moving robot, and ends at rest."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

from benchbot.plugin import BenchbotError, Outcome, Pose
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.control_tick import CONTROL_PERIOD_S, REPEAT_S, SLACK_S
from benchbot_robot_ros2.declaration_keys import MovedByNavigation
from benchbot_robot_ros2.guard.state import FIND_OUT
from benchbot_robot_ros2.navigation import Navigation, moved_by
from benchbot_robot_ros2.observing import STILL_FACTOR
from benchbot_robot_ros2.ramp import REST, Velocity
from benchbot_robot_ros2.standstill import measured_velocity, rested, speed_mps, still

# How long Nav2 may take to brake, once its goal has ended.
REST_S = 3.0


class Note(Protocol):
    """Takes in what a robot does."""

    def __call__(self, command: Velocity, now_s: float, *, is_seen: bool = False) -> None:
        """Take in what it was commanded, or is seen to do, at a time of the run."""


@dataclass(frozen=True)
class Watch:
    """What a driver watches over a moving robot by.

    `refuse` raises once the robot was stopped, and `look` when it has to be. `found` returns how a motion has ended by
    what the sensors see. `stop` stops the robot for good, and returns the error of why, and the fix.
    """

    refuse: Callable[[], None]
    look: Callable[[], None]
    note: Note
    found: Callable[[], Outcome | None]
    stop: Callable[[str, str], BenchbotError]


def navigated_by(robot: ConnectedRobot, watch: Watch) -> "NavigatedMotion | None":
    """Return what follows Nav2, where that drives the robot.

    Raises BenchbotError when Nav2 is not there, or something else commands velocities.
    """
    way = robot.robot.settings.motion
    if not isinstance(way, MovedByNavigation):
        return None
    navigation = moved_by(robot.node, robot.robot, way, watch.refuse)
    return NavigatedMotion(robot, navigation, way.timeout_s, watch)


class NavigatedMotion:
    """A connected robot that Nav2 drives; `is_under_way` from a goal's sending until it is called off or has ended."""

    def __init__(self, robot: ConnectedRobot, navigation: Navigation, timeout_s: float, watch: Watch) -> None:
        self._robot, self._navigation, self._timeout_s, self._watch = robot, navigation, timeout_s, watch
        self.is_under_way = False

    def carry_out(self, here: Pose, goal: Pose) -> Iterator[Outcome | None]:
        """Let Nav2 drive from here to a goal; yield None after every control tick, and the outcome at rest.

        Raises BenchbotError(ends_run=True) when the robot was stopped for safety, or does not stop when it is called
        off.
        """
        self._navigation.send(here, goal)
        deadline_s = self._robot.clock.now_s() + self._timeout_s
        self.is_under_way = True
        outcome = None
        try:
            while outcome is None:
                self._tick()
                yield None
                outcome = self._watch.found()
                if outcome is None and self._robot.clock.now_s() > deadline_s:
                    outcome = Outcome.TIMEOUT
                outcome = outcome or self._navigation.outcome()
        except BaseException as error:
            self._end(error.why if isinstance(error, BenchbotError) else str(error))
            # A goal that a guard has called off may be seen to end before the guard's reason is heard.
            self._watch.refuse()
            raise
        self._end(f"The motion was {outcome}.")
        yield outcome

    def close(self) -> None:
        """Leave Nav2 alone."""
        self._navigation.close()

    def _tick(self) -> None:
        """Watch over the robot for one control tick; the guards do as well."""
        robot = self._robot
        until_s = robot.clock.now_s() + CONTROL_PERIOD_S
        while (left_s := until_s - robot.clock.now_s()) >= SLACK_S:
            self._watch.look()
            measured = robot.odometry.newest
            # What it does is what it was commanded, as far as can be known here.
            moves = measured is not None and not still(measured.message)
            seen = measured_velocity(measured.message) if measured and moves else REST
            self._watch.note(seen, robot.clock.now_s(), is_seen=True)
            robot.guard.attend()
            with robot.changed:
                robot.changed.wait(min(left_s, REPEAT_S))

    def _attend(self) -> None:
        if self._robot.guard.tripped is None:
            self._robot.guard.attend()

    def _end(self, why: str) -> None:
        """Call off a goal that has not ended, and see by odometry that the robot stops, or stop it for good."""
        robot = self._robot
        is_off = self._navigation.call_off(self._attend)
        self.is_under_way = False
        since_s = robot.clock.now_s()
        self._watch.note(REST, since_s)
        stalled_s = STILL_FACTOR * robot.robot.settings.timing.feedback_timeout_s
        while not rested(robot.odometry.samples, since_s):
            self._attend()
            if robot.clock.now_s() - since_s > REST_S or robot.clock.still_s > stalled_s:
                said = "confirmed that it drives the robot no longer" if is_off else "did not confirm that it let go"
                raise self._watch.stop(
                    f"{why} Nav2 {said}, and {REST_S:g} s later odometry still said {self._seen()}.",
                    "See what drives the robot: with Nav2, why it does not stop when its goal is cancelled.",
                )
            with robot.changed:
                robot.changed.wait(REPEAT_S)
        if not is_off:
            raise self._watch.stop(f"{why} Nav2 did not confirm that it drives the robot no longer.", FIND_OUT)
        if robot.guard.tripped is None:
            robot.guard.command(*REST)

    def _seen(self) -> str:
        measured = self._robot.odometry.newest
        if measured is None:
            return "nothing"
        turning_radps = measured_velocity(measured.message).angular_radps
        return f"{speed_mps(measured.message):.2f} m/s and {turning_radps:.2f} rad/s"
