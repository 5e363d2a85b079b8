"""The express lane of a server: a connection whose requests `express` can read is served by a thread of its own.

A step would else take a task, a thread of a pool and more turns of the event loop. A request that the thread cannot
read goes back to the HTTP server, together with the connection. It is the event loop that notices who hangs up.
"""

import asyncio
import logging
import os
import socket
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from http import HTTPStatus

from starlette.responses import Response
from uvicorn.protocols.http.h11_impl import H11Protocol

from benchbot.supervisor.http import bodies
from benchbot.supervisor.http.express import MAX_BODY_BYTES, MAX_HEAD_BYTES, Express
from benchbot.supervisor.http.hang_ups import HangUps
from benchbot.supervisor.run import Caller

MOST_CONNECTIONS = 8
"""Each that is in the lane has a thread, also while it is silent. Others are answered by the HTTP server."""
# A solution may think for hours between two steps: its connection stays open.
KEEP_ALIVE_S = 24 * 3600

Read = Callable[[bytes], Express | None]
"""Returns the request that the bytes are, or None when the HTTP server is to answer them."""

log = logging.getLogger("benchbot.supervisor")


class Lane:
    """The connections that are served by threads. For one event loop, in which everything but `close` is called."""

    def __init__(self, read: Read) -> None:
        self.read = read
        self._executor = ThreadPoolExecutor(MOST_CONNECTIONS, "benchbot-lane")
        self._hang_ups = HangUps()
        self._sockets: dict[int, socket.socket] = {}

    def enter(
        self, handle: int, serve: Callable[[socket.socket], bytes], hung_up: Callable[[], None]
    ) -> "Future[bytes] | None":
        """Serve a connection in a thread, and have `hung_up` called when its client is gone; None without room for it.

        The thread is given a socket of its own, which it closes at its end; leave the lane then.
        """
        if len(self._sockets) >= MOST_CONNECTIONS:
            return None
        connection = socket.socket(fileno=os.dup(handle))
        self._sockets[handle] = connection
        self._hang_ups.watch(handle, hung_up)
        return self._executor.submit(serve, connection)

    def forget(self, handle: int) -> None:
        """Notice no more whether the client of a connection hangs up."""
        self._hang_ups.forget(handle)

    def leave(self, handle: int) -> None:
        """Make room for another connection."""
        self.forget(handle)
        del self._sockets[handle]

    def close(self) -> None:
        """End the threads: those that wait for their clients at once, the others after the request under way."""
        for connection in list(self._sockets.values()):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        self._executor.shutdown(wait=False)
        self._hang_ups.close()


def protocol(lane: Lane) -> type[asyncio.Protocol]:
    """Return the protocol of connections that may use a lane."""
    return type("Connection", (_Connection,), {"_lane": lane})


class _Connection(H11Protocol):
    """uvicorn's connection, which answers all requests but those that are for its lane."""

    _lane: Lane
    _in_lane = False
    _under_way: tuple[Express, Caller] | None = None
    _gone = False
    _ending = False

    def data_received(self, data: bytes) -> None:
        if not self._enters_the_lane(data):
            super().data_received(data)

    def shutdown(self) -> None:
        """Close the connection, after the answer that is under way."""
        self._ending = True
        if not self._in_lane:
            super().shutdown()
        elif self._under_way is None:
            # Its thread, which waits for the next request, reads the end instead: that is no hanging up.
            self._lane.forget(self._handle)
            with suppress(OSError):
                self.transport.get_extra_info("socket").shutdown(socket.SHUT_RD)

    def _enters_the_lane(self, data: bytes) -> bool:
        """Have the lane serve this connection when it can read a request, and nothing before that is unfinished."""
        idle = self.cycle is None or self.cycle.response_complete
        if not idle or self.conn.trailing_data[0] or self.transport.get_write_buffer_size() or self._ending:
            return False
        express = self._lane.read(data)
        if express is None:
            return False
        self._handle: int = self.transport.get_extra_info("socket").fileno()
        serving = self._lane.enter(self._handle, partial(self._serve, express), self._hung_up)
        if serving is None:
            return False
        self._in_lane = True
        self.flow.pause_reading()
        self._unset_keepalive_if_required()
        serving.add_done_callback(self._served)
        return True

    def _serve(self, express: Express | None, connection: socket.socket) -> bytes:
        """Answer a request and those after it; return the first bytes that are none for the lane, where this runs."""
        received = memoryview(bytearray(MAX_HEAD_BYTES + MAX_BODY_BYTES))
        data = b""
        with connection:
            connection.settimeout(KEEP_ALIVE_S)
            while express is not None:
                data = b""
                if not self._answer(express, connection) or self._ending:
                    break
                # A client that is gone has no next request, nor has one that was silent for so long.
                with suppress(OSError):
                    data = bytes(received[: connection.recv_into(received)])
                express = self._lane.read(data)
        return data

    def _answer(self, express: Express, connection: socket.socket) -> bool:
        """Carry a request out and send the answer; say whether it was sent. In the lane."""
        caller = Caller(settles=True)
        self._under_way = express, caller
        caller.gone = self._gone
        head, body = self._message(express.answer(caller))
        self._under_way = None
        sent = _send(connection, head, body)
        express.settle()
        return sent

    def _hung_up(self) -> None:
        """Note that the client of this connection, which is in the lane, is gone."""
        self._gone = True
        under_way = self._under_way
        if under_way is not None:
            express, caller = under_way
            # Not in the lane, which is busy with the request itself, nor here: it may wait for a lock.
            self.loop.run_in_executor(None, express.hang_up, caller)

    def _served(self, serving: "Future[bytes]") -> None:
        # A loop that has ended has closed its connections, or will never do so.
        with suppress(RuntimeError):
            self.loop.call_soon_threadsafe(self._leave_the_lane, serving)

    def _leave_the_lane(self, serving: "Future[bytes]") -> None:
        """Go on without the lane, or close the connection; in the event loop."""
        self._in_lane = False
        self._lane.leave(self._handle)
        error = serving.exception()
        if error is not None:
            log.error("a request failed", exc_info=error)
            if self._under_way is not None:
                self.transport.write(b"".join(self._message(bodies.respond_mistake())))
        data = b"" if error is not None or self._ending else serving.result()
        self._under_way = None
        if not data:
            super().shutdown()
            return
        self.flow.resume_reading()
        self.data_received(data)

    def _message(self, response: Response) -> tuple[bytes, bytes]:
        """Return head and body."""
        status = HTTPStatus(response.status_code)
        lines = [b"HTTP/1.1 %d %s" % (status, status.phrase.encode("ascii"))]
        lines += [b"%s: %s" % header for header in (*self.server_state.default_headers, *response.raw_headers)]
        return b"\r\n".join((*lines, b"", b"")), bytes(response.body)


def _send(connection: socket.socket, head: bytes, body: bytes) -> bool:
    """Send an answer; say whether the client, which may be gone, could take all of it."""
    try:
        count = connection.sendmsg([head, body])
        if count < len(head) + len(body):
            connection.sendall((head + body)[count:] if count < len(head) else memoryview(body)[count - len(head) :])
    except OSError:
        return False
    return True
