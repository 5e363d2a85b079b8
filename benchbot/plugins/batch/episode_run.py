"""One episode of a batch, from its claim to its published result, on a back end that stays warm between episodes."""

import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.api.client import Client
from benchbot.core import resources, results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.request import AUTO, RunRequest
from benchbot.plugins.batch import machine
from benchbot.plugins.batch.attempts import (
    LOST_LIMIT,
    RESULT,
    RETRIED,
    Attempt,
    Attempts,
    AttemptWatcher,
    NotWantedError,
)
from benchbot.plugins.batch.costs import measured
from benchbot.plugins.batch.error_groups import cause
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.journal import EventLog
from benchbot.plugins.batch.machine import MemoryWatch
from benchbot.plugins.batch.matrix import select_for
from benchbot.plugins.batch.plan import Plan, PlannedEpisode, SceneKey
from benchbot.plugins.batch.solutions import PreparedSolution
from benchbot.plugins.bundles.snapshot import ChangedError
from benchbot.submission import episode as submission
from benchbot.submission.modes import private_socket
from benchbot.supervisor.backend import Backend
from benchbot.supervisor.recording.host import CLOSE_TIMEOUT_S
from benchbot.wire.run_state import RunState

START_TIMEOUT_S = 300.0
WATCH_PERIOD_S = 1.0
"""Looking at a solution costs worker and supervisor some milliseconds of processor time."""
SETTLE_S = 1.0
"""The wait before a failure is a solution's: a cluster that ends a job signals all of its processes, in any order."""
_SETTLE_POLL_S = 0.05


class WarmBackend:
    """At most one back end. It stays while episodes are in the scene that its simulator has loaded.

    `device` is what the worker may simulate on, where the plan leaves it open.
    """

    def __init__(self, plan: Plan, folder: Path, *, needs_socket: bool, device: str = AUTO) -> None:
        self._plan = plan if plan.device != AUTO else replace(plan, device=device)
        self._owner = f"benchbot batch {folder}"
        self._needs_socket = needs_socket
        self._backend: Backend | None = None
        self._stack = ExitStack()
        self.scene: SceneKey | None = None
        """The scene that is loaded, None when there is no back end."""

    def begin(self, episode: PlannedEpisode, record: Mapping[str, Path]) -> RunState:
        """Begin an episode, on a fresh back end if it is in another scene; return how to reach it.

        Raises BenchbotError when a fresh one does not start either.
        """
        folders = {name: str(folder) for name, folder in record.items()}
        request = replace(self._plan.request_of(episode), record=folders)
        if self._backend is not None and self.scene == episode.scene and self.died() is None:
            try:
                self._backend.begin(request)
            except BenchbotError:
                pass  # It is stuck or dying: a fresh one tells whether the episode is the reason.
            else:
                return self._backend.state
        return self._start(episode, request).state

    def warm_up(self, episode: PlannedEpisode) -> None:
        """Load the scene of an episode that may not begin yet, unless a scene is loaded.

        Where that is impossible nothing is: `begin` says why.
        """
        if self._backend is None:
            with suppress(BenchbotError):
                self._start(episode, self._plan.request_of(episode))

    def _start(self, episode: PlannedEpisode, request: RunRequest) -> Backend:
        self.close()
        self._backend = self._stack.enter_context(
            Backend.start(
                request,
                owner=self._owner,
                port=None if self._needs_socket else 0,
                unix_socket=self._stack.enter_context(private_socket()) if self._needs_socket else None,
                start_timeout_s=START_TIMEOUT_S,
            )
        )
        self.scene = episode.scene
        return self._backend

    def died(self) -> BenchbotError | None:
        """Return why the back end is gone; None while it lives, or when there is none."""
        return None if self._backend is None else self._backend.died()

    def close(self) -> None:
        """End the back end, if there is one."""
        self._backend = self.scene = None
        self._stack.close()


@dataclass(frozen=True)
class EpisodeContext:
    """The parts of a worker that are the same for all of its episodes."""

    folder: Folder
    plan: Plan
    catalog: Catalog
    backend: WarmBackend
    events: EventLog
    worker: str
    memory: MemoryWatch
    solutions: Mapping[str | None, PreparedSolution]
    """The solutions by name; of a batch without names, the only one by None."""
    gpus: int = 0
    """GPUs that the worker was given."""


def finish(context: EpisodeContext, planned: PlannedEpisode, is_wanted: Callable[[], bool]) -> FailureClass | None:
    """Attempt an episode until its result is published; return how it failed, if it did.

    Raises NotWantedError when `is_wanted` says so meanwhile, OSError when the folder cannot be written to, and
    ChangedError when nobody can say which solution ran.
    """
    attempts = context.folder.attempts(planned)
    if attempts.recover():
        finished = attempts.finished()
        return None if finished is None else finished.failure
    lost = attempts.lost()
    while True:
        _wait_for_room(context, is_wanted)
        attempt = attempts.begin(context.worker)
        noted: dict[str, Any] = {"gpus": context.gpus, "cpu_s": 0.0}
        context.events.tell("began", key=planned.key, attempt=attempt.number)
        try:
            if lost > LOST_LIMIT:
                why = f"{lost} workers have vanished while they computed this episode: it may be what ends them."
                document = _failed(context, planned, FailureClass.INFRASTRUCTURE, why)
            else:
                document = _run(context, planned, attempt, is_wanted, noted)
                context.solutions[planned.solution].snapshot.check()
            if planned.repeat is not None:
                document["provenance"]["selection"]["repeat"] = planned.repeat
            path = attempt.folder / RESULT
            _when_there_is_room(context, is_wanted, lambda: results.write_json(path, document))  # noqa: B023
            entry = document["provenance"]["failure"]
            failure = None if entry is None else FailureClass(entry["class"])
            if failure is FailureClass.AGENT or failure in RETRIED:
                _settle(is_wanted)
        except (NotWantedError, OSError, ChangedError):
            with suppress(OSError):
                attempts.note(attempt, ended="interrupted", duration_s=attempt.duration_s, **noted)
            raise
        if failure is None or lost > LOST_LIMIT or not _is_retried(context.plan, attempts, failure):
            _raise_unless(is_wanted)
            noted |= {} if entry is None else {"error": cause(entry["why"])}
            noted["restarts"] = document["provenance"].get("restarts", 0)
            _when_there_is_room(context, is_wanted, lambda: attempts.publish(attempt, failure, **noted))  # noqa: B023
            return failure
        attempts.fail(attempt, failure, **noted)
        context.events.tell("failed", key=planned.key, attempt=attempt.number, failure=failure)
        context.backend.close()


def _run(
    context: EpisodeContext,
    planned: PlannedEpisode,
    attempt: Attempt,
    is_wanted: Callable[[], bool],
    noted: dict[str, Any],
) -> dict[str, Any]:
    """Run the solution once; return the result document, which there is however it ends. Its costs are `noted`."""
    record = {name: attempt.folder / name for name in context.plan.record}
    context.memory.begin()
    state = None
    solution = context.solutions[planned.solution]
    with AttemptWatcher(attempt.folder, context.plan.policy, is_wanted, context.memory) as watcher:
        try:
            state = context.backend.begin(planned, record)
            with solution.placed(attempt.folder) as spec, measured(spec.mode.name, noted):
                died, needs_result = context.backend.died, _needs_result(context)
                ended = submission.run(
                    spec, state.connection, died, watcher, WATCH_PERIOD_S, state=state, needs_result=needs_result
                )
            _finish_recordings(state, record)
        except ChangedError:
            raise
        except BenchbotError as error:
            watcher.write(f"{error}\n".encode())
            why = f"{error.title} {error.why}"
            failure = error.failure or FailureClass.INFRASTRUCTURE
            if state is not None and failure is FailureClass.AGENT:
                with suppress(BenchbotError):
                    answer = Client(state.connection).failed(failure, why, submission.solution_of(solution.spec))
                    document: dict[str, Any] = answer["document"]
                    return document
            return _failed(context, planned, failure, why)
        if ended.problem is not None:
            watcher.write(f"{ended.problem}\n".encode())
            advice = solution.snapshot.missed(ended.problem.why)
            watcher.write(f"{advice}\n".encode() if advice is not None else b"")
    if ended.problem is not None and ended.problem.failure in RETRIED:
        with suppress(OSError):
            (attempt.folder / "platform.log").write_bytes(Path(state.platform_log).read_bytes())
    return ended.document


def _needs_result(context: EpisodeContext) -> bool:
    """Say whether something asks for results: a method, or the task by its format."""
    task = context.catalog.get("tasks", context.plan.task).data
    return context.plan.method is not None or "results_format" in task


def _finish_recordings(state: RunState, record: Mapping[str, Path]) -> None:
    """Write the recordings to their end: publishing the attempt moves their folders."""
    if record:
        operator = Client(replace(state.connection, token=state.operator_token), CLOSE_TIMEOUT_S + SETTLE_S)
        with suppress(BenchbotError):  # a back end that has died does not answer
            operator.record(finish=list(record.values()))
        operator.close()


def _failed(context: EpisodeContext, planned: PlannedEpisode, failure: FailureClass, why: str) -> dict[str, Any]:
    selection = select_for(context.plan, planned, context.catalog)
    solution = submission.solution_of(context.solutions[planned.solution].spec)
    return submission.failed_document(selection, failure, why, solution)


def _is_retried(plan: Plan, attempts: Attempts, failure: FailureClass) -> bool:
    """Say whether an attempt that failed like this is followed by another one."""
    before = attempts.failures()
    if failure in RETRIED:
        return sum(other in RETRIED for other in before) < plan.policy.retries
    return failure is FailureClass.COLLISION and before.count(FailureClass.COLLISION) < plan.policy.rerun_collided


def _settle(is_wanted: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + SETTLE_S
    while time.monotonic() < deadline_s:
        _raise_unless(is_wanted)
        time.sleep(_SETTLE_POLL_S)


def _raise_unless(is_wanted: Callable[[], bool]) -> None:
    if not is_wanted():
        raise NotWantedError


def _when_there_is_room(context: EpisodeContext, is_wanted: Callable[[], bool], act: Callable[[], None]) -> None:
    """Do something that writes; on a full disk, wait until it succeeds: what was computed is not thrown away."""

    def tell(error: Exception) -> None:
        cause = error.__cause__ if isinstance(error, BenchbotError) else error
        context.events.tell("paused", why=f"{context.folder.path}: {getattr(cause, 'strerror', cause)}")

    try:
        machine.when_there_is_room(act, is_wanted, tell)
    except (OSError, BenchbotError) as error:
        if machine.is_disk_full(error):
            raise NotWantedError from error
        if isinstance(error.__cause__, OSError):
            raise error.__cause__ from None
        raise


def _wait_for_room(context: EpisodeContext, is_wanted: Callable[[], bool]) -> None:
    """Return when disks and memory have room for an episode; raises NotWantedError."""
    for folder in (context.folder.path, resources.state_dir(), Path(tempfile.gettempdir())):

        def tell(free: int, needed: int, folder: Path = folder) -> None:
            why = f"{folder}: {free >> 20} MiB are free, {needed >> 20} MiB are needed"
            context.events.tell("paused", why=why)

        machine.wait_for_disk(folder, context.plan.policy.minimum_free_bytes, is_wanted, tell)

    def tell_of_memory(free: int, needed: int) -> None:
        why = f"{free >> 20} MiB of memory are free, the last episodes took {needed >> 20} MiB more than is in use"
        context.events.tell("paused", why=why)

    context.memory.wait_for_room(is_wanted, tell_of_memory)
    _raise_unless(is_wanted)
