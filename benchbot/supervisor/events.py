"""Events of a run, for those who watch it: published from any thread, sent to clients as server-sent events."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import msgspec

QUEUE_LENGTH = 256
PROGRESS_PERIOD_S = 0.1
HEARTBEAT_S = 15.0


@dataclass(frozen=True)
class Event:
    """Something that happened: `step`, `scene`, `failure`, `result`, `progress` or `closed`, and its details."""

    kind: str
    data: dict[str, Any]

    def encoded(self) -> bytes:
        """Return it as a server-sent event (https://html.spec.whatwg.org/multipage/server-sent-events.html)."""
        return b"event: %s\ndata: %s\n\n" % (self.kind.encode(), msgspec.json.encode(self.data))


class Events:
    """A broadcast. A subscriber that falls too far behind loses the newest events; the publisher never waits."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscribers: set[tuple[asyncio.AbstractEventLoop, asyncio.Queue[Event]]] = set()

    def publish(self, kind: str, data: dict[str, Any]) -> None:
        """Put an event into the queue of every subscriber."""
        event = Event(kind, data)
        with self._lock:
            for loop, queue in self._subscribers:
                loop.call_soon_threadsafe(_put, queue, event)

    @contextmanager
    def subscribed(self) -> Iterator[asyncio.Queue[Event]]:
        """Yield a queue that receives what is published meanwhile. Call it inside a running event loop."""
        subscriber = (asyncio.get_running_loop(), asyncio.Queue[Event](QUEUE_LENGTH))
        with self._lock:
            self._subscribers.add(subscriber)
        try:
            yield subscriber[1]
        finally:
            with self._lock:
                self._subscribers.remove(subscriber)


async def stream(events: Events, current_progress: Callable[[], dict[str, Any]]) -> AsyncIterator[bytes]:
    """Yield server-sent events until `closed`: each at once, changed progress at most ten times a second."""
    shown: dict[str, Any] = {}
    sent_s = time.monotonic()
    with events.subscribed() as queue:
        while True:
            progress = current_progress()
            # Time passes by itself: that alone is no news.
            news = {key: value for key, value in progress.items() if key != "wall_time_s"}
            if news != shown:
                shown, sent_s = news, time.monotonic()
                yield Event("progress", progress).encoded()
            tick_s = time.monotonic() + PROGRESS_PERIOD_S
            while (left_s := tick_s - time.monotonic()) > 0:
                try:
                    event = await asyncio.wait_for(queue.get(), left_s)
                except TimeoutError:
                    break
                sent_s = time.monotonic()
                yield event.encoded()
                if event.kind == "closed":
                    return
            if time.monotonic() - sent_s > HEARTBEAT_S:
                sent_s = time.monotonic()
                yield b": still here\n\n"


def _put(queue: asyncio.Queue[Event], event: Event) -> None:
    if not queue.full():
        queue.put_nowait(event)
