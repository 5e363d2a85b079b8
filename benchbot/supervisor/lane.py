"""The express lane of a server: what `express` can read goes past the HTTP server, to one thread and straight back.

A step would else take a task, a thread of a pool and more turns of the event loop. That one still reads every
connection, so that it notices when a client hangs up.
"""

import asyncio
import logging
import os
import socket
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from http import HTTPStatus

from starlette.responses import Response
from uvicorn.protocols.http.h11_impl import H11Protocol

from benchbot.supervisor import bodies
from benchbot.supervisor.express import Express
from benchbot.supervisor.run import Caller

Read = Callable[[bytes], Express | None]
"""Returns the request that the bytes are, or None when the HTTP server is to answer them."""

log = logging.getLogger("benchbot.supervisor")


class Lane:
    """A thread that answers one request at a time: there is one robot."""

    def __init__(self, read: Read) -> None:
        self.read = read
        self._free = threading.Semaphore()
        self._executor = ThreadPoolExecutor(1, "benchbot-lane")

    def begin(self, work: Callable[[], None]) -> "Future[None] | None":
        """Have the thread do the work, which calls `free` at its end; None when another one is under way."""
        return self._executor.submit(work) if self._free.acquire(blocking=False) else None

    def free(self) -> None:
        """Let the next one begin."""
        self._free.release()

    def close(self) -> None:
        """End the thread after what it does."""
        self._executor.shutdown(wait=False)


def protocol(lane: Lane) -> type[asyncio.Protocol]:
    """Return the protocol of connections that may use a lane."""
    return type("Connection", (_Connection,), {"_lane": lane})


class _Connection(H11Protocol):
    """uvicorn's connection, which answers all requests but those that its lane takes.

    While one of those is under way, nothing else of this connection is looked at but its end.
    """

    _lane: Lane
    _sending: socket.socket | None = None
    _under_way: tuple[Express, Caller] | None = None
    _early = b""
    _ending = False
    _lost = False

    def data_received(self, data: bytes) -> None:
        if self._under_way is not None:
            self._early += data
            self.flow.pause_reading()
            if self._under_way is None:
                self._go_on()
        elif not self._takes_the_lane(data):
            super().data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._lost = True
        if self._under_way is not None:
            express, caller = self._under_way
            # Not in the lane, which is busy with the request itself, nor here: it may wait for a lock.
            self.loop.run_in_executor(None, express.hang_up, caller)
        elif self._sending is not None:
            self._sending.close()
        super().connection_lost(exc)

    def shutdown(self) -> None:
        """Close the connection, after the answer that is under way."""
        self._ending = True
        if self._under_way is None:
            super().shutdown()

    def _takes_the_lane(self, data: bytes) -> bool:
        """Have the lane answer a request when it can, and when nothing before it is unfinished."""
        idle = self.cycle is None or self.cycle.response_complete
        if not idle or self.conn.trailing_data[0] or self.transport.get_write_buffer_size() or self._ending:
            return False
        express = self._lane.read(data)
        if express is None:
            return False
        if self._sending is None:
            # A descriptor of its own: the transport may close its one while the answer is being sent.
            self._sending = socket.socket(fileno=os.dup(self.transport.get_extra_info("socket").fileno()))
        caller = Caller()
        self._under_way = express, caller
        answering = self._lane.begin(partial(self._answer, express, caller, self._sending))
        if answering is None:
            self._under_way = None
            return False
        answering.add_done_callback(self._answered)
        self._unset_keepalive_if_required()
        return True

    def _answer(self, express: Express, caller: Caller, sending: socket.socket) -> None:
        """Send the answer as far as the connection takes it at once; the event loop sends the rest. In the lane."""
        try:
            rest = _send(sending, *self._message(express.answer(caller)))
        finally:
            self._lane.free()
        if rest:
            self._in_loop(rest)
            return
        self._under_way = None
        if self._early or self._ending or self._lost:
            self._in_loop(b"")

    def _answered(self, answering: "Future[None]") -> None:
        error = answering.exception()
        if error is not None:
            log.error("a request failed", exc_info=error)
            self._ending = True
            self._in_loop(b"".join(self._message(bodies.respond_mistake())))

    def _message(self, response: Response) -> tuple[bytes, bytes]:
        """Return head and body."""
        status = HTTPStatus(response.status_code)
        lines = [b"HTTP/1.1 %d %s" % (status, status.phrase.encode("ascii"))]
        lines += [b"%s: %s" % header for header in (*self.server_state.default_headers, *response.raw_headers)]
        return b"\r\n".join((*lines, b"", b"")), bytes(response.body)

    def _in_loop(self, rest: bytes | memoryview) -> None:
        # A loop that has ended has closed its connections, or will never do so.
        with suppress(RuntimeError):
            self.loop.call_soon_threadsafe(self._finish, rest)

    def _finish(self, rest: bytes | memoryview) -> None:
        """End a request of the lane, in the event loop."""
        if rest and not self._lost:
            self.transport.write(rest)
        self._under_way = None
        self._go_on()

    def _go_on(self) -> None:
        """Do what has waited for the end of a request."""
        early, self._early = self._early, b""
        if self._lost:
            if self._sending is not None:
                self._sending.close()
        elif self._ending:
            super().shutdown()
        else:
            self.flow.resume_reading()
            if early:
                self.data_received(early)


def _send(connection: socket.socket, head: bytes, body: bytes) -> bytes | memoryview:
    """Send what a connection takes at once, and return the rest."""
    try:
        count = connection.sendmsg([head, body])
    except BlockingIOError:
        count = 0
    except OSError:
        # The client is gone, as the event loop notices too.
        return b""
    return memoryview(body)[count - len(head) :] if count >= len(head) else head[count:] + body
