"""The bridge's side of the camera: a process that takes pictures from wherever the robot is."""

import os
import signal
import subprocess
import sys
from contextlib import suppress

from benchbot.plugin import BenchbotError, ExitCode, FailureClass, Pose, Scene
from benchbot.process import how_it_ended
from benchbot_robot_ros2.bridge import camera_channel
from benchbot_robot_ros2.bridge.camera_channel import Failed, Load, Look, Start
from benchbot_robot_ros2.bridge.robot import BridgedRobot

LOAD_TIMEOUT_S = 600.0
CLOSE_TIMEOUT_S = 3.0


class Camera:
    """Starts the camera's process; every method but `close` raises BenchbotError when that has ended."""

    def __init__(self, robot: BridgedRobot, rate_hz: float) -> None:
        self._connection, theirs = camera_channel.pair()
        self._connection.settimeout(LOAD_TIMEOUT_S)
        lifeline, self._lifeline = os.pipe()
        handles = (theirs.fileno(), lifeline)
        with theirs, os.fdopen(lifeline):
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "benchbot_robot_ros2.bridge.camera_process", *map(str, handles)],
                stdin=subprocess.DEVNULL,
                pass_fds=handles,
                start_new_session=True,
            )
        camera_channel.send(self._connection, Start(robot, rate_hz))

    def begin_load(self, scene: Scene, seed: int) -> None:
        """Send the camera to a scene, and do not wait."""
        try:
            camera_channel.send(self._connection, Load.of(scene, seed))
        except OSError as error:
            raise self._ended() from error

    def finish_load(self) -> None:
        """Wait until the camera is in the scene; raises BenchbotError when the scene cannot be loaded."""
        try:
            reply = camera_channel.receive(self._connection)
        except TimeoutError as error:
            raise BenchbotError(
                "The camera's process hangs.",
                f"It did not load the scene within {LOAD_TIMEOUT_S:g} s.",
                "Start the bridge again.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.PLATFORM,
            ) from error
        if reply is None:
            raise self._ended()
        if isinstance(reply, Failed):
            raise reply.error()

    def show(self, stamp_ns: int, base: Pose) -> None:
        """Send the robot's pose to the camera process, which takes a picture from there as soon as one is due."""
        if self._process.poll() is not None:
            raise self._ended()
        try:
            # A camera that lags so far behind has newer poses to take pictures from than it can use.
            with suppress(BlockingIOError):
                camera_channel.send(self._connection, Look(stamp_ns, base), wait=False)
        except OSError as error:
            raise self._ended() from error

    def close(self) -> None:
        """End the process."""
        self._connection.close()
        try:
            self._process.wait(CLOSE_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        os.close(self._lifeline)

    def _ended(self) -> BenchbotError:
        return BenchbotError(
            "The camera's process ended.",
            f"It {how_it_ended(self._process.wait())}. Without it the robot is blind, so the bridge ends, too.",
            "Start the bridge again; if it happens again, report what it printed.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.PLATFORM,
        )
