"""One episode: a solution is run against a back end and watched, and its end becomes a result document."""

import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from benchbot.api.client import Client
from benchbot.core import results
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.provenance import file_marks, solution_details
from benchbot.core.request import RunRequest
from benchbot.core.selection import Selection
from benchbot.core.session import Session
from benchbot.submission.modes import NATIVE, RESULT, SolutionSpec
from benchbot.submission.output import exchange_folder, output_log, read_result
from benchbot.submission.solution import describe_exit
from benchbot.wire.run_state import Connection, RunState

WATCH_PERIOD_S = 0.25
CRASHED = "The solution failed."
EXIT_CODES = {
    FailureClass.PLATFORM: ExitCode.INTERNAL,
    FailureClass.INFRASTRUCTURE: ExitCode.INTERNAL,
}
"""The exit codes of `benchbot submit` by class of failure; the others mean that the submission failed."""


class Watcher(Protocol):
    """An observer of a running solution."""

    def write(self, chunk: bytes) -> object:
        """Take what the solution prints, chunk by chunk and untouched; called in a thread of its own."""

    def started(self, process: int) -> None:
        """Take the number of the solution's process, which is also that of its process group."""

    def look(self, progress: Mapping[str, Any], scene_count: int) -> BenchbotError | None:
        """Take the progress of the episode (docs/wire.md); return a reason to end it now, or None to go on."""


@dataclass(frozen=True)
class EndedEpisode:
    """The end of an episode: its result document, the path where the back end keeps it (if it does), the problem."""

    document: dict[str, Any]
    path: Path | None
    problem: BenchbotError | None


def run(
    spec: SolutionSpec,
    connection: Connection,
    died: Callable[[], BenchbotError | None],
    watcher: Watcher,
    longest_period_s: float = WATCH_PERIOD_S,
    *,
    state: RunState | None = None,
    needs_result: bool = True,
) -> EndedEpisode:
    """Run a solution to its end; `died` tells why the back end is gone, if it knows.

    Unless it `needs_result`, an episode that ends well without one is no failed one: its document has no `results`.

    The watcher looks four times a second at first, and in time as rarely as `longest_period_s` says. `state` is that of
    the back end, if it is known: its token is the operator's, and it tells the seed where no supervisor is left to.

    Whatever happens there is a result document, and no process is left. Raises BenchbotError when the solution cannot
    even be started.
    """
    # What a solution does with its own token, such as asking without end, keeps nobody from seeing how it ends.
    client = Client(connection if state is None else replace(connection, token=state.operator_token))
    session = client.session()
    marks = file_marks(spec.command, spec.folder)
    solution = solution_of(spec)
    with exchange_folder() as exchange:
        seen: dict[str, Any] = {}
        problem = _watch(spec, client, connection, exchange, watcher, session, seen, longest_period_s)
        if spec.details is None:
            solution = _without_changed(solution, marks, file_marks(spec.command, spec.folder))
        if problem is None:
            try:
                saved = exchange / RESULT
                there = needs_result or client.session()["progress"]["failure"] or saved.exists() or saved.is_symlink()
                answer = client.result(read_result(saved) if there else None, solution)
            except BenchbotError as error:
                problem = error
            else:
                kept = Path(answer["path"])
                return EndedEpisode(answer["document"], kept, _safety_stop(client, kept))
    problem = _with_cause(problem, client, died, seen)
    failure = problem.failure or FailureClass.AGENT
    problem.failure = failure
    problem.exit_code = EXIT_CODES.get(failure, ExitCode.SUBMISSION_FAILED)
    why = f"{problem.title} {problem.why}"
    try:
        answer = client.failed(failure, why, solution)
    except BenchbotError:
        return EndedEpisode(_failed_without_supervisor(session, state, failure, why, solution), None, problem)
    path = Path(answer["path"])
    stopped = _safety_stop(client, path)
    if stopped is not None:
        problem = stopped
    elif failure is FailureClass.PLATFORM:
        problem.fix = _with_log(problem.fix, path)
    return EndedEpisode(answer["document"], path, problem)


def solution_of(spec: SolutionSpec) -> dict[str, Any]:
    """Return the solution as a result names it."""
    details = solution_details(spec.command, spec.folder) if spec.details is None else dict(spec.details)
    mode = {} if spec.mode.name == NATIVE.name else {"mode": spec.mode.name}
    return {**details, **mode, **({"weak_limits": list(spec.weak_limits)} if spec.weak_limits else {})}


def _without_changed(solution: dict[str, Any], before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return a solution without the hashes of files that were written to meanwhile: which content ran is not known."""
    changed = sorted(word for word in before if after.get(word) != before[word])
    files = {word: found for word, found in solution["files"].items() if word not in changed}
    return {**solution, "files": files, **({"changed_files": changed} if changed else {})}


def _watch(
    spec: SolutionSpec,
    client: Client,
    connection: Connection,
    exchange: Path,
    watcher: Watcher,
    session: Mapping[str, Any],
    seen: dict[str, Any],
    longest_period_s: float,
) -> BenchbotError | None:
    """Run the solution to its end; return what went wrong, or None when it ended well.

    `seen` holds the run's progress as it was seen last.
    """
    looked_s = time.monotonic()
    deadline_s = None if spec.timeout_s is None else looked_s + spec.timeout_s
    with ExitStack() as stack:
        kept = stack.enter_context(output_log(connection, spec.log_limit_bytes))

        def printed(chunk: bytes) -> None:
            kept.write(chunk)
            watcher.write(chunk)

        solution = stack.enter_context(spec.mode.start(spec, connection, exchange, printed))
        watcher.started(solution.process)
        period_s = WATCH_PERIOD_S
        while (ended := solution.wait(period_s)) is None:
            period_s = min(1.1 * period_s, longest_period_s)
            try:
                progress = client.session()["progress"]
            except BenchbotError as error:
                return error
            seen.update(progress)
            if progress["ends_run"] and progress["failure"] == FailureClass.AGENT:
                return BenchbotError(
                    "The solution was frozen, and the robot was stopped.",
                    progress["failure_why"],
                    "Let it run: what is to pause a run is its own pause, in benchbot tui.",
                    failure=FailureClass.AGENT,
                )
            ended_by = watcher.look(progress, session["scene_count"])
            if ended_by is not None:
                return ended_by
            before_s, looked_s = looked_s, time.monotonic()
            if deadline_s is not None and (progress["waiting_for"] or progress["paused"]):
                deadline_s += looked_s - before_s  # what operator and host do is not the solution's time
            if deadline_s is not None and looked_s > deadline_s:
                return BenchbotError(
                    "The solution did not end in time.",
                    f"It was still running after {spec.timeout_s:g} seconds, and was ended.",
                    "Give it more with --timeout SECONDS, or look for what it waits for.",
                    failure=FailureClass.TIMEOUT,
                )
        explained = solution.explain(ended)
    if explained is not None or ended == 0:
        return explained
    return BenchbotError(
        CRASHED,
        "\n".join(filter(None, [describe_exit(ended), solution.last_words])),
        "Mend the solution; its output above says more.",
        failure=FailureClass.AGENT,
    )


def _with_cause(
    problem: BenchbotError, client: Client, died: Callable[[], BenchbotError | None], seen: Mapping[str, Any]
) -> BenchbotError:
    """Return the problem behind a problem: a solution cannot end well when what it talks to is gone."""
    death = died()
    try:
        progress = seen if death is not None else client.session()["progress"]
    except BenchbotError as gone:
        death, progress = gone, seen
    if death is not None and progress.get("failure") == FailureClass.AGENT:
        return BenchbotError(
            "The solution stopped its own run.",
            progress["failure_why"],
            "Have it end by itself, with exit status 0, when it is done.",
            failure=FailureClass.AGENT,
        )
    if death is not None and progress.get("failure") != FailureClass.PLATFORM:
        death.failure = FailureClass.INFRASTRUCTURE
        return death
    if progress["failure"] == FailureClass.PLATFORM:
        return BenchbotError(
            "The simulator or robot failed, so the episode could not be finished.",
            progress["failure_why"],
            progress.get("failure_fix") or "Run it again; if it fails again, report it.",
            failure=FailureClass.PLATFORM,
        )
    if progress["failure"] == FailureClass.TIMEOUT and problem.failure is FailureClass.AGENT:
        problem.failure = FailureClass.TIMEOUT
    return problem


def _safety_stop(client: Client, result: Path) -> BenchbotError | None:
    """Return the safety stop that has ended the run, if one has: whatever else went wrong came of it or led to it."""
    try:
        progress = client.session()["progress"]
    except BenchbotError:
        return None
    if not progress["ends_run"] or progress["failure"] == FailureClass.AGENT:
        return None
    return BenchbotError(
        "The robot was stopped for safety, and the run is over.",
        progress["failure_why"],
        _with_log(
            f"{progress.get('failure_fix') or 'Mend the cause.'}\n"
            "See that the robot and the space around it are safe before you start another run.",
            result,
        ),
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.PLATFORM,
        ends_run=True,
    )


def _with_log(fix: str, result: Path) -> str:
    log = str(result.with_name("platform.log"))
    return fix if log in fix else f"{fix} Its log: {log}"


def _failed_without_supervisor(
    session: Mapping[str, Any], state: RunState | None, failure: FailureClass, why: str, solution: dict[str, Any]
) -> dict[str, Any]:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.core.selection import select

    chosen = session["selection"]
    request = RunRequest(**{key: chosen[key] for key in ("task", "robot", "environment", "episode", "settings")})
    if state is not None:
        request = replace(request, seed=state.seed, secret=state.secret)
    document = failed_document(select(Catalog(load()), request), failure, why, solution)
    if state is None:
        document["provenance"]["selection"]["seed"] = None
    return document


def failed_document(
    selection: Selection, failure: FailureClass, why: str, solution: dict[str, Any] | None
) -> dict[str, Any]:
    """Return the result document of a failed episode when the supervisor, which usually makes it, is gone."""
    episode = Session(selection, _no_host)
    episode.fail(failure, why)
    document = results.failed(episode, solution=solution)
    # What the solution was shown is known to the supervisor alone.
    document["provenance"]["observation_digest"] = ""
    return document


def _no_host() -> Any:
    raise AssertionError("a failed episode starts no host")
