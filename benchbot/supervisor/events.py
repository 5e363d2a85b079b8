"""Events of a run, for those who watch it: published from any thread, consumed by asynchronous subscribers."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

QUEUE_LENGTH = 256


@dataclass(frozen=True)
class Event:
    """Something that happened: `step`, `scene`, `failure`, `result`, `progress` or `closed`, and its details."""

    kind: str
    data: dict[str, Any]


class Events:
    """A broadcast. A subscriber that falls too far behind loses the newest events, never the publisher's time."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscribers: set[tuple[asyncio.AbstractEventLoop, asyncio.Queue[Event]]] = set()

    def publish(self, kind: str, data: dict[str, Any]) -> None:
        """Tell every subscriber."""
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


def _put(queue: asyncio.Queue[Event], event: Event) -> None:
    if not queue.full():
        queue.put_nowait(event)
