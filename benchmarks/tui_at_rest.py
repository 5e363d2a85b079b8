"""The cost of `benchbot tui` in a terminal of its own when nothing changes: processor time, bytes, and first screens.

The batches are fabricated: every result has the bytes of one that was computed, and every eleventh episode has failed.
The program runs in a pseudo-terminal, whose bytes are counted as ssh would send them.
"""

import fcntl
import json
import os
import pty
import select
import shutil
import signal
import statistics
import struct
import sys
import tempfile
import termios
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Self

import psutil

from benchmarks.bench_batches import SAMPLE, SAMPLE_PLUGIN, fabricate, submit

COLUMNS, LINES = 120, 40
REST_S = 15.0
SETTLING_S = 15.0
"""After the first screen, until everything that is read once has been read."""
FIRST_TIMEOUT_S = 300.0
FAILED_EVERY = 11
ASKED, ANSWER = b"\x1b[c", b"\x1b[?62;22c"
"""Which terminal is it; one with colours and without pictures (https://vt100.net/docs/vt510-rm/DA1.html)."""
STARTS = 7
RUN = "semantic_slam:passive:ground_truth:segmentation", "carter", "miniroom:1"
FRAMES = 40
KEYS, KEY_ROUNDS = ("j", "f", "k", "b", "m", "j", "m", "m", "b"), 4


@dataclass(frozen=True)
class Figure:
    """One measured figure in its unit."""

    what: str
    value: float
    unit: str


class Terminal:
    """`benchbot tui` in a pseudo-terminal that answers what it is, as all that people use do, or never answers."""

    def __init__(self, *words: str, answers: bool = True) -> None:
        self._answers = answers
        self._began_s = time.monotonic()
        self.pid, self._handle = pty.fork()
        if self.pid == 0:
            environment = {**os.environ, "TERM": "xterm-256color", "COLORTERM": "truecolor"}
            os.execve(sys.executable, [sys.executable, "-m", "benchbot", "tui", *words], environment)
        fcntl.ioctl(self._handle, termios.TIOCSWINSZ, struct.pack("HHHH", LINES, COLUMNS, 0, 0))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        os.close(self._handle)

    def press(self, key: str) -> None:
        """Type a key; times count from now on."""
        self._began_s = time.monotonic()
        os.write(self._handle, key.encode())

    def until(self, text: str) -> float:
        """Return the seconds from the last key, or the start, until the screen has shown a text."""
        seen = b""
        while text.encode() not in seen:
            if time.monotonic() - self._began_s > FIRST_TIMEOUT_S:
                raise SystemExit(f"{text!r} is not on the screen after {FIRST_TIMEOUT_S:g} s")
            seen = seen[-200_000:] + self._read(0.05)
        return time.monotonic() - self._began_s

    @property
    def used_s(self) -> float:
        """The processor seconds that it has taken so far."""
        times = psutil.Process(self.pid).cpu_times()
        return float(times.user + times.system)

    def answers(self, key: str) -> tuple[float, float]:
        """Type a key; return the milliseconds until something new is on the screen, and those of the processor."""
        before_s = self.used_s
        self.press(key)
        while not self._read(0.05) and time.monotonic() - self._began_s < FIRST_TIMEOUT_S:
            pass
        took_s = time.monotonic() - self._began_s
        while self._read(0.2):
            pass
        return 1e3 * took_s, 1e3 * (self.used_s - before_s)

    def rest(self, duration_s: float) -> tuple[float, float]:
        """Return the used share of a core in percent, and the bytes per second, for so long."""
        process = psutil.Process(self.pid)
        before, began_s, count = process.cpu_times(), time.monotonic(), 0
        while time.monotonic() - began_s < duration_s:
            count += len(self._read(0.2))
        after, passed_s = process.cpu_times(), time.monotonic() - began_s
        used_s = after.user + after.system - before.user - before.system
        return 100 * used_s / passed_s, count / passed_s

    def _read(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self._handle], [], [], timeout_s)
        read = os.read(self._handle, 1 << 16) if ready else b""
        if self._answers and ASKED in read:
            os.write(self._handle, ANSWER)
        return read


def measure(batches: int, episodes: int, opened: int) -> list[Figure]:
    """Return the figures of home with finished batches of so many episodes, and of one of `opened` episodes."""
    sys.path.insert(0, str(SAMPLE_PLUGIN))
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(SAMPLE_PLUGIN), os.environ.get("PYTHONPATH")]))
    with tempfile.TemporaryDirectory(prefix="bb-rest-") as name:
        os.environ["BENCHBOT_STATE_DIR"] = f"{name}/state"
        folder = Path(name)
        submit(folder, SAMPLE, 0)
        result = (folder / "result.json").read_bytes()
        _register(_with_failures(fabricate(folder / "batch-00", episodes, result)))
        for number in range(1, batches):
            shutil.copytree(folder / "batch-00", folder / f"batch-{number:02}", copy_function=os.link)
            _register(folder / f"batch-{number:02}")
        figures = []
        with Terminal():
            pass
        starts: dict[tuple[bool, str], list[float]] = {
            (answers, place): [] for answers in (True, False) for place in ("", ", processor time")
        }
        for _ in range(STARTS):
            for answers in (True, False):
                with Terminal(answers=answers) as terminal:
                    starts[answers, ""].append(terminal.until(f"batch-{0:02}"))
                    starts[answers, ", processor time"].append(terminal.used_s)
        for (answers, place), taken in starts.items():
            where = "" if answers else ", of a terminal that never answers"
            figures.append(Figure(f"first screen of home{where}{place}", statistics.median(taken), "s"))
        with Terminal() as terminal:
            terminal.until(f"batch-{0:02}")
            terminal.rest(SETTLING_S)
            share, rate = terminal.rest(REST_S)
        figures += [Figure("idle home", share, "% of a core"), Figure("idle home", rate, "B/s")]
        _register(_with_failures(fabricate(folder / "opened", opened, result)))
        for kind in ("first", "warm"):
            with Terminal() as terminal:
                terminal.until("opened")
                terminal.rest(SETTLING_S)
                before_s = terminal.used_s
                terminal.press("\r")
                took_s = terminal.until(f"OF {opened} FAILED")
                what = f"from Enter to a whole screen of {opened} episodes, {kind}"
                figures.append(Figure(what, took_s, "s"))
                figures.append(Figure(f"{what}, processor time", terminal.used_s - before_s, "s"))
                terminal.rest(SETTLING_S)
                share, rate = terminal.rest(REST_S)
                keys = [terminal.answers(key) for key in KEYS * KEY_ROUNDS]
        for row, what in enumerate(("", ", processor time")):
            figures.append(Figure(f"a key of that screen{what}", statistics.median(each[row] for each in keys), "ms"))
            figures.append(Figure(f"a key of that screen, the slowest{what}", max(each[row] for each in keys), "ms"))
        return [*figures, Figure("finished batch", share, "% of a core"), Figure("finished batch", rate, "B/s")]


def of_a_run() -> list[Figure]:
    """Return the bytes and processor time of watching a ray-traced run that steps once a second, in half cells."""
    from benchbot.api.client import Client
    from benchbot.core.request import RunRequest
    from benchbot.supervisor.backend import Backend

    with Backend.start(RunRequest(*RUN)) as backend, ThreadPoolExecutor(1) as beside:
        client = Client(backend.state.connection)
        client.reset()
        with Terminal(f"--run={backend.state.name}") as terminal:
            terminal.until("Camera")
            terminal.rest(SETTLING_S / 3)
            seconds = []
            for _ in range(FRAMES):
                step = beside.submit(client.step, "move_next", {})
                seconds.append(terminal.rest(1.0))
                step.result()
    shares, rates = zip(*seconds, strict=True)
    said = "watching a run of a frame a second"
    return [
        Figure(said, statistics.mean(rates) / 1e3, "kB/s"),
        Figure(f"{said}, the most in a second", max(rates) / 1e3, "kB/s"),
        Figure(f"{said}, processor", statistics.mean(shares), "% of a core"),
    ]


def _with_failures(path: Path) -> Path:
    """Have every eleventh episode of a fabricated batch failed, and write down the events of its worker."""
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.attempts import JOURNAL

    events = []
    for number, episode in enumerate(plans.read(path / "plan.json").episodes):
        failure = "agent" if number % FAILED_EVERY == 0 else None
        told = {"time_s": number, "who": "w", "key": episode.key}
        events += [{**told, "what": "began"}, {**told, "what": "finished", "failure": failure, "duration_s": 1.0}]
        if failure is not None:
            journal = path / "episodes" / episode.name / JOURNAL
            journal.write_text(journal.read_text("utf-8").replace('"failure": null', '"failure": "agent"'), "utf-8")
    (path / "events").mkdir(exist_ok=True)
    (path / "events" / "w.jsonl").write_text("".join(f"{json.dumps(event)}\n" for event in events), "utf-8")
    return path


def _register(path: Path) -> None:
    """Put a batch into the register of this user, without a driver."""
    place = Path(os.environ["BENCHBOT_STATE_DIR"]) / "batches"
    place.mkdir(parents=True, exist_ok=True)
    entry = {"folder": str(path), "begun_s": time.time(), "driver": None}
    (place / f"{sha256(str(path).encode()).hexdigest()[:16]}.json").write_text(json.dumps(entry), "utf-8")
