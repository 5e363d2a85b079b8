"""The conformance of executors."""

import re
import secrets
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding
from benchbot.core.light_records import Executor
from benchbot.core.records import Resources, Workers, WorkOrder
from benchbot.plugins.authoring.conformance.bench import find_record
from benchbot.plugins.authoring.conformance.properties import Violation, check_property, environment_variables

VARIABLE = "BENCHBOT_TESTING_MARK"
WORKER = f"""\
import os, pathlib, signal, sys, time

folder, name = pathlib.Path(sys.argv[1]), sys.argv[3]

def end(*_):
    (folder / "asked" / name).touch()
    sys.exit(0)

signal.signal(signal.SIGTERM, end)
for known in ("started", "asked"):
    (folder / known).mkdir(exist_ok=True)
(folder / "started" / name).write_text(os.environ.get("{VARIABLE}", ""))
while not (folder / "finish").exists():
    time.sleep(0.05)
"""
"""A worker that says that it runs, and ends when it is asked to, or when there is a file `finish`."""

NAME = re.compile(r"[A-Za-z0-9._-]+")


def check_executor(
    executor: Executor | str,
    *,
    shared_folder: Path | None = None,
    options: Mapping[str, str] | None = None,
    patience_s: float = 60.0,
    only: Collection[str] = (),
) -> list[Finding]:
    """Return findings on whether an executor does as its hook asks, by small workers that need nothing.

    `shared_folder` is one that all its workers can write to (by default in the folder of temporary files), `options`
    are what it needs to know. A worker has to start or end within `patience_s` seconds. `only` names the properties to
    check, by default all.
    """
    record = find_record("executors", executor)
    properties: dict[str, Callable[[_Trial], str]] = {
        "launch": _launches,
        "names": _names_its_workers,
        "environment": _passes_on_the_environment,
        "workers that end": _notices_ends,
        "attach": _attaches,
        "stop": _stops,
        "a reference to nothing left": _attaches_to_ended_workers,
        "unknown options": _refuses_unknown_options,
    }
    findings = []
    for subject, holds in properties.items():
        if not only or subject in only:
            with tempfile.TemporaryDirectory(prefix="benchbot-testing-", dir=shared_folder) as folder:
                trial = _Trial(record, Path(folder), options or {}, patience_s)
                findings.append(check_property(subject, partial(holds, trial)))
    return findings


class _Trial:
    """Launches of workers in one folder."""

    def __init__(self, executor: Executor, folder: Path, options: Mapping[str, str], patience_s: float) -> None:
        self.executor = executor
        self.folder = folder
        self.options = options
        self.patience_s = patience_s
        (folder / "worker.py").write_text(WORKER, encoding="utf-8")
        # An executor may use this file to tell whether a machine sees the folder.
        (folder / "plan.json").write_text("{}", encoding="utf-8")

    @contextmanager
    def launched(self, count: int) -> Iterator[Workers]:
        """Launch workers and wait until they run; end them, whatever happens."""
        wanted = len(self.names("started")) + count
        workers = self.executor.launch(self.order(count, self.options))
        try:
            self.wait(
                lambda: len(self.names("started")) >= wanted,
                f"Some of {count} workers did not start",
                "Run `[*order.command, '--name', NAME]` for each of order.count workers.",
            )
            yield workers
        finally:
            (self.folder / "finish").touch()
            workers.stop()

    def order(self, count: int, options: Mapping[str, str]) -> WorkOrder:
        """Return the order of so many workers."""
        command = (sys.executable, str(self.folder / "worker.py"), str(self.folder))
        return WorkOrder(self.folder, command, count, Resources(), options)

    def names(self, event: str) -> list[str]:
        """Return the names of the workers that have `started`, or were `asked` to end."""
        folder = self.folder / event
        return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []

    def wait(self, condition: Callable[[], bool], otherwise: str, fix: str) -> None:
        """Wait for a condition; raises `Violation` when it does not come true."""
        deadline_s = time.monotonic() + self.patience_s
        while not condition():
            if time.monotonic() > deadline_s:
                raise Violation(f"{otherwise} within {self.patience_s:g} s.", fix)
            time.sleep(0.05)

    def wait_for_end(self, workers: Workers, otherwise: str, fix: str) -> None:
        """Wait until no worker is alive."""
        self.wait(lambda: workers.alive() == 0, otherwise, fix)


def _launches(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        if not isinstance(workers.reference, str) or not workers.reference:
            raise Violation(f"Its reference is {workers.reference!r}.", "Return text that attach() can find them by.")
        alive, started = workers.alive(), len(trial.names("started"))
        if alive != 2:
            raise Violation(f"alive() is {alive} while two workers run.", "Count those that run or wait to run.")
        if started > 2:
            raise Violation(f"{started} workers started, not two.", "Start order.count workers.")
    return "two workers"


def _names_its_workers(trial: _Trial) -> str:
    with trial.launched(2):
        pass
    (trial.folder / "finish").unlink()
    with trial.launched(1):
        names = trial.names("started")
    for name in names:
        if not NAME.fullmatch(name):
            raise Violation(f"A worker is called {name!r}.", "Use letters, digits, '-', '_' and '.' in names.")
    return ", ".join(names)


def _passes_on_the_environment(trial: _Trial) -> str:
    mark = secrets.token_hex(4)
    with environment_variables(**{VARIABLE: mark}), trial.launched(1):
        trial.wait(
            lambda: [path.read_text("utf-8") for path in (trial.folder / "started").iterdir()] == [mark],
            "The worker does not have a variable of the driver",
            "Start workers in the environment of the driver.",
        )
    return "handed on"


def _notices_ends(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        (trial.folder / "finish").touch()
        trial.wait_for_end(workers, "alive() is not zero though all have ended", "Count what really runs: no zombies.")
    return "not alive any more"


def _attaches(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        attached = trial.executor.attach(workers.reference)
        if attached.alive() != 2:
            raise Violation(
                f"attach() finds {attached.alive()} of two running workers.",
                "Let reference say enough to find them again.",
            )
        attached.stop()
        trial.wait_for_end(workers, "They run on after stop() of the attached", "End all of them in stop().")
    return "found again, and stopped"


def _stops(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        workers.stop()
        trial.wait_for_end(workers, "They run on after stop()", "End all of them in stop().")
        trial.wait(
            lambda: trial.names("asked") == trial.names("started"),
            "Workers were ended without a SIGTERM first",
            "Send SIGTERM, wait for some seconds, and only then SIGKILL.",
        )
        workers.stop()
    return "in order, and safe to repeat"


def _attaches_to_ended_workers(trial: _Trial) -> str:
    with trial.launched(1) as workers:
        reference = workers.reference
    ended = trial.executor.attach(reference)
    trial.wait_for_end(ended, "What is gone counts as alive", "Count in alive() what really runs.")
    ended.stop()
    return "not alive, and stop() does nothing"


def _refuses_unknown_options(trial: _Trial) -> str:
    try:
        workers = trial.executor.launch(trial.order(1, {**trial.options, "no_such_option": "1"}))
    except BenchbotError as error:
        return error.title
    (trial.folder / "finish").touch()
    workers.stop()
    raise Violation("It takes an option 'no_such_option'.", "Raise BenchbotError, naming the options that there are.")
