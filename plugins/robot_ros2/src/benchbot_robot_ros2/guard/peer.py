"""The other one of a pair of guards, as each of them sees it: by its signs of life, and by the state of its process."""

import os
import socket
import time
from contextlib import suppress

from benchbot.process import is_stopped
from benchbot_robot_ros2.guard import messages


class Peer:
    """The other guard, at the other end of a socket; it hangs when it is frozen or silent for `longest_silence_s`."""

    def __init__(self, connection: socket.socket, longest_silence_s: float) -> None:
        connection.setblocking(False)
        self.connection = connection
        self.moving = False
        """Whether it publishes a motion, as it said last."""
        self.ended = False
        self.longest_silence_s = longest_silence_s
        self._pid: int | None = None
        self._heard_s = time.monotonic()

    def tell(self, *, moving: bool) -> None:
        """Give it a sign of life."""
        messages.tell(self.connection, messages.Beat(os.getpid(), moving))

    def listen(self) -> bool:
        """Take in its signs of life, and return whether there were any; `ended` tells of its end from then on."""
        heard = False
        with suppress(BlockingIOError):
            while not self.ended:
                beat = messages.receive_beat(self.connection)
                if beat is None:
                    self.ended = True
                else:
                    heard, self._pid, self.moving, self._heard_s = True, beat.pid, beat.moving, time.monotonic()
        return heard

    @property
    def hangs(self) -> bool:
        """Whether it has been silent for too long, or a signal has stopped its process."""
        frozen = self._pid is not None and is_stopped(self._pid)
        return frozen or time.monotonic() - self._heard_s > self.longest_silence_s
