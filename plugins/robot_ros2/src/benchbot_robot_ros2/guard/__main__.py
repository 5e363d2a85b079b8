"""The guard: a process of its own that alone publishes a robot's velocity, and stops it when its driver dies or hangs.

Started as `python -P -m benchbot_robot_ros2.guard FD PEER_FD` by `guard.link`, in a session of its own, so that what
ends the driver, by Ctrl-C or kill -9 of its process group, leaves the guard alive to stop the robot. A second one,
joined to it by the socket PEER_FD, stands by: see `guard.standby`.
"""

import gc
import os
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from benchbot.plugin import BenchbotError
from benchbot.process import is_stopped
from benchbot_robot_ros2 import calls
from benchbot_robot_ros2.guard import messages, standby
from benchbot_robot_ros2.guard.peer import Peer
from benchbot_robot_ros2.guard.state import FIND_OUT, GuardState, Trip
from benchbot_robot_ros2.guard.velocity import STOPPED_PERIOD_S, Change, GuardedVelocity, stopping
from benchbot_robot_ros2.ramp import Velocity
from benchbot_robot_ros2.ros import running_node

if TYPE_CHECKING:
    from rclpy.node import Node

FIRST_WORD_S = 1.0
ARMED_PERIOD_S = 0.02
# Without the one that stands by the robot is still guarded, so that a busy machine has more time.
STANDBY_SILENCE_S = 1.0

DRIVER_ENDED = Trip("The robot's driver ended while the robot moved.", FIND_OUT)
DRIVER_FROZEN = Trip("The robot's driver was frozen (SIGSTOP, or Ctrl-Z) while the robot moved.", FIND_OUT)
STANDBY_DIED = Trip("The guard that stands by died.", FIND_OUT)
STANDBY_HUNG = Trip("The guard that stands by hung.", FIND_OUT)
ENDED_BY_SIGNAL = Trip("The guard process was asked to end while the robot moved.", FIND_OUT)


def main() -> None:
    """Guard the robot of the first message on the socket with the number of the first argument, until it closes."""
    ending = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: ending.set())
    with socket.socket(fileno=int(sys.argv[1])) as connection, socket.socket(fileno=int(sys.argv[2])) as peer:
        begin = messages.receive_at_guard(connection)
        if not isinstance(begin, messages.Begin):
            return
        name = "benchbot_guard" if begin.stands_by_for is None else "benchbot_guard_standby"
        with running_node(name, use_sim_time=begin.use_sim_time, graph=begin.graph) as node:
            try:
                velocity = _armed(node, begin, connection, ending)
            except BenchbotError as error:
                messages.tell(connection, messages.Refused(error.title, error.why, error.fix))
                return
            if velocity is None:
                return
            # What was imported never becomes garbage: no long collection in the middle of a motion.
            gc.collect()
            gc.freeze()
            connection.setblocking(False)
            messages.tell(connection, messages.Armed())
            if begin.stands_by_for is None:
                _guard(velocity, connection, Peer(peer, STANDBY_SILENCE_S), ending)
                calls.after(node, begin.robot, begin.after)
            else:
                other = Peer(peer, begin.safety.command_timeout_s)
                if standby.watch(velocity, connection, other, begin.stands_by_for, ending):
                    calls.after(node, begin.robot, begin.after)


def _armed(
    node: "Node", begin: messages.Begin, connection: socket.socket, ending: threading.Event
) -> GuardedVelocity | None:
    """Return the guarded velocity of a robot that listens; None at the driver's end, BenchbotError when it cannot."""
    velocity = GuardedVelocity(
        node,
        begin.command,
        begin.base_frame,
        begin.safety,
        begin.motion,
        use_sim_time=begin.use_sim_time,
        navigation=begin.navigation,
    )
    deadline_s = time.monotonic() + begin.wait_s
    if begin.stopped is not None:
        velocity.update(stopping(begin.stopped))
    while (problem := _lacking(velocity, begin)) is not None:
        if begin.stopped is not None:
            # There is a robot to stop, whether or not the driver lives on.
            time.sleep(ARMED_PERIOD_S)
        # The driver says nothing meanwhile: a readable socket is its end.
        elif select.select([connection], [], [], ARMED_PERIOD_S)[0] or ending.is_set():
            return None
        if time.monotonic() > deadline_s:
            raise problem
    velocity.listen_to_devices()
    # A switch that somebody holds takes a moment to be heard; of one that is silent the first motion tells.
    first_word_s = time.monotonic() + FIRST_WORD_S
    while velocity.dead_man_unheard and begin.stopped is None and time.monotonic() < first_word_s:
        time.sleep(ARMED_PERIOD_S)
    return velocity


def _lacking(velocity: GuardedVelocity, begin: messages.Begin) -> BenchbotError | None:
    """Return what the robot lacks to move; to be stopped, it needs to listen only."""
    enough = begin.stopped is not None and velocity.publisher.heard
    return None if enough else velocity.missing(begin.robot, begin.wait_s)


def _guard(velocity: GuardedVelocity, connection: socket.socket, other: Peer, ending: threading.Event) -> None:
    """Publish until the driver's end, and the last zeros after it."""
    driver, told, hand = os.getppid(), False, velocity.hand
    end: Trip | None = None
    watched = select.poll()
    watched.register(connection, select.POLLIN)
    # Its end alone: it answers each sign of life, and to wake up for that, and tell it so, would let neither rest.
    watched.register(other.connection, 0)
    try:
        while end is None:
            watched.poll(1000 * (ARMED_PERIOD_S if velocity.trip is None else STOPPED_PERIOD_S))
            arrived = list(_arrived(connection))
            if None in arrived:
                end = DRIVER_ENDED
            elif ending.is_set():
                end = ENDED_BY_SIGNAL
            was_there = not other.ended
            other.listen()
            if other.ended:
                if was_there:
                    watched.unregister(other.connection)
                # It outlives this process where all is well.
                velocity.update(stopping(STANDBY_DIED))
            elif velocity.moving and other.hangs:
                velocity.update(stopping(STANDBY_HUNG))
            if velocity.moving and is_stopped(driver):
                velocity.update(stopping(DRIVER_FROZEN))
            # Said before it is done, so that a death in between is that of a guard that moves the robot.
            commanded = any(
                isinstance(message, messages.Attend) or (isinstance(message, messages.Command) and message.moves)
                for message in arrived
            )
            other.tell(moving=velocity.moving or commanded)
            velocity.update(*(_change(message) for message in arrived if message is not None))
            if end is not None and velocity.moving:
                velocity.update(stopping(end))
            if velocity.hand != hand:
                hand = velocity.hand
                messages.tell(connection, messages.Hand(*hand))
            if velocity.trip is not None and not told:
                told = True
                messages.tell(connection, messages.Tripped(velocity.trip))
    finally:
        velocity.finish()
        # The other one need not see to a robot that rests, while this one calls the services of the end.
        other.tell(moving=False)


def _change(message: messages.ToGuard) -> Change:
    match message:
        case messages.Command(linear_mps, angular_radps, lateral_mps):
            return partial(_command, wanted=Velocity(linear_mps, angular_radps, lateral_mps))
        case messages.Attend():
            return GuardState.attend
        case messages.Stop(trip):
            return stopping(trip)
        case messages.Resume():
            return lambda state, _now_s: state.resume()
        case messages.Begin():
            raise ValueError("a guard begins once")


def _command(state: GuardState, now_s: float, *, wanted: Velocity) -> None:
    state.command(wanted, now_s)


def _arrived(connection: socket.socket) -> Iterator[messages.ToGuard | None]:
    """Yield what has arrived by now; None is the driver's end."""
    with suppress(BlockingIOError):
        while True:
            message = messages.receive_at_guard(connection)
            yield message
            if message is None:
                return


if __name__ == "__main__":
    main()
