"""The guard that stands by: its node is up, and it publishes nothing until the other guard dies or hangs."""

import os
import select
import signal
import socket
import threading
from contextlib import suppress

from benchbot_robot_ros2.guard import messages
from benchbot_robot_ros2.guard.peer import Peer
from benchbot_robot_ros2.guard.state import FIND_OUT, Trip
from benchbot_robot_ros2.guard.velocity import STOPPED_PERIOD_S, GuardedVelocity, stopping

WATCH_PERIOD_S = 0.02
GUARD_DIED = Trip("The guard process died.", FIND_OUT)
GUARD_HUNG = Trip("The guard process hung.", FIND_OUT)


def watch(velocity: GuardedVelocity, connection: socket.socket, other: Peer, pid: int, ending: threading.Event) -> bool:
    """Stop the robot when the other guard, of the process `pid`, dies or hangs while it moves the robot.

    One that hangs is killed first: it could wake up and publish a velocity. Returns at the driver's end, or when the
    other guard ends with the robot at rest: True when this guard alone is left to end the run.
    """
    watched = [connection, other.connection]
    while not ending.is_set():
        ready, _, _ = select.select(watched, [], [], WATCH_PERIOD_S)
        if connection in ready and not _is_there(connection):
            watched = [other.connection]  # the other guard sees to the driver's end
        if other.listen():
            other.tell(moving=False)
        if velocity.trip is not None:
            _stop(velocity, connection, velocity.trip)
            return False
        if other.ended:
            if other.moving:
                _stop(velocity, connection, GUARD_DIED)
            return other.moving
        if other.moving and other.hangs:
            messages.tell(connection, messages.Tripped(GUARD_HUNG))
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
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
