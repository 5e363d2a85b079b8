"""The recordings of a run, as it sees them: a process that writes them, behind a queue that never makes a step wait."""

import json
import logging
import math
import mmap
import os
import selectors
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import msgspec

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.progress import Progress, Step
from benchbot.core.session import Session
from benchbot.process import how_it_ended, last_words, start_module
from benchbot.supervisor import description
from benchbot.supervisor.platform.messages import Failed
from benchbot.supervisor.recording.messages import (
    DROPPED,
    ENTRY,
    HEADER_BYTES,
    HURRY_AT,
    RESET,
    RESULT,
    RUN,
    STEP,
    TOOK,
    Entry,
    Parcel,
    RecordedStep,
    Ring,
)
from benchbot.wire import arena

QUEUE_BYTES = 256 * 2**20
"""Memory is taken as the queue grows, not before."""
START_TIMEOUT_S = 60.0
FINISH_TIMEOUT_S, STALL_TIMEOUT_S, HURRY_TIMEOUT_S = 60.0, 15.0, 5.0
CLOSE_TIMEOUT_S = FINISH_TIMEOUT_S + HURRY_TIMEOUT_S
"""The longest time that finishing recordings may take; without any progress, it is given up sooner."""

LIST_FILE = "recordings.json"
"""A file in a run's folder: the folders of all recordings that it has begun, one in a line, as JSON."""

log = logging.getLogger("benchbot.supervisor")

OnEnded = Callable[[str], None]
"""Called with the reason, in words, when a recording has ended before its run."""


def recorded_folders(run_folder: Path) -> list[Path]:
    """Return the folders that a run has been recorded into, which may hold what solutions must not know."""
    try:
        return [Path(json.loads(line)) for line in (run_folder / LIST_FILE).read_text("utf-8").splitlines()]
    except (OSError, ValueError):
        return []


class Recordings:
    """Begins and finishes recordings of a session. Methods block; they may be called from several threads."""

    def __init__(self, session: Session, publish: Callable[[str, dict[str, Any]], None], folder: Path) -> None:
        self._session = session
        self._list = folder / LIST_FILE
        self._publish = publish
        self._lock = threading.Lock()
        self._hosts: list[RecorderHost] = []

    def begin(self, folders: Mapping[str, Path]) -> None:
        """Begin recorders, by name, which write into folders from the next observation on.

        Raises BenchbotError when one cannot begin; then none of them does.
        """
        if not folders:
            return
        folders = {name: folder.absolute() for name, folder in folders.items()}
        # First of all: solutions that start from now on must not see the folders.
        with self._list.open("a", encoding="utf-8") as file:
            file.writelines(f"{json.dumps(str(folder))}\n" for folder in folders.values())
        host = RecorderHost(folders, self._ended)
        host.run(self._run_document())
        host.reset()
        with self._lock:
            self._hosts.append(host)
        self._session.join(host)
        log.info("recording: %s", ", ".join(f"{name} into {folder}" for name, folder in folders.items()))

    def result(self, document: Mapping[str, Any]) -> None:
        """Pass a result on to the recorders that show results."""
        shown = {key: value for key, value in document.items() if key not in ("track", "actions")}
        for host in list(self._hosts):
            host.result(shown)

    def finish(self, folders: Collection[Path]) -> None:
        """Finish the recordings in these folders, and those that were begun with them; return when they are written."""
        with self._lock:
            finished = [host for host in self._hosts if not {*host.folders.values()}.isdisjoint(folders)]
            self._hosts = [host for host in self._hosts if host not in finished]
        for host in finished:
            self._session.leave(host)
            host.close()

    def as_list(self) -> list[dict[str, Any]]:
        """Return what is being recorded where, as JSON."""
        return [
            {"recorder": name, "folder": str(folder), "dropped": host.dropped, "ended": host.ended}
            for host in list(self._hosts)
            for name, folder in host.folders.items()
        ]

    def _run_document(self) -> dict[str, Any]:
        selection = self._session.selection
        seed = {} if selection.secret else {"seed": selection.seed}
        return {**description.selection_document(selection), **seed}

    def _ended(self, why: str) -> None:
        log.warning("%s", why)
        self._publish("recording", {"ended": why})


class RecorderHost:
    """Recordings in a process of their own (`recording.process`). It is a `Recording` that neither raises nor waits.

    A step for which the queue has no room is dropped and counted. What ends a recording early is told to `on_ended`,
    the next time that there is a step or at the end. Methods may be called from several threads. Raises BenchbotError
    when a recording cannot begin.
    """

    def __init__(self, folders: Mapping[str, Path], on_ended: OnEnded, queue_bytes: int = QUEUE_BYTES) -> None:
        self.folders = dict(folders)
        self.dropped = 0
        self._on_ended = on_ended
        self._lock = threading.Lock()
        self._ring = Ring(queue_bytes)
        self._reset_due = False
        self._finished = False
        self._said = b""
        self._silent = False
        with ExitStack() as stack:
            self._log = stack.enter_context(tempfile.TemporaryFile())
            handle = arena.create()
            stack.callback(os.close, handle)
            os.ftruncate(handle, HEADER_BYTES + queue_bytes)
            self._memory = mmap.mmap(handle, HEADER_BYTES + queue_bytes)
            self._memory[:HEADER_BYTES] = bytes(HEADER_BYTES)
            self._entries: int | None = None
            self._start(stack, handle)
            self._await("started", START_TIMEOUT_S)
            self._stack = stack.pop_all()

    @property
    def pid(self) -> int:
        """The process that writes them."""
        return self._process.pid

    @property
    def ended(self) -> bool:
        """True when it takes nothing more: it is finished, or its process has died."""
        return self._finished

    def reset(self) -> None:
        """Start over."""
        with self._lock:
            if self._finished:
                return
            self._reset_due = True
            self._count_dropped(0)
            self._send_reset()

    def step(self, action: str | None, arguments: Mapping[str, float], step: Step, progress: Progress) -> None:
        """Put one observation into the queue, or count it as dropped."""
        with self._lock:
            if self._finished:
                return
            self._listen()
            if self._silent:
                self._give_up()
            elif not (self._send_reset() and self._queue(RecordedStep(action, arguments, step, progress))):
                self._count_dropped(self.dropped + 1)

    def run(self, document: Mapping[str, Any]) -> None:
        """Put what is run into the queue, for recorders that keep it."""
        self._send_document(RUN, document)

    def result(self, document: Mapping[str, Any]) -> None:
        """Put a result into the queue, for recorders that show results; without room it is left out."""
        self._send_document(RESULT, document)

    def _send_document(self, kind: int, document: Mapping[str, Any]) -> None:
        data = json.dumps(document).encode()
        with self._lock:
            if self._finished:
                return
            place = self._ring.take(len(data))
            if place is not None:
                start = HEADER_BYTES + place
                self._memory[start : start + len(data)] = data
                if not self._send(Entry(kind, start, len(data), self.dropped)):
                    self._ring.untake()

    def close(self) -> None:
        """Finish the recordings with all that is queued; what a stuck disk does not take in time is given up."""
        with self._lock:
            if self._finished:
                return
            self._finished = True
            self._send_reset()
            self._close_entries()
            try:
                if not self._await("closed", FINISH_TIMEOUT_S, STALL_TIMEOUT_S):
                    self._memory[HURRY_AT] = 1
                    if not self._await("closed", HURRY_TIMEOUT_S):
                        self._on_ended(
                            f"The recordings in {self._folder_list()} are not finished: the disk does not answer."
                        )
            except BenchbotError as error:
                self._on_ended(f"{error.title} {error.why}")
            self._stack.close()

    def _start(self, stack: ExitStack, handle: int) -> None:
        entries, self._entries = os.pipe()
        self._replies, replies = os.pipe()
        stack.callback(os.close, self._replies)
        stack.callback(self._close_entries)
        os.set_blocking(self._entries, False)
        os.set_blocking(self._replies, False)
        given = json.dumps({name: str(folder.absolute()) for name, folder in self.folders.items()})
        module = "benchbot.supervisor.recording.process"
        try:
            handles = (entries, replies, handle)
            self._process = start_module(module, *map(str, handles), given, output=self._log, pass_fds=handles)
        finally:
            os.close(entries)
            os.close(replies)
        stack.callback(self._end)

    def _folder_list(self) -> str:
        return ", ".join(map(str, self.folders.values()))

    def _count_dropped(self, dropped: int) -> None:
        self.dropped = dropped
        DROPPED.pack_into(self._memory, 0, dropped)

    def _send_reset(self) -> bool:
        """Pass on a reset that is due; say whether none is due any more."""
        if self._reset_due:
            self._reset_due = not self._send(Entry(RESET, 0, 0, 0))
        return not self._reset_due

    def _queue(self, step: RecordedStep) -> bool:
        parcel = Parcel(step)
        place = self._ring.take(parcel.size_bytes)
        if place is None:
            return False
        parcel.write(self._memory, HEADER_BYTES + place)
        if self._send(Entry(STEP, HEADER_BYTES + place, parcel.size_bytes, self.dropped)):
            return True
        self._ring.untake()
        return False

    def _send(self, entry: Entry) -> bool:
        """Write one entry; False when there is no room for it. So short a write is whole or not there (POSIX)."""
        if self._entries is None:
            return False
        try:
            os.write(self._entries, ENTRY.pack(*entry))
        except (BlockingIOError, BrokenPipeError):
            return False
        return True

    def _close_entries(self) -> None:
        entries, self._entries = self._entries, None
        if entries is not None:
            os.close(entries)

    def _give_up(self) -> None:
        """Note that the process has died, which ends its recordings and nothing else."""
        self._finished = True
        error = self._death()
        self._on_ended(f"{error.title} {error.why}")
        self._stack.close()

    def _listen(self) -> set[str]:
        """Take in what the process has said; return the kinds of it. Raises the BenchbotError that it has sent."""
        with suppress(BlockingIOError):
            while said := os.read(self._replies, 65536):
                self._said += said
            self._silent = True
        *lines, self._said = self._said.split(b"\n")
        kinds: set[str] = set()
        for line in lines:
            if line == TOOK:
                self._ring.give_back()
                continue
            message = json.loads(line)
            kinds |= set(message)
            if "failed" in message:
                self._on_ended(message["failed"])
            elif "refused" in message:
                raise msgspec.convert(message["refused"], Failed).error()
        return kinds

    def _await(self, kind: str, timeout_s: float, stall_s: float = math.inf) -> bool:
        """Wait until the process has said something of a kind; False when it does not in time. Raises BenchbotError.

        In time is within `timeout_s`, and within `stall_s` of what it has said before.
        """
        deadline_s = time.monotonic() + timeout_s
        with selectors.DefaultSelector() as selector:
            selector.register(self._replies, selectors.EVENT_READ)
            while (left_s := deadline_s - time.monotonic()) > 0:
                if not selector.select(min(left_s, stall_s)) and left_s > stall_s:
                    return False
                if kind in self._listen():
                    return True
                if self._silent:
                    raise self._death()
        return False

    def _death(self) -> BenchbotError:
        self._end()
        how = how_it_ended(self._process.returncode)
        return BenchbotError(
            f"The recordings in {self._folder_list()} ended early.",
            f"The process that writes them {how}. {last_words(self._log)}",
            "Record again; if it happens again, report it to the author of the recorder.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        )

    def _end(self) -> None:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0 if self._finished or self._silent else 0.0)
        self._process.kill()
        self._process.wait()
