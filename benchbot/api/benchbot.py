"""The class through which a solution acts and observes; its surface is that of BenchBot v2."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any, cast

from benchbot.api.agent import ActionResult, Agent, Observations
from benchbot.api.client import Client
from benchbot.core import atomic, resources
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.wire.joining import find


class WrongValueError(BenchbotError, ValueError):
    """An argument of the solution that cannot be used, where v2 raised ValueError: an unavailable action, say."""


class WrongMomentError(BenchbotError, RuntimeError):
    """A call that is impossible in the current state, where v2 raised RuntimeError."""


def result_location() -> str:
    """Return the path of the solution's result: `$BENCHBOT_RESULT`, or `result.json` in the user's state folder."""
    return os.environ.get("BENCHBOT_RESULT") or str(resources.state_dir() / "result.json")


class BenchBot:
    """A robot in a task, reached through a running back end: observe, act, save a result.

    `BenchBot(agent).run()` does it all; `reset`, `step` and `next_scene` are for loops of your own. Every method raises
    BenchbotError, which says what went wrong, why, and what to do; where v2 raised ValueError or RuntimeError, it is
    one of those as well.
    """

    def __init__(
        self, agent: Agent | None = None, supervisor_address: str | None = None, auto_start: bool = True
    ) -> None:
        """Connect to the run of this process, or the only one of this user, or to `supervisor_address`."""
        self.agent: Agent | None = None
        self.set_agent(agent)
        self._address = supervisor_address
        self._client: Client | None = None
        self._session: dict[str, Any] = {}
        self._state: dict[str, Any] = {}
        self._clean = False
        self._undelivered: Observations | None = None
        if auto_start:
            self.start()

    @property
    def actions(self) -> list[str]:
        """The actions that may be taken now: none after a collision or at the end of the trajectory."""
        self._running()
        return list(self._state["available_actions"])

    @property
    def observations(self) -> list[str]:
        """The names of the observations that every step returns."""
        self._running()
        return list(self._session["observations"])

    @property
    def last_outcome(self) -> str | None:
        """The outcome of the last step's action: `reached`, `blocked`, `collided`, `timeout`; None without an action.

        A robot that stops in front of obstacles is `blocked` there: it has not gone as far as it was told, and its
        action result is SUCCESS, since it may go on.
        """
        self._running()
        outcome: str | None = self._state.get("outcome")
        return outcome

    @property
    def config(self) -> dict[str, Any]:
        """The declarations of the run: `task`, `robot`, `environments` and `results` (the results format)."""
        self._running()
        return {
            "task": self._session["task"],
            "robot": self._session["robot"],
            "environments": self._session["environments"],
            "results": self._session["results_format"] or {},
        }

    @property
    def task_details(self) -> dict[str, Any]:
        """The declaration of the task."""
        details: dict[str, Any] = self.config["task"]
        return details

    @property
    def environment_details(self) -> list[dict[str, Any]]:
        """The public details of each scene of the environment."""
        details: list[dict[str, Any]] = self.config["environments"]
        return details

    @property
    def result_filename(self) -> str:
        """The path at which the result is to be written; its folder exists."""
        location = result_location()
        Path(location).parent.mkdir(parents=True, exist_ok=True)
        return location

    def start(self) -> None:
        """Connect to the supervisor and begin a new episode in the start of the first scene."""
        with _announced("Waiting to establish connection to a running supervisor"):
            client = Client(find(self._address))
            self._session = client.session()
            self._client = client
            print("Connected!", flush=True)
        self._request(client.reset)

    def set_agent(self, agent: Agent | None) -> None:
        """Set the agent that `run` runs, or none; raises WrongValueError for something that is not an Agent."""
        if agent is not None and not isinstance(agent, Agent):
            raise WrongValueError(
                f"'{type(agent).__name__}' is not an agent.",
                "An agent is an object of a class that derives from benchbot.api.Agent.",
                "Write: class MyAgent(Agent): … and pass an object of it: BenchBot(MyAgent())",
                failure=FailureClass.AGENT,
            )
        self.agent = agent

    def reset(self) -> tuple[Observations, ActionResult]:
        """Return to the first scene's start, unless the current scene is clean; return observations and result."""
        client = self._running()
        if not self._clean:
            with _announced("Dirty robot state detected. Performing reset"):
                self._request(client.reset)
                print("Complete.", flush=True)
        elif self._undelivered is None:
            self._request(lambda: client.step(None))
        return self._deliver()

    def step(
        self, action: str | None, arguments: Mapping[str, Any] | None = None, **action_kwargs: Any
    ) -> tuple[Observations, ActionResult]:
        """Take an action and observe: `step("move_distance", distance=0.5)`. `step(None)` only observes.

        Returns the observations by name, and the action's result. Raises WrongValueError for an action that is unknown,
        unavailable now or wrongly used.
        """
        client = self._running()
        given = {**(arguments or {}), **action_kwargs}
        kwargs = {name: value.tolist() if hasattr(value, "tolist") else value for name, value in given.items()}
        if action is not None:
            print(f"Sending action '{action}' with args: {kwargs}", flush=True)
        try:
            self._request(lambda: client.step(action, kwargs))
        except BenchbotError as error:
            raise _mistake(error, WrongValueError) from error.__cause__
        return self._deliver()

    def next_scene(self) -> bool:
        """Advance to the next scene; return False when there is none. Raises WrongMomentError after a collision."""
        client = self._running()
        is_one_of_several = len(self.environment_details) > 1
        try:
            with _announced("Moving to next scene") if is_one_of_several else nullcontext():
                self._request(client.next_scene)
                advanced = bool(self._state["advanced"])
                if is_one_of_several:
                    print("Done." if advanced else "Failed.", flush=True)
        except BenchbotError as error:
            raise _mistake(error, WrongMomentError) from error.__cause__
        return advanced

    def empty_results(self) -> dict[str, Any]:
        """Return a result to fill in: details of task and environment, and `results` as its format creates it."""
        functions = self.results_functions()
        return {
            "task_details": self.task_details,
            "environment_details": self.environment_details,
            "results": functions["create"]() if "create" in functions else {},
        }

    def results_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the functions of the task's results format by name (`create`, `create_object`, `validate`, …)."""
        client = self._running()
        results_format = self._session["results_format"]
        names = results_format["functions"] if results_format else []
        return {name: partial(_call_remote, client, name) for name in names}

    def run(self, agent: Agent | None = None) -> None:
        """Run an agent through every scene, and have the result that it saves, if it does, checked and completed."""
        if agent is not None:
            self.set_agent(agent)
        agent = self.agent
        if agent is None:
            raise WrongMomentError(
                "There is no agent to run.",
                "BenchBot was made without one.",
                "Pass one: BenchBot(agent).run() or BenchBot().run(agent)",
                failure=FailureClass.AGENT,
            )
        observations, result = self.reset()
        while True:
            agent.last_outcome = None
            while not agent.is_done(result):
                action, arguments = agent.pick_action(observations, self.actions)
                observations, result = self.step(action, arguments)
                agent.last_outcome = self.last_outcome
            # A collision ends the whole episode; what was seen until then is still worth a result.
            if result is ActionResult.COLLISION or not self.next_scene():
                break
            observations, result = self._deliver()
        filename = self.result_filename
        Path(filename).unlink(missing_ok=True)
        agent.save_result(filename, self.empty_results(), self.results_functions())
        self._complete_result(Path(filename))

    def _complete_result(self, path: Path) -> None:
        if not path.exists():
            print("The agent saved no result.", flush=True)
            return
        why = ""
        # Not schema.read, which tells JSON from YAML by the suffix: v2's name of the file has none.
        try:
            document = json.loads(path.read_text("utf-8"))
        except ValueError as error:
            document, why = None, f"{error}."
        if not isinstance(document, dict):
            raise _unusable_result(
                f"The agent's result {path} is not a JSON object.",
                why or f"It holds a {type(document).__name__}.",
                "Fill in what save_result is given as empty_results, and write it with json.dump.",
            )
        completed = self._running().result(document)["document"]
        try:
            atomic.write(path, (json.dumps(completed, indent=1, sort_keys=True, allow_nan=False) + "\n").encode())
        except OSError as error:
            raise atomic.cannot_write(path, error) from error

    def _running(self) -> Client:
        """Return the client; without auto_start, the first use starts."""
        if self._client is None:
            self.start()
        return cast(Client, self._client)

    def _request(self, ask: Callable[[], dict[str, Any]]) -> None:
        """Send a request and keep the answer. After an error, the state is dirty: only a reset is sure to help."""
        self._clean = False
        answer = ask()
        self._clean = answer["state"] == "clean"
        self._state = answer
        self._undelivered = answer.pop("observations", None)
        if self._undelivered is not None:
            self._undelivered["scene_number"] = answer["scene_number"]

    def _deliver(self) -> tuple[Observations, ActionResult]:
        """Return the observations of the last answer, once, and the action's result."""
        observations, self._undelivered = self._undelivered, None
        return observations or {}, ActionResult[self._state["result"]]


@contextmanager
def _announced(what: str) -> Iterator[None]:
    """Print what is begun; the caller ends the line with the outcome, an error ends it without."""
    print(f"{what} ... ", end="", flush=True)
    try:
        yield
    except BenchbotError:
        print(flush=True)
        raise


def _mistake(error: BenchbotError, kind: type[BenchbotError]) -> BenchbotError:
    """Return an error that the solution has caused as `kind`, whose traceback begins anew, and others as they are."""
    if error.failure not in (FailureClass.AGENT, FailureClass.COLLISION):
        return error
    code, failure = error.exit_code, error.failure
    return kind(error.title, error.why, error.fix, exit_code=code, failure=failure, ends_run=error.ends_run)


def _unusable_result(title: str, why: str, fix: str) -> BenchbotError:
    return BenchbotError(title, why, fix, exit_code=ExitCode.SUBMISSION_FAILED, failure=FailureClass.AGENT)


def _call_remote(client: Client, name: str, *args: Any, **kwargs: Any) -> Any:
    return client.results_function(name, args, kwargs)
