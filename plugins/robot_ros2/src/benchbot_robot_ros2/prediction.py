"""Prediction of the base's current pose from odometry that arrives late.

Between a command and its effect in odometry lies a dead time: of the network, of the base, of what measures. A loop
that steers by what it has already commanded, but not yet seen, overshoots and hunts. So the newest odometry is carried
on by the commands that it cannot show yet (a predictor as Smith's, "Closer control of loops with dead time", Chemical
Engineering Progress 53(5), 1957). At rest nothing is carried on.
"""

import math
from collections import deque

from benchbot.plugin import MotionConfig, Pose
from benchbot_robot_ros2.ramp import REST, Velocity, clipped, ramped
from benchbot_robot_ros2.standstill import STILL_MPS, STILL_RADPS, measured_velocity, still
from benchbot_robot_ros2.streams import Sample

STEP_S = 0.02
# A start is measured when the command is far enough above noise; a base that takes longer than this does not answer it.
CLEAR_FACTOR = 5.0
LONGEST_DEAD_TIME_S = 0.5


class Prediction:
    """Notes commands, measures the dead time at every start from rest, and carries odometry on. Times in seconds."""

    def __init__(self, motion: MotionConfig) -> None:
        self.dead_time_s = 0.0
        self._motion = motion
        self._commands: deque[tuple[float, Velocity]] = deque([(-math.inf, REST)])
        self._started_s: float | None = None

    def note(self, command: Velocity, now_s: float, *, is_seen: bool = False) -> None:
        """Note what is commanded from now on.

        Where another commands the base, that is the velocity that is seen: it says nothing of the dead time.
        """
        command = clipped(command, self._motion)
        last = self._commands[-1][1]
        if command == last:
            return
        if last == REST:
            fastest_mps = max(abs(command.linear_mps), abs(command.lateral_mps))
            clear = fastest_mps > CLEAR_FACTOR * STILL_MPS or abs(command.angular_radps) > CLEAR_FACTOR * STILL_RADPS
            self._started_s = now_s if clear and not is_seen else None
        self._commands.append((now_s, command))
        while len(self._commands) > 1 and self._commands[1][0] < now_s - 2 * LONGEST_DEAD_TIME_S:
            self._commands.popleft()

    def carry_on(self, odometry: list[Sample], now_s: float) -> tuple[Pose, Velocity]:
        """Return the base's pose now in the frame of its newest odometry, and its velocity now."""
        if not odometry:
            return Pose(), REST
        self._measure(odometry)
        newest = odometry[-1]
        velocity = REST if still(newest.message) else measured_velocity(newest.message)
        # Nobody commands a base sideways that is not holonomic: one that drifts or is pushed goes on.
        drift_mps = None if self._motion.lateral_limit_mps else velocity.lateral_mps
        pose, begin_s = Pose(), newest.arrived_s - self.dead_time_s
        count = math.ceil(max(0.0, now_s - begin_s) / STEP_S)
        for index in range(count):
            step_s = (now_s - begin_s) / count
            commanded = self._commanded(begin_s + index * step_s)
            before, velocity = velocity, ramped(velocity, commanded, step_s, self._motion)
            if drift_mps is not None:
                velocity = velocity._replace(lateral_mps=drift_mps)
            way_m = (before.linear_mps + velocity.linear_mps) / 2 * step_s
            turned_rad = (before.angular_radps + velocity.angular_radps) / 2 * step_s
            side_m = (before.lateral_mps + velocity.lateral_mps) / 2 * step_s
            cos, sin = math.cos(turned_rad / 2), math.sin(turned_rad / 2)
            pose = pose @ Pose.planar(way_m * cos - side_m * sin, way_m * sin + side_m * cos, turned_rad)
        return pose, velocity

    def _commanded(self, time_s: float) -> Velocity:
        return next((command for since_s, command in reversed(self._commands) if since_s <= time_s), REST)

    def _measure(self, odometry: list[Sample]) -> None:
        if self._started_s is None:
            return
        since = [sample for sample in odometry if sample.arrived_s >= self._started_s]
        moving = next((sample for sample in since if not still(sample.message)), None)
        if moving is not None:
            self.dead_time_s = min(moving.arrived_s - self._started_s, LONGEST_DEAD_TIME_S)
            self._started_s = None
