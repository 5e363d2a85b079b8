"""The forms of a run and of a submission, and the commands that their fields make."""

import math
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Select
from textual.widgets._select import NoSelection

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.request import Limits, RunRequest
from benchbot.core.text import one_line
from benchbot.plugins.screens.widgets import words_of

T = TypeVar("T")

NUMBERS = {
    "Seed": "0",
    "Episode": "the first, where the task has several",
    "Steps at most": "as the task says",
    "Simulated s at most": "as the task says",
    "Real s at most": "as the task says",
}
"""Labels of the fields of a run, and the default of each."""
NO_SOLUTION, OWN_COMMAND = "", "\0own"
NOT_SCORED = ""
_RUNS = [("on this machine, as you", "native"), ("in a sandbox: somebody else's", "sandboxed")]


@dataclass(frozen=True)
class SubmissionOptions:
    """The options of `benchbot submit`: a solution, the file and method of its result, and more."""

    result: Path
    example: str | None = None
    command: str | None = None
    sandboxed: bool = False
    arguments: str = ""
    method: str | None = None
    more: tuple[str, ...] = ()

    def words(self) -> list[str]:
        """Return the options of `benchbot submit`; raises BenchbotError when there is nothing to submit."""
        if self.example is None and not (self.command or "").strip():
            raise BenchbotError(
                "There is nothing to submit.",
                "No example is chosen, and no command is written.",
                "Choose an example, or write the command that starts your solution.",
            )
        chosen = f"--native={self.command}" if self.example is None else f"--example={self.example}"
        return [
            chosen,
            *(["--sandboxed"] if self.sandboxed else []),
            *([f"--args={self.arguments}"] if self.arguments.strip() else []),
            f"--results-location={self.result}",
            *([f"--evaluate-with={self.method}"] if self.method is not None else []),
            *self.more,
            "--json",
        ]


@dataclass(frozen=True)
class Offers:
    """The examples that a form offers, by name, and the methods of evaluation, the task's own one first."""

    examples: Mapping[str, str]
    methods: tuple[str, ...]


class Field(Horizontal):
    """A label and its widget, in one line."""

    def __init__(self, label: str, widget: Input | Select[str]) -> None:
        super().__init__(Label(label), widget, classes="field")


class RunForm(Vertical):
    """Seed, episode and limits."""

    DEFAULT_CSS = "RunForm { height: auto; }"

    def compose(self) -> ComposeResult:
        """Show the fields, empty."""
        for label, otherwise in NUMBERS.items():
            yield Field(label, Input(placeholder=otherwise, compact=True, id=_id(label)))

    def request(self, task: str, robot: str, environment: str) -> RunRequest:
        """Return the run that is asked for; raises BenchbotError for a field that is not a number."""
        fields = {label: self.query_one(f"#{_id(label)}", Input).value for label in NUMBERS}
        limits = Limits(
            number(fields, "Steps at most", least=1),
            seconds(fields, "Simulated s at most"),
            seconds(fields, "Real s at most"),
        )
        seed, episode = number(fields, "Seed") or 0, number(fields, "Episode")
        return RunRequest(task, robot, environment, seed, episode, limits=limits)


class SolutionForm(Vertical):
    """The solution, its arguments, whether it is sandboxed, its method of evaluation, and the file of its result."""

    DEFAULT_CSS = "SolutionForm { height: auto; }"

    def __init__(self, *, none: str | None) -> None:
        super().__init__()
        self._none = none

    def compose(self) -> ComposeResult:
        """Show the fields."""
        first: list[tuple[str, str]] = [] if self._none is None else [(self._none, NO_SOLUTION)]
        self._first = [*first, ("a command of mine", OWN_COMMAND)]
        yield Field("Solution", Select(self._first, allow_blank=False, compact=True, id="solution"))
        yield Field("Command", Input(placeholder="python my_solution.py", compact=True, id="command"))
        yield Field("Its words", Input(placeholder="none", compact=True, id="arguments"))
        yield Field("Runs", Select(_RUNS, allow_blank=False, compact=True, id="runs"))
        yield Field("Scored by", Select([("nobody", NOT_SCORED)], allow_blank=False, compact=True, id="method"))
        yield Field("Result", Input(placeholder="a new folder in results", compact=True, id="result"))
        yield Field("More options", Input(placeholder="as in a shell", compact=True, id="more"))

    @property
    def more(self) -> list[str]:
        """The options that have no field; raises BenchbotError for a quotation that is not closed."""
        return words_of(self.query_one("#more", Input).value)

    def offer(self, offers: Offers) -> None:
        """Offer what fits the task; keep the present choice where it is still offered."""
        examples = [(f"{name}: {about}"[:100], name) for name, about in offers.examples.items()]
        _set(self.query_one("#solution", Select), [*self._first, *examples])
        method = self.query_one("#method", Select)
        unscored = method.value == NOT_SCORED
        _set(method, [*((name, name) for name in offers.methods), ("nobody", NOT_SCORED)])
        if unscored and offers.methods:
            method.value = offers.methods[0]

    def on_select_changed(self, event: Select.Changed) -> None:
        """Enable the field of the command only for a command of the user's own."""
        if event.select.id == "solution":
            self.query_one("#command", Input).disabled = event.value != OWN_COMMAND

    def options(self, environment: str) -> SubmissionOptions | None:
        """Return the options of the submission, None without a solution; raises BenchbotError where one is missing."""
        solution = self._chosen("solution")
        if solution == NO_SOLUTION:
            return None
        result = self.query_one("#result", Input).value.strip()
        own = solution == OWN_COMMAND
        options = SubmissionOptions(
            result=Path(result).expanduser().absolute() if result else new_result(environment),
            example=None if own else solution,
            command=self.query_one("#command", Input).value if own else None,
            sandboxed=self._chosen("runs") == "sandboxed",
            arguments=self.query_one("#arguments", Input).value,
            method=self._chosen("method") or None,
            more=tuple(self.more),
        )
        options.words()
        return options

    def _chosen(self, name: str) -> str:
        value = self.query_one(f"#{name}", Select).value
        return "" if isinstance(value, NoSelection) else str(value)


def run_words(request: RunRequest) -> list[str]:
    """Return the command that starts a robot and waits for solutions, at any free port."""
    return ["run", *request_words(request), "--port=0"]


def submit_words(solution: SubmissionOptions, request: RunRequest | None = None) -> list[str]:
    """Return the command that submits a solution, to a live run or with a back end of its own."""
    return ["submit", *solution.words(), *(request_words(request) if request else [])]


def request_words(request: RunRequest) -> list[str]:
    """Return the options of `benchbot run` and `benchbot submit` that ask for a run."""
    options = {
        "--task": request.task,
        "--robot": request.robot,
        "--env": request.environment,
        "--seed": request.seed,
        "--secret": "random" if request.secret else None,
        "--episode": request.episode,
        "--max-steps": request.limits.steps,
        "--max-simulated-time": request.limits.simulated_time_s,
        "--max-wall-time": request.limits.wall_time_s,
        "--max-restarts": request.limits.restarts,
    }
    return [f"{name}={value}" for name, value in options.items() if value is not None]


def new_result(environment: str) -> Path:
    """Return the default file of a result: in a new folder of `results` in the working folder."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return Path.cwd() / "results" / f"{environment.replace(':', '_')}-{stamp}" / "result.json"


def number(fields: Mapping[str, str], name: str, *, least: int = 0) -> int | None:
    """Return the whole number in a field, None for an empty one; raises BenchbotError for anything else."""
    return _parsed(fields[name], int, lambda value: value >= least, f"{name} is not a whole number, {least} or more.")


def seconds(fields: Mapping[str, str], name: str) -> float | None:
    """Return the positive number in a field, None for an empty one; raises BenchbotError for anything else."""
    return _parsed(fields[name], float, lambda value: 0 < value < math.inf, f"{name} is not a number of seconds.")


def offers_of(catalog: Catalog, task: str) -> Offers:
    """Return the examples, and the methods that can score results of a task."""
    from benchbot.evaluation.score import method_for_task

    examples = {
        name: " ".join(str(declared.data.get("description", "")).split())
        for name, declared in sorted(catalog.pool("examples").items())
    }
    try:
        details = catalog.get("tasks", task).data
    except BenchbotError:
        return Offers(examples, ())
    pool = catalog.plugins.pool("evaluators")
    fitting = [
        name
        for name, provided in sorted(pool.items())
        if details.get("results_format") in provided.value.result_formats
    ]
    try:
        own = method_for_task(catalog, None, dict(details)).name
    except BenchbotError:
        return Offers(examples, tuple(fitting))
    return Offers(examples, (own, *(name for name in fitting if name != own)))


def _parsed(text: str, parse: Callable[[str], T], valid: Callable[[T], bool], problem: str) -> T | None:
    text = text.strip()
    if not text:
        return None
    with suppress(ValueError):
        value = parse(text)
        if valid(value):
            return value
    raise BenchbotError(problem, f"It is {text!r}.", "Mend it, or leave it empty.")


def _set(select: Select[str], options: Iterable[tuple[str, str]]) -> None:
    before = select.value
    kept = [(Text(one_line(label)), value) for label, value in options]
    select.set_options(kept)
    if before in [value for _, value in kept]:
        select.value = before


def _id(label: str) -> str:
    return label.lower().replace(" ", "-")
