"""Times of the spans of a Python process, for `bench_demo`: every Python that finds this folder on its path takes them.

A span is a call of a function that BENCHMARK_SPANS names, or an import. What passes within one is its own, but for the
spans inside it. The process writes them into BENCHMARK_SPANS_FOLDER when it ends.
"""

import atexit
import functools
import importlib
import importlib.machinery
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

IMPORTS = "imports"
READING = time.perf_counter(), time.process_time()


class Clock(threading.local):
    """The spans that a thread is in, the innermost last: the seconds, and those of its processor, that others had."""

    def __init__(self) -> None:
        self.stack: list[list[float]] = []
        self.importing = False


_clock = Clock()
_lock = threading.Lock()
_totals: dict[str, list[float]] = {}


@contextmanager
def span(label: str) -> Iterator[None]:
    """Add the time within to that of a label."""
    inner = [0.0, 0.0]
    _clock.stack.append(inner)
    start = time.perf_counter(), time.thread_time()
    try:
        yield
    finally:
        taken = [time.perf_counter() - start[0], time.thread_time() - start[1]]
        _clock.stack.pop()
        if _clock.stack:
            for column, seconds in enumerate(taken):
                _clock.stack[-1][column] += seconds
        with _lock:
            total = _totals.setdefault(label, [0, 0.0, 0.0])
            total[0] += 1
            total[1] += taken[0] - inner[0]
            total[2] += taken[1] - inner[1]


def timed(function: Callable[..., Any], label: str) -> Callable[..., Any]:
    """Return a function of which each call is a span."""

    @functools.wraps(function)
    def within(*arguments: Any, **named: Any) -> Any:
        with span(label):
            return function(*arguments, **named)

    return within


def replace(module: ModuleType, functions: dict[str, str]) -> None:
    """Time functions of a module; `Class.method` names methods. One that is not there is said on stderr."""
    for name, label in functions.items():
        *outer, last = name.split(".")
        try:
            owner = functools.reduce(getattr, outer, module)
            found = vars(owner)[last]
        except (AttributeError, KeyError):
            sys.stderr.write(f"bench_demo: {module.__name__} has no {name}\n")
            continue
        method = getattr(found, "__func__", None)  # of a class, not of its objects
        setattr(owner, last, timed(found, label) if method is None else type(found)(timed(method, label)))


def hook(spans: dict[str, dict[str, str]]) -> None:
    """Time the functions of modules as soon as these are imported, and all imports."""
    loaders: Any = importlib.machinery.SourceFileLoader
    imports: Any = importlib.import_module("_frozen_importlib")
    execute, find = loaders.exec_module, imports._find_and_load

    def exec_module(loader: Any, module: ModuleType) -> None:
        execute(loader, module)
        replace(module, spans.get(module.__name__, {}))

    def find_and_load(name: str, import_: Any) -> Any:
        if _clock.importing:
            return find(name, import_)
        _clock.importing = True
        try:
            with span(IMPORTS):
                return find(name, import_)
        finally:
            _clock.importing = False

    loaders.exec_module, imports._find_and_load = exec_module, find_and_load


def write(folder: Path) -> None:
    """Write the spans of this process into a file of its own."""
    started_s = _since_start_s()
    document = {
        "command": sys.orig_argv,
        "wall_s": started_s,
        "processor_s": time.process_time(),
        "start": [1, started_s - (time.perf_counter() - READING[0]), READING[1]],
        "spans": _totals,
    }
    (folder / f"{os.getpid()}.json").write_text(json.dumps(document), encoding="utf-8")


def _since_start_s() -> float:
    """Return the seconds since the kernel started this process."""
    ticks = int(Path("/proc/self/stat").read_text("ascii").rpartition(")")[2].split()[19])
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")


if "BENCHMARK_SPANS" in os.environ:
    hook(json.loads(os.environ["BENCHMARK_SPANS"]))
    atexit.register(write, Path(os.environ["BENCHMARK_SPANS_FOLDER"]))
