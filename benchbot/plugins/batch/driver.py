"""The driver of a batch: launches workers, looks on, launches anew what is lost. It may die: the workers go on."""

import json
import time
from collections.abc import Callable
from contextlib import suppress

from benchbot.core import plugin_manager, results
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.records import Executor, Workers
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch import work
from benchbot.plugins.batch.claims import Claim
from benchbot.plugins.batch.events import EventLog, check_writable
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.status import BatchStatus, Monitor
from benchbot.plugins.batch.worker_pool import Crew
from benchbot.process import last_words

LOOK_S = 0.5
FRUITLESS_LAUNCHES = 3
"""How often workers may be launched anew without any episode being finished in between."""

Looker = Callable[[BatchStatus, Monitor], None]


class Engine:
    """The workers of a batch, those of earlier drivers among them, by what is noted in its folder."""

    def __init__(self, folder: Folder, crew: Crew) -> None:
        self.crew = crew
        self._folder = folder
        self._executor: Executor = plugin_manager.load().record("executors", crew.executor)
        self._workers: list[Workers] = [
            plugin_manager.load().record("executors", name).attach(reference) for name, reference in noted(folder)
        ]

    def alive(self) -> int:
        """Return how many workers run or wait to run."""
        return sum(workers.alive() for workers in self._workers)

    def launch(self, count: int) -> None:
        """Launch workers, and note who they are before anything else happens; raises BenchbotError."""
        launched = self._executor.launch(self.crew.order(self._folder, count))
        self._workers = [*(workers for workers in self._workers if workers.alive()), launched]
        entries = [{"executor": self.crew.executor, "reference": workers.reference} for workers in self._workers]
        try:
            results.write_json(self._folder.executor, {"workers": entries})
        except BenchbotError:
            launched.stop()  # nobody would find them again
            raise

    def stop(self) -> None:
        """End all workers."""
        for workers in self._workers:
            workers.stop()


def noted(folder: Folder) -> list[tuple[str, str]]:
    """Return executor and reference of the workers that were launched last; raises BenchbotError."""
    try:
        return [
            (entry["executor"], entry["reference"]) for entry in json.loads(folder.executor.read_bytes())["workers"]
        ]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise BenchbotError(
            "It is not known which workers run.",
            f"{folder.executor} cannot be read: {error}.",
            f"See that no worker of the batch runs any more, and delete {folder.executor}.",
        ) from error


def count_alive(folder: Folder) -> int:
    """Return how many workers of a batch run or wait to run, or -1 when their executor cannot be asked from here."""
    executors = plugin_manager.load()
    try:
        return sum(executors.record("executors", name).attach(reference).alive() for name, reference in noted(folder))
    except BenchbotError:
        return -1


def begin(folder: Folder, crew: Crew) -> None:
    """Note down who computes a batch, and that nobody has ended it; raises BenchbotError. Call it inside `driving`."""
    for needed in (folder.claims, folder.events, folder.episodes, folder.workers):
        check_writable(needed)
    crew.write(folder)
    folder.cancelled.unlink(missing_ok=True)


def drive(folder: Folder, crew: Crew, look: Looker, at_end: Callable[[], None] = lambda: None) -> BatchStatus:
    """See a batch that has begun to its end; `look` is called again and again. Call it inside `driving.driving`.

    `at_end` is called when every episode is finished, before workers that still run are ended. Raises BenchbotError
    when workers keep dying without finishing anything. On that and on KeyboardInterrupt all are ended; what else `look`
    raises leaves them alone.
    """
    plan = plans.read(folder.plan)
    events = EventLog(folder.events, "driver")
    engine = Engine(folder, crew)
    monitor = Monitor(folder, plan)
    fruitless, finished = 0, -1
    try:
        while True:
            alive = engine.alive()
            status = monitor.look(alive)
            look(status, monitor)
            if status.is_complete:
                break
            if folder.cancelled.exists():
                raise _cancelled(folder)
            if alive == 0 and (lost := _missing(crew, status)):
                fruitless = fruitless + 1 if status.finished == finished else 1
                finished = status.finished
                if fruitless > FRUITLESS_LAUNCHES:
                    raise _dying(folder)
                events.tell("launched", count=lost, executor=crew.executor)
                engine.launch(lost)
            elif 0 < alive < _missing(crew, status) and status.finished > finished:
                # Some were lost, and the others get on: make up for them, once for each sign of life.
                finished = status.finished
                events.tell("launched", count=_missing(crew, status) - alive, executor=crew.executor)
                engine.launch(_missing(crew, status) - alive)
            time.sleep(LOOK_S)
        at_end()
        _wait_for_ends(engine)
    except (KeyboardInterrupt, BenchbotError):
        end(folder, engine)
        raise
    return status


def start_detached(folder: Folder, crew: Crew) -> int:
    """Launch the workers of a batch that has begun, unless they run already; return how many run."""
    plan = plans.read(folder.plan)
    engine = Engine(folder, crew)
    missing = _missing(crew, Monitor(folder, plan).look()) - engine.alive()
    if missing > 0:
        EventLog(folder.events, "driver").tell("launched", count=missing, executor=crew.executor)
        engine.launch(missing)
    return engine.alive()


def cancel(folder: Folder) -> None:
    """End a batch: its driver, if there is one on any machine, is told to, and all workers are ended."""
    plans.read(folder.plan)
    folder.cancelled.touch()
    end(folder, Engine(folder, Crew.read(folder)))


def end(folder: Folder, engine: Engine) -> None:
    """End all workers of a batch, and what dead ones may have left running on this machine."""
    engine.stop()
    EventLog(folder.events, "driver").tell("cancelled")
    for path in folder.claims.glob("*"):
        claim = Claim.read(path)
        if claim is not None and claim.process.is_dead:
            for episode in folder.episodes.glob(f"*-{path.name[: plans.KEY_DIGITS]}"):
                work.end_orphan(episode)


def _missing(crew: Crew, status: BatchStatus) -> int:
    """Return how many workers there is work for."""
    return min(crew.jobs, status.episodes - status.finished)


def _wait_for_ends(engine: Engine) -> None:
    """Give workers, which have nothing left to do, the time to end by themselves."""
    deadline_s = time.monotonic() + 10.0
    while engine.alive() and time.monotonic() < deadline_s:
        time.sleep(0.05)
    engine.stop()


def _cancelled(folder: Folder) -> BenchbotError:
    return BenchbotError(
        "The batch was cancelled.",
        "Somebody has ended it (benchbot batch cancel).",
        f"What is finished stays. Go on with: benchbot batch attach {folder.path}",
        exit_code=ExitCode.INTERRUPTED,
    )


def _dying(folder: Folder) -> BenchbotError:
    logs = sorted(folder.workers.glob("*.log"), key=lambda path: path.stat().st_mtime)
    said = "They left no log: the folder may not be on a disk that they share."
    if logs:
        with suppress(OSError), logs[-1].open("rb") as log:
            said = last_words(log)
    return BenchbotError(
        "The workers end before they finish anything.",
        f"They were launched {FRUITLESS_LAUNCHES} times. {said}",
        f"Mend the cause, then run the same command again. Their logs: {folder.workers}",
        exit_code=ExitCode.INTERNAL,
    )
