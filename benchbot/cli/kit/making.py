"""Making environments of sets by several processes at once, each that is under way to its end."""

import os
import signal
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from functools import cache
from multiprocessing import get_context, parent_process
from typing import TYPE_CHECKING

from benchbot.process import processors

if TYPE_CHECKING:
    from benchbot.core.plugin_manager import Plugins

_busy = threading.Lock()


@contextmanager
def making(places: Mapping[str, tuple[str, int]]) -> Iterator[Mapping[str, "Future[None]"]]:
    """Make environments, by name a set and the number in it, by as many processes as there are processors.

    Yields what waits for each, nothing where one process is as quick. An environment that cannot be made is left:
    whoever asks for it then makes it, and is told why not. On leaving, what is under way is made to its end, and
    nothing else.
    """
    workers = min(processors(), len(places))
    if workers < 2:
        yield {}
        return
    # A pool's processes wait for ever for one that was killed.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _begin)
    try:
        yield {name: pool.submit(_make, *place) for name, place in places.items()}
    finally:
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    # Ctrl-C in the terminal is for who has started this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when the one that has started it has ended, and what is under way is made."""
    if (parent := parent_process()) is not None:
        parent.join()
        with _busy:
            os._exit(1)


def _make(name: str, number: int) -> None:
    with _busy:
        if (parent := parent_process()) is not None and parent.is_alive():
            _plugins().pool("environment_sets")[name].value.make(number)


@cache
def _plugins() -> "Plugins":
    from benchbot.core.plugin_manager import load

    return load()
