"""The bridged robot itself: it obeys the last velocity command for a moment, as real bases do, then brakes."""

from collections.abc import Iterable, Mapping
from typing import Any

from benchbot.plugin import BenchbotError, Observations, Pose, Scene, Simulation
from benchbot_robot_ros2.bridge.odometry_errors import OdometryErrors
from benchbot_robot_ros2.bridge.pace import RobotTime

COMMAND_HOLDS_NS = 150_000_000


class World:
    """A simulated robot in a scene. Its time continues across resets; a contact is kept until the next reset.

    A command holds for 0.15 s of the robot's time: the first tick that begins later brakes towards zero. `noise` is
    that of the robot's declaration, and `odometry_errors` what follows from it.
    """

    def __init__(self, platform: Simulation, time: RobotTime, noise: Mapping[str, Any]) -> None:
        self.odometry_errors = OdometryErrors(noise)
        self._platform = platform
        self._time = time
        self._command = (0.0, 0.0)
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

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Ask for a velocity along +x and about +z."""
        self._command = (linear_mps, angular_radps)
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
        linear_mps, angular_radps = self._command if self.stamp_ns < self._command_ends_ns else (0.0, 0.0)
        duration_s = self._time.next_tick()
        self._platform.drive(linear_mps, angular_radps, duration_s)
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
    def velocity(self) -> tuple[float, float]:
        """Linear m/s along +x and angular rad/s about +z."""
        return self._platform.velocity

    @property
    def collided(self) -> bool:
        """True if the robot has touched something since the last `load`."""
        return self._platform.collided

    def close(self) -> None:
        """Release the simulator."""
        self._platform.close()
