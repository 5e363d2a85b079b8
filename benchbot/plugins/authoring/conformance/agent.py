"""The conformance of agents: run in sessions with a pretended robot, over the same wire as in earnest."""

import os
import secrets
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from benchbot.api.agent import Agent
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.findings import Finding, Level
from benchbot.core.progress import Progress, Step
from benchbot.plugins.authoring.conformance.bench import Declared, Found, find
from benchbot.plugins.authoring.conformance.fake_robot import PASSIVE, PretendedHost, selection
from benchbot.plugins.authoring.conformance.properties import Wrong, look

Solution = Callable[[], Agent] | Sequence[str]


@dataclass
class _Witness:
    """A recording that notes what the agent did, in the session of a trial."""

    deeds: list[tuple[str, dict[str, Any]]] = field(default_factory=list)

    def reset(self) -> None:
        """Start over."""
        self.deeds.clear()

    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        """Note an action."""
        if action is not None:
            self.deeds.append((action, dict(arguments)))

    def close(self) -> None:
        """Keep the notes."""


@dataclass(frozen=True)
class _Case:
    solution: Solution
    task: Found
    results_format: Declaration | None
    steps: int
    timeout_s: float


def check_agent(
    agent: Solution, task: Declared | None = None, *, steps: int = 200, timeout_s: float = 120.0
) -> list[Finding]:
    """Return how an agent behaves: to the end of a scene, in two scenes, after a collision, and when it is run again.

    `agent` makes one (its class will do), or is the command of a solution, such as `["python", "solution.py"]`, which
    is ended after `timeout_s` seconds. The task is one that is installed, or else follows a trajectory with all
    observations. The robot is pretended: it moves as it is told, and sees noise. An agent that has not come to an end
    after `steps` steps is stopped.
    """
    made: list[_Case] = []

    def prepared() -> str:
        found = find("tasks", PASSIVE if task is None else task)
        name = found.data.get("results_format")
        from benchbot.core.plugin_manager import load

        results_format = None if name is None else Catalog(load()).get("formats", name)
        made.append(_Case(agent, found, results_format, steps, timeout_s))
        return str(found.data["name"])

    findings = [look("task", prepared)]
    if made:
        findings += [
            look("to the end", partial(_comes_to_its_end, made[0])),
            look("two scenes", partial(_goes_through_scenes, made[0])),
            look("after a collision", partial(_saves_after_a_collision, made[0])),
            look("run again", partial(_does_the_same_again, made[0])),
        ]
    return findings


def _comes_to_its_end(case: _Case) -> str:
    deeds, document = _run(case, scenes=1)
    if not deeds:
        raise Wrong("It took no action.", "Return False from is_done() while there is something to do.", Level.WARNING)
    if document.get("results") is None and case.results_format is not None:
        raise Wrong("Its result has no results.", "Fill in empty_results['results'] and save that.")
    return f"{len(deeds)} actions, and a valid result"


def _goes_through_scenes(case: _Case) -> str:
    deeds, _ = _run(case, scenes=2)
    return f"{len(deeds)} actions, and a valid result"


def _saves_after_a_collision(case: _Case) -> str:
    deeds, _ = _run(case, scenes=1, collides_at=2)
    if len(deeds) > 2:
        raise Wrong(
            f"It went on for {len(deeds) - 2} actions after the collision.", "Be done at ActionResult.COLLISION."
        )
    return "saves what it has"


def _does_the_same_again(case: _Case) -> str:
    if _run(case, scenes=1)[0] != _run(case, scenes=1)[0]:
        raise Wrong(
            "It acts differently in two runs that are the same.",
            "Seed what is random in it, so that its scores can be repeated.",
            Level.WARNING,
        )
    return "the same actions"


def _run(
    case: _Case, *, scenes: int, collides_at: int | None = None
) -> tuple[list[tuple[str, dict[str, Any]]], dict[str, Any]]:
    """Return the actions of an episode and the result that was handed in; raises `Wrong` when there is none."""
    witness = _Witness()
    with _served(case, scenes, collides_at, witness) as (url, token, folder):
        try:
            if callable(case.solution):
                document = _run_here(case.solution, url, token, folder)
            else:
                document = _run_command(case, case.solution, url, token, folder)
        except BenchbotError as error:
            if error.failure is FailureClass.TIMEOUT:
                raise Wrong(
                    f"It has not come to an end: {error.title}", "Return True from is_done() at some time."
                ) from error
            raise
    return witness.deeds, document


def _run_here(make: Callable[[], Agent], url: str, token: str, folder: Path) -> dict[str, Any]:
    from benchbot.api.benchbot import BenchBot
    from benchbot.core import results

    target = folder / "result.json"
    with _variables(BENCHBOT_TOKEN=token, BENCHBOT_RESULT=str(target)):
        BenchBot(make(), supervisor_address=url).run()
    return results.read(target)


def _run_command(case: _Case, command: Sequence[str], url: str, token: str, folder: Path) -> dict[str, Any]:
    from benchbot.submission import episode
    from benchbot.submission.solution import python_first
    from benchbot.wire.run_state import Connection

    order = episode.Order(list(command), Path.cwd(), python_first(), case.timeout_s)
    ended = episode.run(order, Connection(url, None, token), lambda: None, _Onlooker())
    if ended.problem is not None:
        raise ended.problem
    return ended.document


class _Onlooker:
    """Watches a solution, and lets it be."""

    def write(self, chunk: bytes) -> object:
        """Drop what it prints: what matters is in its last words."""

    def started(self, process: int) -> None:
        """It has started."""

    def look(self, progress: Mapping[str, Any], scene_count: int) -> BenchbotError | None:
        """Let it go on."""
        return None


@contextmanager
def _served(case: _Case, scenes: int, collides_at: int | None, witness: _Witness) -> Iterator[tuple[str, str, Path]]:
    """Serve a session on a free port of the loopback interface; yield its URL, its token and a folder."""
    from benchbot.core.platform import Scene
    from benchbot.supervisor.http import server
    from benchbot.supervisor.http.app import create_app
    from benchbot.supervisor.run import Run

    chosen = selection(case.task, case.results_format, scenes, case.steps)
    starts = [Scene(scene.data, Path()).start_pose for scene in chosen.environments]
    token = secrets.token_hex(16)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="benchbot-testing-")))
        run = Run(chosen, lambda: PretendedHost(starts, collides_at), folder / "kept.json")
        run.session.join(witness)
        listener = stack.enter_context(server.bind_tcp("127.0.0.1", 0))
        stack.enter_context(server.Server(create_app(run, token, secrets.token_hex(16)), [listener]))
        stack.callback(run.close)
        yield server.url_of(listener), token, folder


@contextmanager
def _variables(**values: str) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
