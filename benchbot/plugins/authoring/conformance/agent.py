"""The conformance of agents: they are run in sessions with a fake robot, over the same wire as in a real run."""

import secrets
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.api.agent import Agent
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.findings import Finding, Level
from benchbot.core.progress import Progress, Step
from benchbot.plugins.authoring.conformance import fake_robot
from benchbot.plugins.authoring.conformance.bench import Declared, find_declaration
from benchbot.plugins.authoring.conformance.properties import Violation, check_properties, environment_variables, obtain

Solution = Callable[[], Agent] | Sequence[str]
Action = tuple[str, dict[str, Any]]


class _ActionRecording:
    """A recording of the actions in the session of a trial."""

    def __init__(self) -> None:
        self.actions: list[Action] = []

    def reset(self) -> None:
        self.actions.clear()

    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        if action is not None:
            self.actions.append((action, dict(arguments)))

    def close(self) -> None:
        pass


@dataclass(frozen=True)
class _Case:
    solution: Solution
    task: Declaration
    results_format: Declaration | None
    steps: int
    timeout_s: float


def check_agent(
    agent: Solution, task: Declared | None = None, *, steps: int = 200, timeout_s: float = 120.0
) -> list[Finding]:
    """Return findings on an agent: to the end of a scene, in two scenes, after a collision, and when it is run again.

    `agent` is a function that makes one (such as its class), or the command of a solution, such as
    `["python", "solution.py"]`, which is ended after `timeout_s` seconds. The task is one that is installed, or else
    follows a trajectory with all observations. The robot is fake: it moves as it is told, and observes noise. An agent
    that has not come to an end after `steps` steps is stopped.
    """

    def prepare() -> _Case:
        found = find_declaration("tasks", fake_robot.TASK if task is None else task)
        name = found.data.get("results_format")
        results_format = None if name is None else find_declaration("formats", name)
        return _Case(agent, found, results_format, steps, timeout_s)

    finding, cases = obtain("task", prepare, lambda case: case.task.name)
    properties: dict[str, Callable[[_Case], str]] = {
        "to the end": _comes_to_its_end,
        "two scenes": _goes_through_scenes,
        "after a collision": _saves_after_a_collision,
        "run again": _repeats_itself,
    }
    return [finding, *(one for case in cases for one in check_properties(properties, case))]


def _comes_to_its_end(case: _Case) -> str:
    actions, document = _run(case, scenes=1)
    if not actions:
        fix = "Return False from is_done() while there is something to do."
        raise Violation("It took no action.", fix, Level.WARNING)
    if document.get("results") is None and case.results_format is not None:
        raise Violation("Its result has no results.", "Fill in empty_results['results'] and save that.")
    return f"{len(actions)} actions, and a valid result"


def _goes_through_scenes(case: _Case) -> str:
    actions, _ = _run(case, scenes=2)
    return f"{len(actions)} actions, and a valid result"


def _saves_after_a_collision(case: _Case) -> str:
    actions, _ = _run(case, scenes=1, collides_at=2)
    if len(actions) > 2:
        raise Violation(
            f"It went on for {len(actions) - 2} actions after the collision.", "Be done at ActionResult.COLLISION."
        )
    return "saves what it has"


def _repeats_itself(case: _Case) -> str:
    if _run(case, scenes=1)[0] != _run(case, scenes=1)[0]:
        raise Violation(
            "It acts differently in two runs that are the same.",
            "Seed what is random in it, so that its scores can be repeated.",
            Level.WARNING,
        )
    return "the same actions"


def _run(case: _Case, *, scenes: int, collides_at: int | None = None) -> tuple[list[Action], Mapping[str, Any]]:
    """Return the actions of an episode and the result that was handed in; raises `Violation` when there is none."""
    recording = _ActionRecording()
    with _served(case, scenes, collides_at, recording) as (url, token, folder):
        try:
            if callable(case.solution):
                document = _run_here(case.solution, url, token, folder)
            else:
                document = _run_command(case, case.solution, url, token)
        except BenchbotError as error:
            if error.failure is FailureClass.TIMEOUT:
                raise Violation(
                    f"It has not come to an end: {error.title}", "Return True from is_done() at some time."
                ) from error
            raise
    return recording.actions, document


def _run_here(make: Callable[[], Agent], url: str, token: str, folder: Path) -> Mapping[str, Any]:
    from benchbot.api.benchbot import BenchBot
    from benchbot.core import results
    from benchbot.submission.output import read_result

    target = folder / "result.json"
    with environment_variables(BENCHBOT_TOKEN=token, BENCHBOT_RESULT=str(target)):
        BenchBot(make(), supervisor_address=url).run()
    read_result(target)
    return results.read(target)


def _run_command(case: _Case, command: Sequence[str], url: str, token: str) -> dict[str, Any]:
    from benchbot.submission import episode
    from benchbot.submission.modes import SolutionSpec
    from benchbot.submission.solution import python_first
    from benchbot.wire.run_state import Connection

    spec = SolutionSpec(list(command), Path.cwd(), python_first(), case.timeout_s)
    ended = episode.run(spec, Connection(url, None, token), lambda: None, _SilentWatcher())
    if ended.problem is not None:
        raise ended.problem
    return ended.document


class _SilentWatcher:
    """A watcher of an episode that shows nothing and never ends it."""

    def write(self, chunk: bytes) -> object:
        pass

    def started(self, process: int) -> None:
        pass

    def look(self, progress: Mapping[str, Any], scene_count: int) -> BenchbotError | None:
        return None


@contextmanager
def _served(
    case: _Case, scenes: int, collides_at: int | None, recording: _ActionRecording
) -> Iterator[tuple[str, str, Path]]:
    """Serve a session on a free port of the loopback interface; yield its URL, its token and a folder."""
    from benchbot.supervisor.http import server
    from benchbot.supervisor.http.app import create_app
    from benchbot.supervisor.run import Run

    chosen = fake_robot.fake_selection(case.task, case.results_format, scenes, case.steps)
    token = secrets.token_hex(16)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="benchbot-testing-")))
        run = Run(chosen, lambda: fake_robot.FakeHost(collides_at), folder / "kept.json")
        run.session.join(recording)
        listener = stack.enter_context(server.bind_tcp("127.0.0.1", 0))
        stack.enter_context(server.Server(create_app(run, token, secrets.token_hex(16)), [listener]))
        stack.callback(run.close)
        yield server.url_of(listener), token, folder
