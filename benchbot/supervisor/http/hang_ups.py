"""Noticing that the other end of a connection is gone, without reading what has come before (epoll(7); Linux only)."""

import asyncio
import select
from collections.abc import Callable


class HangUps:
    """Connections that somebody else reads: who hangs up is told of once, in the event loop.

    What merely arrives on them wakes nobody. Call everything in the event loop but `close`, which is for after it.
    """

    def __init__(self) -> None:
        self._epoll = select.epoll()
        self._told: dict[int, Callable[[], None]] = {}

    def watch(self, handle: int, tell: Callable[[], None]) -> None:
        """Have `tell` called when the other end of a socket closes it, or stops sending, or is gone already."""
        if not self._told:
            asyncio.get_running_loop().add_reader(self._epoll.fileno(), self._look)
        self._told[handle] = tell
        # Without edges, a connection that is gone would keep the event loop awake.
        self._epoll.register(handle, select.EPOLLRDHUP | select.EPOLLET)

    def forget(self, handle: int) -> None:
        """Tell no more of a socket; do so before it is closed."""
        if self._told.pop(handle, None) is not None:
            self._epoll.unregister(handle)

    def close(self) -> None:
        """Let go of all of them."""
        self._epoll.close()

    def _look(self) -> None:
        for handle, _ in self._epoll.poll(0):
            self._told[handle]()
