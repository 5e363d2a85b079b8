"""The guard that stands by: its node is up, and it publishes nothing until the other guard dies or hangs."""

import os
import select
import signal
import socket
import threading
import time
from contextlib import suppress
from dataclasses import dataclass

from benchbot_robot_ros2.guard import messages
from benchbot_robot_ros2.guard.state import FIND_OUT, Trip
from benchbot_robot_ros2.guard.velocity import STOPPED_PERIOD_S, GuardedVelocity, stopping

GUARD_DIED = Trip("The guard process died.", FIND_OUT)
GUARD_HUNG = Trip("The guard process hung.", FIND_OUT)


@dataclass(frozen=True)
class Other:
    """The guard that is watched: the socket on which its signs of life come, its process, the longest time between."""

    peer: socket.socket
    pid: int
    longest_silence_s: float


def watch(velocity: GuardedVelocity, connection: socket.socket, other: Other, ending: threading.Event) -> bool:
    """Stop the robot when the other guard dies, or says nothing for too long, while it moves the robot.

    One that is silent is killed first: it could wake up and publish a velocity. Returns False when it ends with the
    robot at rest, and after a stop, at the driver's end, True.
    """
    watched, moving, heard_s = [connection, other.peer], False, time.monotonic()
    while not ending.is_set():
        ready, _, _ = select.select(watched, [], [], other.longest_silence_s / 4)
        if connection in ready and not _is_there(connection):
            watched = [other.peer]  # the other guard sees to the driver's end
        beats = _beats(other.peer)
        said = [beat.moving for beat in beats if beat is not None]
        if said:
            moving, heard_s = said[-1], time.monotonic()
        if None in beats:
            if moving:
                _stop(velocity, connection, GUARD_DIED)
            return moving
        if moving and time.monotonic() - heard_s > other.longest_silence_s:
            messages.tell(connection, messages.Tripped(GUARD_HUNG))
            with suppress(ProcessLookupError):
                os.kill(other.pid, signal.SIGKILL)
            _stop(velocity, connection, GUARD_HUNG)
            return True
    return False


def _stop(velocity: GuardedVelocity, connection: socket.socket, trip: Trip) -> None:
    """Publish zeros until the driver's end, and the last ones after it."""
    velocity.update(stopping(trip))
    messages.tell(connection, messages.Tripped(trip))
    while _is_there(connection):
        select.select([connection], [], [], STOPPED_PERIOD_S)
        velocity.update()
    velocity.finish()


def _is_there(connection: socket.socket) -> bool:
    """Take in what the driver says, which is nothing new here, and return whether it is there."""
    with suppress(BlockingIOError):
        while messages.receive_at_guard(connection) is not None:
            pass
        return False
    return True


def _beats(peer: socket.socket) -> list[messages.Beat | None]:
    """Return the signs of life that have arrived by now; None is the guard's end."""
    found: list[messages.Beat | None] = []
    with suppress(BlockingIOError):
        while not found or found[-1] is not None:
            found.append(messages.receive_beat(peer))
    return found
