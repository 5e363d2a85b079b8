"""The bridged robot itself: it obeys the last velocity command for a moment, as real bases do, then brakes."""

from collections.abc import Iterable, Mapping
from typing import Any, cast

from benchbot.plugin import BenchbotError, Holonomic, Observations, Pose, Scene, Simulation
from benchbot_robot_ros2.bridge.odometry_errors import OdometryErrors
from benchbot_robot_ros2.bridge.pace import RobotTime
from benchbot_robot_ros2.ramp import REST, Velocity

COMMAND_HOLDS_NS = 150_000_000


class World:
    """A simulated robot in a scene. Its time continues across resets; a contact is kept until the next reset.

    A command holds for 0.15 s of the robot's time: the first tick that begins later brakes towards zero. `noise` is
    that of the robot's declaration, and `odometry_errors` what follows from it. A base that is not `holonomic` does not
    go sideways, whatever is commanded.
    """

    def __init__(
        self, platform: Simulation, time: RobotTime, noise: Mapping[str, Any], *, holonomic: bool = False
    ) -> None:
        self.odometry_errors = OdometryErrors(noise, holonomic=holonomic)
        self._holonomic = holonomic
        self._platform = platform
        self._time = time
        self._command = REST
        self._command_ends_ns = 0

    @property
    def stamp_ns(self) -> int:
        """The robot's time, in nanoseconds."""
        return self._time.stamp_ns

    @property
    def control_period_s(self) -> float:
        """The length of a tick, in seconds."""
        return self._platform.control_period_s

    def live_in(self, time: RobotTime) -> None:
        """Let another time be the robot's, before its first tick."""
        self._time = time

    def left_s(self) -> float:
        """Return how long to wait for the next tick, at most, in seconds."""
        return self._time.left_s()

    def load(self, scene: Scene, seed: int) -> None:
        """Put the robot at the start of a scene, at rest; odometry begins anew there."""
        self._command_ends_ns = 0
        self._platform.load(scene, seed)
        self._origin = self._platform.odometry()
        self.odometry_errors.start(self.odometry())

    def command(self, velocity: Velocity) -> None:
        """Ask for a velocity."""
        self._command = velocity
        self._command_ends_ns = self.stamp_ns + COMMAND_HOLDS_NS

    def place(self, base: Pose) -> None:
        """Put the robot, at rest, at a pose in the map; raises BenchbotError when it would touch something there."""
        before = self._platform.pose()
        self._command_ends_ns = 0
        self._platform.place(base)
        self.odometry_errors.rest()
        if self._platform.contact_ahead(0.0, 0.0, 0.0):
            self._platform.place(before)
            x, y, _ = base.translation_xyz
            raise BenchbotError(
                "The robot does not fit there.",
                f"At ({x:g}, {y:g}) it would touch something.",
                "Place it somewhere else.",
            )

    def tick(self) -> None:
        """Let one control tick pass."""
        wanted = self._command if self.stamp_ns < self._command_ends_ns else REST
        duration_s = self._time.next_tick()
        if self._holonomic:
            cast(Holonomic, self._platform).drive_sideways(
                wanted.lateral_mps, wanted.angular_radps, duration_s, wanted.linear_mps
            )
        else:
            self._platform.drive(wanted.linear_mps, wanted.angular_radps, duration_s)
        self.odometry_errors.follow(self.odometry(), duration_s)

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return what the robot observes now."""
        return self._platform.observe(channels)

    def pose(self) -> Pose:
        """Return the true pose of the base in the map."""
        return self._platform.pose()

    def odometry(self) -> Pose:
        """Return the base's pose by wheel odometry, relative to that at the last `load`."""
        return self._origin.inverse() @ self._platform.odometry()

    @property
    def velocity(self) -> Velocity:
        """The true velocity."""
        lateral_mps = cast(Holonomic, self._platform).lateral_mps if self._holonomic else 0.0
        return Velocity(*self._platform.velocity, lateral_mps)

    @property
    def collided(self) -> bool:
        """True if the robot has touched something since the last `load`."""
        return self._platform.collided

    def close(self) -> None:
        """Release the simulator."""
        self._platform.close()
