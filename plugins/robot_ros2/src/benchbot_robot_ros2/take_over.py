"""A robot that a person takes over: the action under way waits, and goes on from where the robot is then."""

from collections.abc import Callable, Iterable

from benchbot.plugin import BenchbotError
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.observing import missing

_POLL_S = 0.03
_SAYS = "{} is driven by a person, who holds its take-over switch. The run goes on when they let go."


class TakenOver:
    """The times at which a person has had the robot, in seconds of the run."""

    def __init__(self, earlier_s: Iterable[float] = ()) -> None:
        self.times = 0
        self.paused_s = 0.0
        self._told = list(earlier_s)

    def take(self) -> tuple[float, ...]:
        """Return how long each time was that has not been returned yet."""
        told, self._told = tuple(self._told), []
        return told

    def wait(self, robot: ConnectedRobot, check: Callable[[], None], tell: Callable[[str | None], None] | None) -> None:
        """Return when the person has let go, the robot is at rest, and all that it needs to move has come anew.

        `check` raises when it was stopped for safety meanwhile. Where it is then may be anywhere: localisation that
        has jumped is believed. What the person touches is no contact of the episode. Raises BenchbotError when the
        robot does not come to rest, or is localised no longer.
        """
        began_s, touched = robot.clock.now_s(), robot.contact.is_set()
        if tell is not None:
            tell(_SAYS.format(robot.robot.name))
        try:
            while robot.guard.hand.yielded:
                check()
                if not robot.guard.hand.held and self._settled(robot, check):
                    robot.guard.resume()
                with robot.changed:
                    robot.changed.wait(_POLL_S)
        finally:
            if touched:
                robot.contact.set()
            spent_s = robot.clock.now_s() - began_s
            self.times, self.paused_s = self.times + 1, self.paused_s + spent_s
            self._told.append(spent_s)
            if tell is not None:
                tell(None)

    def _settled(self, robot: ConnectedRobot, check: Callable[[], None]) -> bool:
        """Wait until the robot rests and is seen anew; say whether it is, and not in a person's hand again."""
        try:
            robot.await_rest(check)
            wait = robot.wait(robot.robot.settings.timing.wait_s)
            while silent := [stream for stream in robot.feedback if stream.newest is None]:
                check()
                if wait.over():
                    raise missing(silent)
            robot.check_feedback()
        except BenchbotError as error:
            if error.ends_run or not robot.guard.hand.held:
                raise
            return False
        robot.localisation.forgive()
        return True
