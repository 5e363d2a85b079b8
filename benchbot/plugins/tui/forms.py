"""Fields in rows: a label and an input or a list, one line each, so that a form fits into few lines."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Label, Select
from textual.widgets._select import NoSelection

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.tui import orders
from benchbot.plugins.tui.orders import RunOrder, SolutionOrder

NUMBERS = {
    "Seed": "0",
    "Episode": "the first, where the task has several",
    "Steps at most": "as the task says",
    "Simulated s at most": "as the task says",
    "Real s at most": "as the task says",
}
"""Labels of the fields of a run, and what is so when they are left empty."""
NO_SOLUTION, OWN_COMMAND = "", "\0own"
NOT_SCORED = ""


@dataclass(frozen=True)
class Offers:
    """What the form of a solution offers: examples by name, and methods of evaluation, the task's own one first."""

    examples: Mapping[str, str]
    methods: tuple[str, ...]


class Field(Horizontal):
    """A label and what it is the label of."""

    def __init__(self, label: str, widget: Input | Select[str]) -> None:
        super().__init__(Label(label), widget, classes="field")


class RunForm(Vertical):
    """Seed, episode and limits."""

    DEFAULT_CSS = "RunForm { height: auto; }"

    def compose(self) -> ComposeResult:
        """Show the fields, empty."""
        for label, otherwise in NUMBERS.items():
            yield Field(label, Input(placeholder=otherwise, compact=True, id=_id(label)))

    def order(self, task: str, robot: str, environment: str) -> RunOrder:
        """Return what is to be run; raises BenchbotError for a field that is not a number."""
        fields = {label: self.query_one(f"#{_id(label)}", Input).value for label in NUMBERS}
        return RunOrder(
            task,
            robot,
            environment,
            seed=orders.number(fields, "Seed") or 0,
            episode=orders.number(fields, "Episode"),
            max_steps=orders.number(fields, "Steps at most", least=1),
            max_simulated_time_s=orders.seconds(fields, "Simulated s at most"),
            max_wall_time_s=orders.seconds(fields, "Real s at most"),
        )


class SolutionForm(Vertical):
    """Which solution, with what words, whether apart from the machine, how scored, and where its result goes."""

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

    def offer(self, offers: Offers) -> None:
        """Offer what goes with the task; what was chosen stays where it still can be."""
        examples = [(f"{name}: {about}"[:100], name) for name, about in offers.examples.items()]
        _set(self.query_one("#solution", Select), [*self._first, *examples])
        method = self.query_one("#method", Select)
        unscored = method.value == NOT_SCORED
        _set(method, [*((name, name) for name in offers.methods), ("nobody", NOT_SCORED)])
        if unscored and offers.methods:
            method.value = offers.methods[0]

    def on_select_changed(self, event: Select.Changed) -> None:
        """A command is written only where an own one is chosen."""
        if event.select.id == "solution":
            self.query_one("#command", Input).disabled = event.value != OWN_COMMAND

    def order(self, environment: str) -> SolutionOrder | None:
        """Return what is to be submitted, None when nothing is; raises BenchbotError for a form half filled in."""
        solution = self._chosen("solution")
        if solution == NO_SOLUTION:
            return None
        result = self.query_one("#result", Input).value.strip()
        own = solution == OWN_COMMAND
        order = SolutionOrder(
            result=Path(result).expanduser().absolute() if result else orders.new_result(environment),
            example=None if own else solution,
            command=self.query_one("#command", Input).value if own else None,
            sandboxed=self._chosen("runs") == "sandboxed",
            arguments=self.query_one("#arguments", Input).value,
            method=self._chosen("method") or None,
        )
        order.words()
        return order

    def _chosen(self, name: str) -> str:
        value = self.query_one(f"#{name}", Select).value
        return "" if isinstance(value, NoSelection) else str(value)


_RUNS = [("on this machine, as you", "native"), ("in a sandbox: somebody else's", "sandboxed")]


def offers_of(catalog: Catalog, task: str) -> Offers:
    """Return what can be submitted to a task, and how it can be scored."""
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


def _set(select: Select[str], options: Iterable[tuple[str, str]]) -> None:
    before = select.value
    kept = list(options)
    select.set_options(kept)
    if before in [value for _, value in kept]:
        select.value = before


def _id(label: str) -> str:
    return label.lower().replace(" ", "-")
