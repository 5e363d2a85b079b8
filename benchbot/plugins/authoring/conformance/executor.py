"""The conformance of executors."""

import os
import re
import secrets
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding
from benchbot.core.records import Executor, Resources, Workers, WorkOrder
from benchbot.plugins.authoring.conformance.properties import Wrong, look

WORKER = """\
import os, pathlib, signal, sys, time

folder, name = pathlib.Path(sys.argv[1]), sys.argv[3]

def end(*_):
    (folder / "asked" / name).touch()
    sys.exit(0)

signal.signal(signal.SIGTERM, end)
for known in ("started", "asked"):
    (folder / known).mkdir(exist_ok=True)
(folder / "started" / name).write_text(os.environ.get("BENCHBOT_TESTING_MARK", ""))
while not (folder / "finish").exists():
    time.sleep(0.05)
"""
"""A worker that says that it runs, and ends when it is asked to, or when there is a file `finish`."""

VARIABLE = "BENCHBOT_TESTING_MARK"
NAME = re.compile(r"[A-Za-z0-9._-]+")


def check_executor(
    executor: Executor | str,
    *,
    shared_folder: Path | None = None,
    options: Mapping[str, str] | None = None,
    patience_s: float = 60.0,
    only: Collection[str] = (),
) -> list[Finding]:
    """Return what an executor does and does not as its hook asks, by small workers that need nothing.

    `shared_folder` is one that all its workers can write to (by default in the folder of temporary files), `options`
    are what it needs to know; waits up to `patience_s` for a worker to start or end. `only` names the subjects to look
    at, where not all.
    """
    record = _installed(executor) if isinstance(executor, str) else executor
    properties: Sequence[tuple[str, Callable[[_Trial], str]]] = (
        ("launch", _launches),
        ("names", _names_its_workers),
        ("environment", _hands_on_the_environment),
        ("workers that end", _notices_ends),
        ("attach", _attaches),
        ("stop", _stops),
        ("a reference to nothing left", _attaches_to_what_is_gone),
        ("unknown options", _refuses_unknown_options),
    )
    findings = []
    for subject, holds in properties:
        if only and subject not in only:
            continue
        with tempfile.TemporaryDirectory(prefix="benchbot-testing-", dir=shared_folder) as folder:
            findings.append(look(subject, partial(holds, _Trial(record, Path(folder), options or {}, patience_s))))
    return findings


class _Trial:
    """One launch in a folder of its own."""

    def __init__(self, executor: Executor, folder: Path, options: Mapping[str, str], patience_s: float) -> None:
        self.executor = executor
        self.folder = folder
        self.options = options
        self.patience_s = patience_s
        (folder / "worker.py").write_text(WORKER, encoding="utf-8")
        # By which an executor may tell whether a machine sees the folder.
        (folder / "plan.json").write_text("{}", encoding="utf-8")

    @contextmanager
    def launched(self, count: int) -> Iterator[Workers]:
        """Launch workers; end them, whatever happens."""
        workers = self.executor.launch(self.order(count, self.options))
        try:
            yield workers
        finally:
            (self.folder / "finish").touch()
            workers.stop()

    def order(self, count: int, options: Mapping[str, str]) -> WorkOrder:
        """Return the order of so many workers."""
        command = (sys.executable, str(self.folder / "worker.py"), str(self.folder))
        return WorkOrder(self.folder, command, count, Resources(), options)

    def said(self, what: str) -> list[str]:
        """Return the names of workers that have started, or were asked to end."""
        folder = self.folder / what
        return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []

    def wait(self, come_true: Callable[[], bool], otherwise: str, fix: str) -> None:
        """Wait for something; raises `Wrong` when it does not come."""
        deadline_s = time.monotonic() + self.patience_s
        while not come_true():
            if time.monotonic() > deadline_s:
                raise Wrong(f"{otherwise} within {self.patience_s:g} s.", fix)
            time.sleep(0.05)

    def wait_for_start(self, count: int) -> None:
        """Wait until so many workers run."""
        self.wait(
            lambda: len(self.said("started")) >= count,
            f"{len(self.said('started'))} of {count} workers did not start",
            "Run `[*order.command, '--name', NAME]` for each of order.count workers.",
        )


def _launches(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        if not isinstance(workers.reference, str) or not workers.reference:
            raise Wrong(f"Its reference is {workers.reference!r}.", "Return text that attach() can find them by.")
        trial.wait_for_start(2)
        if workers.alive() != 2:
            raise Wrong(f"alive() is {workers.alive()} while two workers run.", "Count those that run or wait to run.")
        if len(trial.said("started")) > 2:
            raise Wrong(f"{len(trial.said('started'))} workers started, not two.", "Start order.count workers.")
    return "two workers"


def _names_its_workers(trial: _Trial) -> str:
    with trial.launched(2):
        trial.wait_for_start(2)
    (trial.folder / "finish").unlink()
    with trial.launched(1):
        trial.wait_for_start(3)
        names = trial.said("started")
    for name in names:
        if not NAME.fullmatch(name):
            raise Wrong(f"A worker is called {name!r}.", "Use letters, digits, '-', '_' and '.' in names.")
    return ", ".join(names)


def _hands_on_the_environment(trial: _Trial) -> str:
    mark = secrets.token_hex(4)
    os.environ[VARIABLE] = mark
    try:
        with trial.launched(1):
            trial.wait_for_start(1)
            trial.wait(
                lambda: [path.read_text("utf-8") for path in (trial.folder / "started").iterdir()] == [mark],
                "The worker does not have a variable of the driver",
                "Start workers in the environment of the driver.",
            )
    finally:
        del os.environ[VARIABLE]
    return "handed on"


def _notices_ends(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        trial.wait_for_start(2)
        (trial.folder / "finish").touch()
        trial.wait(
            lambda: workers.alive() == 0,
            "alive() is not zero though all have ended",
            "Count what really runs: no zombies.",
        )
    return "not alive any more"


def _attaches(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        trial.wait_for_start(2)
        found = trial.executor.attach(workers.reference)
        if found.alive() != 2:
            raise Wrong(
                f"attach() finds {found.alive()} of two running workers.",
                "Let reference say enough to find them again.",
            )
        found.stop()
        trial.wait(
            lambda: workers.alive() == 0, "They run on after stop() of the attached", "End all of them in stop()."
        )
    return "found again, and stopped"


def _stops(trial: _Trial) -> str:
    with trial.launched(2) as workers:
        trial.wait_for_start(2)
        workers.stop()
        trial.wait(lambda: workers.alive() == 0, "They run on after stop()", "End all of them in stop().")
        trial.wait(
            lambda: trial.said("asked") == trial.said("started"),
            "Workers were ended without a SIGTERM first",
            "Send SIGTERM, wait for some seconds, and only then SIGKILL.",
        )
        workers.stop()
    return "in order, and safe to repeat"


def _attaches_to_what_is_gone(trial: _Trial) -> str:
    with trial.launched(1) as workers:
        trial.wait_for_start(1)
        reference = workers.reference
    gone = trial.executor.attach(reference)
    trial.wait(lambda: gone.alive() == 0, "What is gone counts as alive", "Count in alive() what really runs.")
    gone.stop()
    return "not alive, and stop() does nothing"


def _refuses_unknown_options(trial: _Trial) -> str:
    try:
        workers = trial.executor.launch(trial.order(1, {**trial.options, "no_such_option": "1"}))
    except BenchbotError as error:
        return error.title
    (trial.folder / "finish").touch()
    workers.stop()
    raise Wrong("It takes an option 'no_such_option'.", "Raise BenchbotError, naming the options that there are.")


def _installed(name: str) -> Executor:
    from benchbot.core.plugin_manager import load

    executor: Executor = load().record("executors", name)
    return executor
