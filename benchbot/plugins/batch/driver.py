"""The driver of a batch: launches workers, watches them, launches anew what is lost. It may die: the workers go on.

`python -m benchbot.plugins.batch.driver FOLDER` is a detached one, without a terminal, which also evaluates at the end.
When it dies, a worker evaluates. SIGTERM makes it let go of the batch, for a driver that takes its place.
"""

import secrets
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass, did_you_mean
from benchbot.plugins.batch import machine
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.attempts import RETRIED, Attempts
from benchbot.plugins.batch.claims import Claim, HeldClaim
from benchbot.plugins.batch.driver_lock import driver_lock
from benchbot.plugins.batch.early_end import Canaries, check_failures
from benchbot.plugins.batch.folder import Folder, check_writable
from benchbot.plugins.batch.journal import EventLog
from benchbot.plugins.batch.request import names
from benchbot.plugins.batch.status import BatchStatus, Monitor
from benchbot.plugins.batch.worker_pool import DRIVER, RunningWorkers, WorkerPool
from benchbot.process import last_words

LOOK_PERIOD_S = 0.5
END_TIMEOUT_S = 10.0
FRUITLESS_LAUNCHES = 3
"""How often workers may be launched anew without any episode being finished in between."""
DETACHED_NAME = "detached driver"


class LetGoError(Exception):
    """Another driver takes the place of this one."""


def begin(folder: Folder, pool: WorkerPool) -> None:
    """Note the pool of a batch, and that the batch is not cancelled; raises BenchbotError. Needs the driver lock."""
    for needed in (folder.claims, folder.events, folder.episodes, folder.workers):
        check_writable(needed)
    pool.write(folder)
    Canaries(folder, plans.read(folder.plan)).begin_anew()
    folder.cancelled.unlink(missing_ok=True)


def drive(
    folder: Folder,
    pool: WorkerPool,
    look: Callable[[BatchStatus, Monitor], None],
    at_end: Callable[[], None] = lambda: None,
) -> BatchStatus:
    """Drive a batch that has begun to its end; `look` is called twice a second. Needs the driver lock.

    `at_end` is called when every episode is finished, before workers that still run are ended. Raises BenchbotError
    when workers keep dying without finishing anything. On that and on KeyboardInterrupt all are ended; other errors
    that `look` raises leave them alone.
    """
    workers = RunningWorkers(folder, pool)
    monitor = Monitor(folder, plans.read(folder.plan))
    canaries = Canaries(folder, monitor.plan)
    fruitless, finished = 0, -1
    try:
        while True:
            alive = workers.alive()
            status = monitor.look(alive)
            look(status, monitor)
            if status.is_complete:
                break
            if folder.cancelled.exists():
                raise _cancelled(folder)
            canaries.check()
            check_failures(status, monitor.plan)
            missing = _wanted(pool, status) - alive
            if machine.shortage(folder.path, monitor.plan.policy.minimum_free_bytes) is not None:
                # Workers would not begin anything, and nothing could be noted of them.
                fruitless = 0
            elif missing > 0 and (alive == 0 or status.finished > finished):
                # Lost workers are replaced once for each sign of life, or when none is left.
                if alive == 0:
                    fruitless = fruitless + 1 if status.finished == finished else 1
                finished = status.finished
                if fruitless > FRUITLESS_LAUNCHES:
                    raise _dying(folder)
                try:
                    workers.launch(missing)
                except BenchbotError as error:
                    if not machine.is_disk_full(error):
                        raise
                    fruitless = 0
            time.sleep(LOOK_PERIOD_S)
        at_end()
        deadline_s = time.monotonic() + END_TIMEOUT_S  # workers that have nothing left to do end by themselves
        while workers.alive() and time.monotonic() < deadline_s:
            time.sleep(0.05)
        workers.stop()
    except (KeyboardInterrupt, BenchbotError):
        _end(folder, workers)
        raise
    return status


def detach(folder: Folder, pool: WorkerPool) -> int:
    """Launch the workers of a batch, unless they run already, and a driver without a terminal; return how many run.

    Raises BenchbotError. The output of the driver is in `driver.log`.
    """
    with driver_lock(folder):
        begin(folder, pool)
        workers = RunningWorkers(folder, pool)
        missing = _wanted(pool, Monitor(folder, plans.read(folder.plan)).look()) - workers.alive()
        if missing > 0:
            workers.launch(missing)
        count = workers.alive()
    words = [sys.executable, "-P", "-m", "benchbot.plugins.batch.driver", str(folder.path)]
    try:
        with folder.driver_log.open("ab") as log:
            # When this process has ended, it is a child of the init process.
            subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
    except OSError as error:
        raise BenchbotError(
            "The batch's driver cannot be started; its workers run.",
            f"{error.filename}: {error.strerror}.",
            f"Free some disk space or memory, then: benchbot batch attach --detach {folder.path}",
            exit_code=ExitCode.INTERNAL,
        ) from error
    return count


def end_workers(folder: Folder) -> None:
    """End the workers of a batch whose plan is to be another one; raises BenchbotError when somebody drives it."""
    with driver_lock(folder):
        if folder.worker_pool.exists():
            _end(folder, RunningWorkers(folder, WorkerPool.read(folder)))


def cancel(folder: Folder) -> None:
    """End a batch: its driver, if there is one on any machine, is told to, and all workers are ended."""
    plans.read(folder.plan)
    folder.cancelled.touch()
    _end(folder, RunningWorkers(folder, WorkerPool.read(folder)))


def retry(folder: Folder, failed: str | None) -> tuple[int, Counter[str]]:
    """Make finished episodes of these classes of failure pending again; return how many, and how many of others stay.

    Needs the driver lock. `failed` names classes (`agent,timeout`), None is those that are nobody's fault. Raises
    BenchbotError for others.
    """
    known = [str(each) for each in FailureClass]
    for name in names(failed or ""):
        if name not in known:
            raise BenchbotError(
                f"'{name}' is not a class of failure.",
                f"They are: {', '.join(known)}.{did_you_mean(name, known)}",
                "Name some of them: --failed platform,infrastructure",
            )
    classes = set(RETRIED) if failed is None else {FailureClass(name) for name in names(failed)}
    plan = plans.read(folder.plan)
    check_writable(folder.claims)
    events, me = EventLog(folder.events, DRIVER), f"retry-{secrets.token_hex(4)}"
    count, others = 0, Counter[str]()
    for episode in plan.episodes:
        attempts = folder.attempts(episode)
        finished = attempts.finished()
        if finished is None or finished.failure is None:
            continue
        if finished.failure not in classes:
            others[finished.failure] += 1
            continue
        claim = HeldClaim.take(folder.claims / episode.key, me)
        if claim is not None:
            try:
                attempts.begin_anew()
            finally:
                claim.release()
            events.tell("retried", key=episode.key)
            count += 1
    return count, others


def _wanted(pool: WorkerPool, status: BatchStatus) -> int:
    """Return how many workers there is work for."""
    return min(pool.jobs, status.episodes - status.finished)


def _end(folder: Folder, workers: RunningWorkers) -> None:
    """End all workers of a batch, and the solutions that dead ones may have left running on this machine."""
    workers.stop()
    EventLog(folder.events, DRIVER).tell("cancelled")
    for path in folder.claims.glob("*"):
        claim = Claim.read(path)
        if claim is not None and claim.process.is_dead:
            for episode in folder.episodes.glob(f"*-{path.name[: plans.KEY_DIGITS]}"):
                Attempts(episode).end_orphan()


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


def main() -> int:
    """Be the detached driver of a batch; return the exit code."""
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.batch.finalization import finalize

    folder = Folder(Path(sys.argv[1]))
    signals: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda received, _frame: signals.append(received))

    def look(*_: object) -> None:
        if signals:
            raise LetGoError

    try:
        with driver_lock(folder, detached=True):
            plan, catalog = plans.read(folder.plan), Catalog(load())

            def at_end() -> None:
                def evaluate() -> None:
                    finalize(folder, plan, catalog, DETACHED_NAME, wait=True)

                machine.when_there_is_room(evaluate, lambda: not signals, print_error)

            drive(folder, WorkerPool.read(folder), look, at_end)
    except LetGoError:
        return ExitCode.INTERRUPTED
    except (BenchbotError, OSError) as error:
        print_error(error)
        return ExitCode.INTERNAL
    return ExitCode.OK


def print_error(error: Exception) -> None:
    """Print an error; where the log is on a full disk it is lost."""
    console.note(*str(error).splitlines())


if __name__ == "__main__":
    sys.exit(main())
