"""The guard's state machine, free of ROS: the velocity to publish now, and when to stop the robot for good."""

import math

import msgspec

from benchbot.plugin import MotionConfig
from benchbot_robot_ros2.ramp import REST, Velocity, clipped, ramped

# A robot at rest is told so for a while; then the topic is free for others, such as a person with a joystick.
REST_PUBLISHED_S = 0.5
# The longest time that one step ramps for: after a pause the velocity does not jump.
LONGEST_STEP_S = 0.1
# For so long a robot that is taken over is told to stop, before the topic is its person's alone.
YIELDED_ZEROS_S = 0.1

FIND_OUT = "Find out why before the robot moves again, then start the run again."


class Trip(msgspec.Struct, frozen=True):
    """Why a robot was stopped, and what to do about it."""

    why: str
    fix: str


class GuardState:
    """Commands in, the velocity to publish out. All times are seconds of one clock, the robot's.

    A nonzero command holds for `command_timeout_s`; when no other follows, the guard trips. A command of zero needs no
    follower: the guard brakes to rest by itself. Once tripped, the velocity is exactly zero, at once and for good.

    A robot that a person takes over is `held`, and `yielded` from then until the driver resumes: it is told to stop,
    and then nothing.
    """

    def __init__(
        self,
        motion: MotionConfig,
        command_timeout_s: float,
        dead_man_timeout_s: float | None = None,
        take_over_timeout_s: float = math.inf,
    ) -> None:
        self.trip: Trip | None = None
        self.e_stop_pressed = False
        self.held = self.yielded = False
        self._take_over_timeout_s = take_over_timeout_s
        self._yielded_s = self._hand_s = -math.inf
        self._motion = motion
        self._command_timeout_s = command_timeout_s
        self._dead_man_timeout_s = dead_man_timeout_s
        self._held_s = -math.inf
        self._attends = False
        self._wanted = self._velocity = REST
        self._commanded_s = -math.inf
        self._now_s = -math.inf
        self._rest_s = -math.inf

    @property
    def moving(self) -> bool:
        """True while the robot is commanded to move, or still brakes, or is driven by its navigation."""
        return self._attends or self._wanted != REST or self._velocity != REST

    def command(self, wanted: Velocity, now_s: float) -> None:
        """Take a command; it is clipped to the robot's limits."""
        if not all(map(math.isfinite, wanted)):
            self.stop(
                f"A velocity of {wanted.linear_mps} m/s, {wanted.lateral_mps} m/s to the left and "
                f"{wanted.angular_radps} rad/s was commanded.",
                "This is a fault of BenchBot or a plug-in: report it, with what was running.",
            )
        if self.trip is None and not self.yielded:
            self._wanted, self._commanded_s = clipped(wanted, self._motion), now_s
            self._attends = False

    def attend(self, now_s: float) -> None:
        """Watch over a robot that its navigation drives; it holds as long as a command does."""
        if self.trip is None:
            self._wanted, self._commanded_s, self._attends = REST, now_s, True

    def dead_man(self, *, held: bool, now_s: float) -> None:
        """Take the state of the dead-man switch."""
        self._held_s = now_s if held else -math.inf
        self._check_dead_man(now_s)

    def take_over(self, *, held: bool, now_s: float) -> None:
        """Take the state of the take-over switch: from when it is held until `resume`, no command counts."""
        if held and not self.yielded:
            self.yielded, self._yielded_s = True, now_s
            self._wanted = self._velocity = REST
        self.held, self._hand_s = held, now_s

    def resume(self) -> None:
        """Heed commands again, if the take-over switch is held no longer."""
        self.yielded = self.yielded and self.held

    def e_stop(self, *, pressed: bool) -> None:
        """Take the state of the emergency stop."""
        self.e_stop_pressed = pressed
        self._check_e_stop()

    def stop(self, why: str, fix: str = FIND_OUT) -> None:
        """Trip: the first reason stays."""
        self.trip = self.trip or Trip(why, fix)
        self._wanted = self._velocity = REST
        self._attends = False

    def release(self) -> None:
        """Clear a trip; an emergency stop that is still pressed trips again."""
        self.trip = None
        self._check_e_stop()

    def step(self, now_s: float) -> Velocity | None:
        """Return what to publish now, or None where the topic is left to others."""
        if self.moving:
            self._check(now_s)
        elapsed_s = min(max(now_s - self._now_s, 0.0), LONGEST_STEP_S)
        self._now_s = now_s
        self._check_hand(now_s)
        if self.trip is not None:
            return REST
        if self.yielded:
            return REST if 0.0 <= now_s - self._yielded_s <= YIELDED_ZEROS_S else None
        if self._wanted != REST or self._velocity != REST:
            self._rest_s = now_s
            self._velocity = ramped(self._velocity, self._wanted, elapsed_s, self._motion)
        # A clock that was set back may not keep the topic for longer.
        return self._velocity if 0.0 <= now_s - self._rest_s <= REST_PUBLISHED_S else None

    def _check(self, now_s: float) -> None:
        if now_s < self._now_s:
            self.stop(
                f"The robot's clock jumped back by {self._now_s - now_s:.2f} s while it moved.",
                "Let one source publish /clock, or set the clocks by chrony, which does not jump; then start again.",
            )
        silent_s = now_s - self._commanded_s
        if (self._attends or self._wanted != REST) and silent_s > self._command_timeout_s:
            self.stop(
                f"No velocity command came for {silent_s:.2f} s while the robot moved "
                f"(driver.safety.command_timeout_s is {self._command_timeout_s:g} s).",
                "See whether the computer is overloaded, or the solution or BenchBot hung, and start the run again.",
            )
        self._check_dead_man(now_s)
        self._check_e_stop()

    def _check_dead_man(self, now_s: float) -> None:
        if self._dead_man_timeout_s is None or not self.moving:
            return
        if not 0.0 <= now_s - self._held_s <= self._dead_man_timeout_s:
            self.stop(
                "Nobody holds the dead-man switch.",
                "Hold it for as long as the robot is to move, and start the run again.",
            )

    def _check_hand(self, now_s: float) -> None:
        silent_s = now_s - self._hand_s
        if self.held and not 0.0 <= silent_s <= self._take_over_timeout_s:
            self.stop(
                f"The take-over switch fell silent for {silent_s:.2f} s while it was held "
                f"(driver.safety.take_over.timeout_s is {self._take_over_timeout_s:g} s).",
                "See whether the joystick is in reach and its node publishes all the time, then start the run again.",
            )

    def _check_e_stop(self) -> None:
        if self.e_stop_pressed:
            self.stop("The emergency stop is pressed.", "Release it when the way is clear, then start the run again.")
