"""One episode of a batch, from its claim to its published result."""

import json
import signal
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.api.client import Client
from benchbot.core import resources, results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.provenance import solution_details
from benchbot.plugins.batch import disk
from benchbot.plugins.batch.attempt_watcher import AttemptWatcher, NotWantedError
from benchbot.plugins.batch.attempts import LOST_LIMIT, PROCESS, RESULT, RETRIED, Attempt, Attempts
from benchbot.plugins.batch.events import EventLog
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.matrix import select_for
from benchbot.plugins.batch.memory import MemoryWatch
from benchbot.plugins.batch.plan import Plan, PlannedEpisode
from benchbot.plugins.batch.processes import ProcessId
from benchbot.plugins.batch.warm import WarmBackend
from benchbot.submission import episode as submission
from benchbot.submission.modes import NATIVE, SolutionSpec
from benchbot.supervisor.recording.host import CLOSE_TIMEOUT_S
from benchbot.wire.run_state import RunState

SETTLE_S = 1.0


@dataclass(frozen=True)
class Desk:
    """What a worker has for its work."""

    folder: Folder
    plan: Plan
    catalog: Catalog
    backend: WarmBackend
    events: EventLog
    worker: str
    memory: MemoryWatch
    order: SolutionSpec


def finish(desk: Desk, planned: PlannedEpisode, is_wanted: Callable[[], bool]) -> FailureClass | None:
    """Attempt an episode until its result is published; return how it failed, if it did.

    Raises NotWantedError when `is_wanted` says so meanwhile, and OSError when the folder cannot be written to.
    """
    attempts = Attempts(desk.folder.episode(planned.name))
    if attempts.recover():
        finished = attempts.finished()
        return None if finished is None else finished.failure
    lost = attempts.lost()
    while True:
        _wait_for_room(desk, is_wanted)
        attempt = attempts.begin(desk.worker)
        desk.events.tell("began", key=planned.key, attempt=attempt.number)
        try:
            document = _given_up(desk, planned, lost) if lost > LOST_LIMIT else _run(desk, planned, attempt, is_wanted)
            if planned.repeat is not None:
                document["provenance"]["selection"]["repeat"] = planned.repeat
            _keep(desk, attempt.folder / RESULT, document, is_wanted)
            failure = _failure(document)
            if failure is FailureClass.AGENT or failure in RETRIED:
                _settle(is_wanted)
        except (NotWantedError, OSError):
            with suppress(OSError):
                attempts.note(attempt, ended="interrupted")
            raise
        if failure is None or lost > LOST_LIMIT or not _again(desk.plan, attempts, failure):
            return _publish(desk, attempts, attempt, failure, is_wanted)
        attempts.fail(attempt, failure)
        desk.events.tell("failed", key=planned.key, attempt=attempt.number, failure=failure)
        desk.backend.close()


def end_orphan(folder: Path) -> None:
    """End the solution that a dead worker has left running in an episode's folder, on this machine."""
    for path in folder.glob(f"attempt-*/{PROCESS}"):
        with suppress(OSError, ValueError, TypeError, KeyError):
            ProcessId.from_dict(json.loads(path.read_text("utf-8"))).signal_group(signal.SIGKILL)


def _run(desk: Desk, planned: PlannedEpisode, attempt: Attempt, is_wanted: Callable[[], bool]) -> dict[str, Any]:
    """Run the solution once; return the result document, which there is however it ends."""
    record = {name: attempt.folder / name for name in desk.plan.record}
    desk.memory.begin()
    order = desk.order
    state = None
    with AttemptWatcher(attempt.folder, desk.plan.policy.stall_s, is_wanted, desk.memory) as watcher:
        try:
            state = desk.backend.begin(planned, record)
            ended = submission.run(order, state.connection, desk.backend.died, watcher)
            _finish_recordings(state, record)
        except BenchbotError as error:
            watcher.write(f"{error}\n".encode())
            solution = _solution(order)
            why = f"{error.title} {error.why}"
            failure = error.failure or FailureClass.INFRASTRUCTURE
            if state is not None and failure is FailureClass.AGENT:
                with suppress(BenchbotError):
                    document: dict[str, Any] = Client(state.connection).failed(failure, why, solution)["document"]
                    return document
            selection = select_for(desk.plan, planned, desk.catalog)
            return submission.failed_document(selection, failure, why, solution)
        if ended.problem is not None:
            watcher.write(f"{ended.problem}\n".encode())
    if ended.problem is not None and ended.problem.failure in RETRIED:
        _keep_log(Path(state.platform_log), attempt.folder / "platform.log")
    return ended.document


def _finish_recordings(state: RunState, record: Mapping[str, Path]) -> None:
    """Have the recordings written to their end: publishing the attempt moves their folders."""
    if record:
        operator = Client(replace(state.connection, token=state.operator_token), CLOSE_TIMEOUT_S + SETTLE_S)
        with suppress(BenchbotError):  # of a back end that has died, nothing can be asked any more
            operator.record(finish=list(record.values()))
        operator.close()


def _solution(order: SolutionSpec) -> dict[str, Any]:
    mode = order.mode.name
    return {**solution_details(order.command, order.folder), **({} if mode == NATIVE.name else {"mode": mode})}


def _given_up(desk: Desk, planned: PlannedEpisode, lost: int) -> dict[str, Any]:
    why = f"{lost} workers have vanished while they computed this episode: it may be what ends them."
    solution = _solution(desk.order)
    selection = select_for(desk.plan, planned, desk.catalog)
    return submission.failed_document(selection, FailureClass.INFRASTRUCTURE, why, solution)


def _failure(document: dict[str, Any]) -> FailureClass | None:
    failure = document["provenance"]["failure"]
    return None if failure is None else FailureClass(failure["class"])


def _settle(is_wanted: Callable[[], bool]) -> None:
    """Wait a moment before somebody is blamed: a cluster that ends a job tells all of its processes, in any order."""
    deadline_s = time.monotonic() + SETTLE_S
    while time.monotonic() < deadline_s:
        if not is_wanted():
            raise NotWantedError
        time.sleep(0.05)


def _publish(
    desk: Desk,
    attempts: Attempts,
    attempt: Attempt,
    failure: FailureClass | None,
    is_wanted: Callable[[], bool],
) -> FailureClass | None:
    if not is_wanted():
        raise NotWantedError
    _when_there_is_room(desk, is_wanted, lambda: attempts.publish(attempt, failure))
    return failure


def _again(plan: Plan, attempts: Attempts, failure: FailureClass) -> bool:
    """Say whether an attempt that failed like this is followed by another one."""
    before = attempts.failures()
    if failure in RETRIED:
        return sum(other in RETRIED for other in before) < plan.policy.retries
    return failure is FailureClass.COLLISION and before.count(FailureClass.COLLISION) < plan.policy.rerun_collided


def _keep(desk: Desk, path: Path, document: dict[str, Any], is_wanted: Callable[[], bool]) -> None:
    def write() -> None:
        try:
            results.write_json(path, document)
        except BenchbotError as error:
            if isinstance(error.__cause__, OSError):
                raise error.__cause__ from error
            raise

    _when_there_is_room(desk, is_wanted, write)


def _when_there_is_room(desk: Desk, is_wanted: Callable[[], bool], act: Callable[[], None]) -> None:
    """Do something that writes; on a full disk, wait until it succeeds: what was computed is not thrown away."""
    told = False
    while True:
        try:
            return act()
        except OSError as error:
            if not disk.is_full(error):
                raise
            if not told:
                desk.events.tell("paused", why=f"{desk.folder.path}: {error.strerror}")
                told = True
        time.sleep(disk.POLL_S)
        if not is_wanted():
            raise NotWantedError


def _wait_for_room(desk: Desk, is_wanted: Callable[[], bool]) -> None:
    minimum = desk.plan.policy.minimum_free_bytes

    def tell(folder: Path, free: int) -> None:
        desk.events.tell("paused", why=f"{folder}: {free >> 20} MiB are free, {minimum >> 20} MiB are needed")

    def tell_of_memory(free: int, needed: int) -> None:
        why = f"{free >> 20} MiB of memory are free, the last episodes took {needed >> 20} MiB more than is in use"
        desk.events.tell("paused", why=why)

    for folder in (desk.folder.path, resources.state_dir(), Path(tempfile.gettempdir())):
        disk.wait_for_room(folder, minimum, is_wanted, tell)
    desk.memory.wait_for_room(is_wanted, tell_of_memory)
    if not is_wanted():
        raise NotWantedError


def _keep_log(log: Path, path: Path) -> None:
    with suppress(OSError):
        path.write_bytes(log.read_bytes())
