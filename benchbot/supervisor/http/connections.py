"""Connections of the server: a deadline for the head of a request, and a bound on how many there are."""

import asyncio
import time
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_DEADLINE_S = 10.0
"""A head takes milliseconds; what takes longer is a client that keeps a connection from others (slowloris)."""
MOST_CONNECTIONS = 256


class BoundedProtocol(H11Protocol):
    """HTTP/1.1, where a client that has connected, or begun a request, is disconnected when its head does not come.

    After an answer it may be silent for as long as it likes: a solution thinks. Where there are too many connections,
    the one that has been silent for the longest is closed, so that an operator can always end a run.
    """

    def connection_made(self, transport: Any) -> None:
        """Wait for the first head; close another connection where this one is too much."""
        super().connection_made(transport)
        self._heard_s = time.monotonic()
        self._deadline: asyncio.TimerHandle | None = None
        self._await_head()
        idle = [one for one in self.connections if isinstance(one, BoundedProtocol) and one.is_idle]
        if len(self.connections) > MOST_CONNECTIONS and idle:
            min(idle, key=lambda one: one._heard_s).transport.abort()

    def data_received(self, data: bytes) -> None:
        """Read on, and wait for the rest of a head of which this was not all."""
        self._heard_s = time.monotonic()
        super().data_received(data)
        if not self.is_idle or not self.conn.trailing_data[0]:
            self._await_nothing()
        elif self._deadline is None:
            self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._await_nothing()
        super().connection_lost(exc)

    @property
    def is_idle(self) -> bool:
        """Whether there is no request, but maybe the beginning of one."""
        return self.conn.their_state is h11.IDLE

    def _await_head(self) -> None:
        self._deadline = asyncio.get_running_loop().call_later(HEAD_DEADLINE_S, self.transport.abort)

    def _await_nothing(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
