"""The driver's end of the link to its guard: it sends commands and receives the news that the robot was stopped."""

import os
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from typing import IO, NamedTuple, Self

import msgspec

from benchbot.plugin import BenchbotError, ExitCode, FailureClass, MotionConfig
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import MovedByNavigation
from benchbot_robot_ros2.failures import safety_stop
from benchbot_robot_ros2.guard import messages
from benchbot_robot_ros2.guard.state import FIND_OUT, Trip

# A guard starts in a second, or in some on a busy machine, and ends within two.
START_S, END_S = 30.0, 5.0
# A second's worth of commands: when no more fit in, the guard does not read them.
SEND_BUFFER_BYTES = 16384
MAX_LOG_BYTES = 65536


class _Spawned(NamedTuple):
    process: subprocess.Popen[bytes]
    connection: socket.socket
    log: IO[bytes]


class Guard:
    """A guard process that stands between this process and the robot, and another one that stands by.

    Every method may be called from any thread.
    """

    def __init__(self, begin: messages.Begin) -> None:
        self._begin = begin
        self._lock = threading.Lock()
        self._trip: Trip | None = None
        self._hand = messages.Hand(held=False, yielded=False)
        self._closed = False
        self._over = threading.Event()
        theirs, standbys = messages.pair()
        with theirs, standbys:
            self._guard = _spawn(begin, theirs)
            by = msgspec.structs.replace(begin, stands_by_for=self._guard.process.pid)
            self._standby = _spawn(by, standbys)
        self._connection = self._guard.connection
        self._reader = threading.Thread(target=self._listen, name="guard-link", daemon=True)

    @classmethod
    def start(cls, robot: Ros2Robot, motion: MotionConfig) -> Self:
        """Return the guard of a robot that listens to velocities.

        Raises BenchbotError when nobody listens within the declared `timing.wait_s`, or when a declared safety device
        or the simulated clock is not there.
        """
        settings = robot.settings
        guard = cls(
            messages.Begin(
                robot.name,
                robot.base_frame,
                robot.command,
                settings.safety,
                settings.timing.wait_s,
                settings.use_sim_time,
                motion,
                settings.motion.ros_action if isinstance(settings.motion, MovedByNavigation) else None,
                robot.graph,
                settings.after,
            )
        )
        try:
            guard._await_armed()
        except BaseException:
            guard.close()
            raise
        guard._reader.start()
        return guard

    @property
    def tripped(self) -> str | None:
        """Why the robot was stopped for good, None when it was not."""
        return self._trip.why if self._trip is not None else None

    @property
    def hand(self) -> messages.Hand:
        """Whether a person has taken the robot over."""
        return self._hand

    def resume(self) -> None:
        """Ask for the robot back after a person has let go of it; `hand` says when it is."""
        self._send(messages.Resume())

    @property
    def pid(self) -> int:
        """The guard's process."""
        return self._guard.process.pid

    @property
    def standby_pid(self) -> int:
        """The process of the guard that stands by."""
        return self._standby.process.pid

    def command(self, linear_mps: float, angular_radps: float, lateral_mps: float = 0.0) -> None:
        """Command a velocity; it is ramped to, and holds for the declared `command_timeout_s`.

        Waits for a guard that does not keep up, no longer than that time: then it hangs, and is replaced.
        Raises BenchbotError(failure=PLATFORM, ends_run=True) once the robot was stopped for safety.
        """
        self._tell(messages.Command(float(linear_mps), float(angular_radps), float(lateral_mps)))

    def attend(self) -> None:
        """Have the robot watched while its navigation drives it, and nothing published; holds and raises as `command`.

        Every stop calls the navigation's goals off.
        """
        self._tell(messages.Attend())

    def _tell(self, message: messages.ToGuard) -> None:
        if self._trip is None and not self._send(message, self._begin.safety.command_timeout_s):
            # The reading thread knows why, or will in a moment.
            self._over.wait(END_S)
            self._tripped(Trip("The guard process takes no commands.", FIND_OUT))
        if self._trip is not None:
            raise safety_stop(self._trip.why, self._trip.fix)

    def stop(self, why: str) -> None:
        """Stop the robot at once and for good: every later command raises. The first reason stays."""
        trip = Trip(why, FIND_OUT)
        self._tripped(trip)
        self._send(messages.Stop(trip))

    def close(self) -> None:
        """Stop the robot and end the guard. Safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._tripped(Trip("The run has ended.", "Start another one."))
        # The guards see the end; the reading thread as well, which closing alone would not wake.
        for spawned in (self._guard, self._standby):
            with suppress(OSError):
                spawned.connection.shutdown(socket.SHUT_RDWR)
        if self._reader.is_alive() and self._reader is not threading.current_thread():
            self._reader.join()
        patience_s = END_S + sum(call.timeout_s for call in self._begin.after)
        for spawned in (self._guard, self._standby):
            _end(spawned, patience_s)

    def _send(self, message: messages.ToGuard, patience_s: float = 0.0) -> bool:
        """Send a message, within a time, and say whether the guard can get it."""
        try:
            try:
                messages.send(self._connection, message)
            except BlockingIOError:
                select.select([], [self._connection], [], patience_s)
                messages.send(self._connection, message)
        except BlockingIOError:
            self._tripped(Trip("The guard process hung.", FIND_OUT))
            # Killed, it is replaced as one that died is.
            self._guard.process.kill()
            return False
        except OSError:
            return False
        return True

    def _await_armed(self) -> None:
        deadline_s = time.monotonic() + START_S + 3 * self._begin.wait_s
        for spawned in (self._guard, self._standby):
            spawned.connection.settimeout(max(1.0, deadline_s - time.monotonic()))
            try:
                message = messages.receive_from_guard(spawned.connection)
            except TimeoutError as error:
                raise self._not_started("It did not say that it is ready in time.") from error
            spawned.connection.settimeout(None)
            if isinstance(message, messages.Refused):
                raise BenchbotError(message.title, message.why, message.fix, failure=FailureClass.PLATFORM)
            if message is None:
                raise self._not_started(f"Its process ended. {_last_words(spawned)}".strip())

    def _not_started(self, why: str) -> BenchbotError:
        return BenchbotError(
            f"The guard of the robot '{self._begin.robot}' did not start.",
            why,
            f"See whether ROS 2 works here: benchbot doctor --robot {self._begin.robot}",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.PLATFORM,
        )

    def _listen(self) -> None:
        at_rest = False
        watched = [self._standby.connection, self._connection]
        while self._connection in watched:
            # The one that stands by first: it says why before it kills the other.
            for connection in [each for each in watched if each in select.select(watched, [], [])[0]]:
                message = messages.receive_from_guard(connection)
                if message is None:
                    watched.remove(connection)
                elif isinstance(message, messages.Hand):
                    self._hand = message
                elif isinstance(message, messages.Tripped):
                    at_rest = True
                    self._tripped(message.trip)
        self._tripped(Trip(f"The guard process died. {_last_words(self._guard)}".strip(), FIND_OUT))
        self._over.set()
        if not at_rest and not self._closed and not self._is_stopped_by_standby():
            self._stop_by_another()

    def _is_stopped_by_standby(self) -> bool:
        """Wait for the word of the guard that stands by, and return whether it has stopped the base."""
        with suppress(OSError):
            self._standby.connection.settimeout(END_S)
            return isinstance(messages.receive_from_guard(self._standby.connection), messages.Tripped)
        return False

    def _stop_by_another(self) -> None:
        """Stop the base by a third guard when both are gone: the last message of the first may have been a velocity."""
        nobody, theirs = messages.pair()
        with nobody, theirs:
            spawned = _spawn(msgspec.structs.replace(self._begin, stopped=self._trip), theirs)
            spawned.connection.settimeout(START_S + self._begin.wait_s)
            # It is armed when the base listens; what it publishes then does not need this side any more.
            with suppress(TimeoutError):
                messages.receive_from_guard(spawned.connection)
            spawned.connection.shutdown(socket.SHUT_RDWR)
            _end(spawned)

    def _tripped(self, trip: Trip) -> None:
        with self._lock:
            self._trip = self._trip or trip


def _last_words(spawned: _Spawned) -> str:
    """Return the last line that a guard wrote to stderr; of a traceback, that is what went wrong."""
    # The file's position is the guard's as well, so it stays untouched.
    lines = os.pread(spawned.log.fileno(), MAX_LOG_BYTES, 0).decode(errors="replace").splitlines()
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


def _spawn(begin: messages.Begin, peer: socket.socket) -> _Spawned:
    """Start a guard process, joined to the other one by `peer`; its stderr goes to a file, which never makes it wait.

    The last word of its command is for people who look at a list of processes.
    """
    role = "guards" if begin.stands_by_for is None else "stands-by"
    words = [sys.executable, "-P", "-m", "benchbot_robot_ros2.guard"]
    ours, theirs = messages.pair()
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
    log = tempfile.TemporaryFile()  # noqa: SIM115 - the guard's link closes it
    with theirs:
        process = subprocess.Popen(
            [*words, str(theirs.fileno()), str(peer.fileno()), role],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
            pass_fds=(theirs.fileno(), peer.fileno()),
            start_new_session=True,
        )
    with suppress(OSError):
        messages.send(ours, begin)
    return _Spawned(process, ours, log)


def _end(spawned: _Spawned, patience_s: float = END_S) -> None:
    """Wait for a guard to end, killing one that hangs, and let go of it; the run's log gets what it has said."""
    process, connection, log = spawned
    try:
        process.wait(patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    connection.close()
    sys.stderr.write(os.pread(log.fileno(), MAX_LOG_BYTES, 0).decode(errors="replace"))
    log.close()
