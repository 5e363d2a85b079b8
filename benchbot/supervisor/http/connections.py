"""Connections of the server: deadlines for what a client has begun, and a bound on how many there are."""

import asyncio
import socket
import struct
import time
from contextlib import suppress
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from benchbot.supervisor.http.access import OPERATOR

HEAD_DEADLINE_S = 10.0
"""A head takes milliseconds; what takes longer is a client that keeps a connection from others (slowloris)."""
ANSWER_DEADLINE_S = 60.0
"""The time to take an answer that does not fit into the buffers between here and the client."""
MOST_CONNECTIONS = 256
BACKLOG = 128
"""The number of connections that are accepted at once, before any of them can be closed for another."""
# unix(7), and on macOS, which has another way to ask, unix(4): SOL_LOCAL, LOCAL_PEERPID.
_PEER = (socket.SOL_SOCKET, socket.SO_PEERCRED, 12) if hasattr(socket, "SO_PEERCRED") else (0, 2, 4)


class BoundedProtocol(H11Protocol):
    """HTTP/1.1, where a client is disconnected that does not go on with what it has begun: a request, or reading.

    After an answer it may be silent for as long as it likes: a solution thinks. Where there are too many connections,
    one without a request is closed, that which has been silent for the longest and is not the operator's, so that an
    operator can always end a run.
    """

    def connection_made(self, transport: Any) -> None:
        """Wait for the first head; close another connection where this one is too much."""
        super().connection_made(transport)
        taken = transport.get_extra_info("socket")
        if taken.family == socket.AF_UNIX:
            # The number of the process in the place of a port, where the system tells.
            with suppress(OSError):
                self.client = ("", struct.unpack_from("i", taken.getsockopt(*_PEER))[0])
        self._heard_s = time.monotonic()
        self._deadline: asyncio.TimerHandle | None = None
        self._aborted = False
        self._await(HEAD_DEADLINE_S)
        # One that is closed stays in the list until the event loop comes to it.
        there = [one for one in self.connections if isinstance(one, BoundedProtocol) and not one._aborted]
        idle = [one for one in there if one.is_idle and not one._is_operators]
        if len(there) > MOST_CONNECTIONS and idle:
            min(idle, key=lambda one: one._heard_s)._abort()

    def data_received(self, data: bytes) -> None:
        """Read on, and wait for the rest of what this has begun."""
        self._heard_s = time.monotonic()
        super().data_received(data)
        self._await_rest()

    def on_response_complete(self) -> None:
        """Go on to the next request; of one that was answered before its end, wait for the rest."""
        super().on_response_complete()
        self._await_rest()

    def pause_writing(self) -> None:
        """Wait for the client to read."""
        super().pause_writing()
        self._await(ANSWER_DEADLINE_S)

    def resume_writing(self) -> None:
        """Write on."""
        super().resume_writing()
        self._await_rest()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        super().connection_lost(exc)
        self._await_nothing()

    @property
    def is_idle(self) -> bool:
        """Whether no request is worked on, but maybe one has begun, or the rest of an answered one is on its way."""
        return self.cycle is None or self.cycle.response_complete

    @property
    def _is_operators(self) -> bool:
        return self.scope is not None and bool(self.scope["state"].get(OPERATOR))

    def _await_rest(self) -> None:
        begun = self.is_idle and (self.conn.trailing_data[0] or self.conn.their_state is h11.SEND_BODY)
        if begun or self.flow.write_paused:
            self._await(HEAD_DEADLINE_S)
        else:
            self._await_nothing()

    def _await(self, patience_s: float) -> None:
        """Disconnect after a while; what comes bit by bit meanwhile puts that off no further."""
        if self._deadline is None:
            self._deadline = asyncio.get_running_loop().call_later(patience_s, self._abort)

    def _abort(self) -> None:
        self._aborted = True
        self.transport.abort()

    def _await_nothing(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
