"""The screen of a new batch: its matrix, size and time, what is impossible and why, its preflight and its start."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Input, Static

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.text import one_line
from benchbot.plugins.batch import estimate, machine, matrix, request
from benchbot.plugins.batch.estimate import Durations, Place
from benchbot.plugins.screens.child_command import Outcome
from benchbot.plugins.screens.command_screen import CommandScreen
from benchbot.plugins.screens.widgets import CheckList, ChoiceField, OptionsField, TextField

LISTS = {"robots": "Robots", "environments": "Environments", "examples": "Solutions (examples)"}
MOST_ROWS = 200
MOST_REASONS = 6


@dataclass(frozen=True)
class Choices:
    """What is installed: the names to choose from, and the methods that score each task, its own one first."""

    names: Mapping[str, Sequence[str]]
    methods: Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class Matrix:
    """What the form asks for, and what is known of it: the reasons against each place, and how long episodes take."""

    task: str
    places: Sequence[Place]
    reasons: Mapping[Place, Sequence[BenchbotError]] = field(default_factory=dict)
    durations: Durations = field(default_factory=lambda: Durations({}, 0))


class NewBatchScreen(CommandScreen):
    """Chooses the axes of a batch, and starts it as a detached one, which goes on without the screens."""

    HEADING = "New batch"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+t", "check", "Check", tooltip="Make the preflight, count the episodes; start nothing"),
        Binding("ctrl+s", "start", "Start", tooltip="Start the batch, which goes on without the screens"),
    ]
    DEFAULT_CSS = """
    NewBatchScreen #matrix { height: auto; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._choices: Choices | None = None
        self._matrix: Matrix | None = None
        self._known: dict[tuple[str, Place], Sequence[BenchbotError]] = {}
        self._task_field: ChoiceField | None = None

    def body(self) -> ComposeResult:
        """Yield the form, and what is known of the matrix beside it."""
        self._task_field = ChoiceField("Task", [("reading what is installed …", "")])
        self._method_field = ChoiceField("Scored by", [("nobody", "")])
        self._commands_field = TextField("Own commands", placeholder="python mine.py; or NAME=COMMAND; NAME=COMMAND")
        self._seeds_field = TextField("Seeds", "0", placeholder="0..4 or 0,3,7")
        self._repeats_field = TextField("Repeats", placeholder="1")
        self._workers_field = TextField(
            "Workers", placeholder=f"{machine.free_capacity().jobs()}: what there is room for"
        )
        self._folder_field = TextField("Folder", placeholder="batch-HASH, here")
        self._more_field = OptionsField(placeholder="--max-steps 100 --set lighting.time=08:00,20:00 …")
        with Horizontal(classes="pane"):
            with VerticalScroll(classes="form", can_focus=False):
                yield self._task_field
                for name, label in LISTS.items():
                    yield Static(label, classes="heading")
                    yield CheckList(id=name)
                yield self._commands_field
                yield self._seeds_field
                yield self._repeats_field
                yield self._method_field
                yield self._workers_field
                yield self._folder_field
                yield self._more_field
            with VerticalScroll(classes="details", can_focus=False):
                yield Static(id="size", markup=False)
                yield Static(id="matrix", markup=False)

    def on_mount(self) -> None:
        """Read what is installed, in a thread."""
        super().on_mount()
        self.app.in_thread(lambda: choices_of(self.app.catalog), self._offer)

    def words(self) -> list[str]:
        """Return the command of this batch; raises BenchbotError for what is missing or cannot be read."""
        if self._task_field is None or self._choices is None:
            raise BenchbotError("Reading what is installed …", "", "")
        robots, environments = self._chosen("robots"), self._chosen("environments")
        missing = [
            name
            for name, value in (
                ("a task", self._task_field.value),
                ("a robot", robots),
                ("an environment", environments),
            )
            if not value
        ]
        solutions = solution_words(self._chosen("examples"), self._commands_field.value)
        if missing or not solutions:
            missing += [] if solutions else ["a solution"]
            raise BenchbotError(
                f"Choose {', '.join(missing)}.", "A batch computes every combination.", "Space chooses what is marked."
            )
        options = {
            "--seeds": self._seeds_field.value or "0",
            "--repeats": self._repeats_field.value,
            "--evaluate-with": self._method_field.value,
            "--jobs": self._workers_field.value,
            "--output-location": self._folder_field.value,
        }
        given = [f"{name}={value}" for name, value in options.items() if value]
        axes = ["--robots", ",".join(robots), "--envs", ",".join(environments)]
        return ["batch", "--task", self._task_field.value, *axes, *solutions, *given, *self._more_field.words]

    def on_input_changed(self) -> None:
        """Show the command and the size as they are now."""
        self._changed()

    def on_select_changed(self) -> None:
        """Offer the methods of the task, and show the command and the matrix as they are now."""
        if self._choices is not None and self._task_field is not None:
            methods = [(name, name) for name in self._choices.methods.get(self._task_field.value, ())]
            if [value for _, value in self._offered] != [value for _, value in methods]:
                self._offered = methods
                self._method_field.offer([*methods, ("nobody", "")])
                self._method_field.value = methods[0][1] if methods else ""
        self._changed()

    _offered: list[tuple[str, str]] = []  # noqa: RUF012 - replaced, never changed

    def on_check_list_chosen(self) -> None:
        """Show the command and the matrix as they are now."""
        self._changed()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Go on to the next field."""
        self.focus_next()

    def action_check(self) -> None:
        """Make the preflight: every check of the command, and the exact number of episodes."""
        self.run_words(["--dry-run", "--json"], self._checked, doing="Checking", only_looks=True)

    def action_start(self) -> None:
        """Start the batch and watch it."""
        self.run_words(["--detach", "--json"], self._started, doing="Starting the batch")

    def _checked(self, outcome: Outcome) -> None:
        document = outcome.document
        done = sum(episode["done"] for episode in document["episodes"])
        lines = [
            f"✓ Nothing is in the way: {len(document['episodes'])} episodes, {done} of them done.",
            f"Folder: {document['folder']}",
        ]
        self.say("\n".join([*lines, *(line.strip() for line in outcome.said if line.strip())]), "green")

    def _started(self, outcome: Outcome) -> None:
        folder = Path(outcome.document["folder"])
        self.dismiss(None)
        self.app.watch_batch(folder)

    def _offer(self, choices: Choices) -> None:
        if not self.is_attached or self._task_field is None:
            return
        self._choices = choices
        for name in LISTS:
            self.query_one(f"#{name}", CheckList).offer({each: each for each in choices.names[name]})
        tasks = [(name, name) for name in choices.names["tasks"]]
        self._task_field.offer(tasks or [("no task is installed", "")])
        self._task_field.value = tasks[0][1] if tasks else ""
        self.query_one("#robots").focus()
        self.on_select_changed()

    def _chosen(self, name: str) -> list[str]:
        return self.query_one(f"#{name}", CheckList).chosen

    def _changed(self) -> None:
        """Show command and size; look in a thread at what is not known yet of the matrix."""
        self.show_words()
        if self._choices is None or self._task_field is None:
            return
        task = self._task_field.value
        places = [(robot, place) for robot in self._chosen("robots") for place in self._chosen("environments")]
        asked = Matrix(task, places[:MOST_ROWS])
        if self._matrix is None or (asked.task, asked.places) != (self._matrix.task, self._matrix.places):
            self._matrix = asked
            self.app.in_thread(lambda: self._looked_at(asked), self._show_matrix)
        self._show_size()

    def _looked_at(self, asked: Matrix) -> Matrix:
        for place in asked.places:
            if (asked.task, place) not in self._known:
                self._known[asked.task, place] = reasons_against(self.app.catalog, asked.task, place)
        reasons = {place: self._known[asked.task, place] for place in asked.places}
        return replace(asked, reasons=reasons, durations=estimate.durations(asked.task, asked.places))

    def _show_matrix(self, found: Matrix) -> None:
        if self.is_attached and self._matrix is not None and found.places == self._matrix.places:
            self._matrix = found
            self._show_size()

    def _show_size(self) -> None:
        """Show how many episodes there are, how long they take, and the matrix with its reasons."""
        found = self._matrix
        if found is None:
            return
        self.query_one("#size", Static).update(self._sized(found))
        self.query_one("#matrix", Static).update(matrix_text(found))

    def _sized(self, found: Matrix) -> str:
        try:
            seeds = request.numbers("--seeds", self._seeds_field.value or "0")
            solutions = max(1, len(_named(self._commands_field.value)) + len(self._chosen("examples")))
        except BenchbotError as error:
            return f"✗ {error.title}\n{error.why}"
        repeats = int(self._repeats_field.value) if self._repeats_field.value.isdigit() else 1
        each = solutions * len(seeds) * max(1, repeats)
        robots, environments = len(self._chosen("robots")), len(self._chosen("environments"))
        count = each * robots * environments
        parts = [(solutions, "solution"), (robots, "robot"), (environments, "environment"), (len(seeds), "seed")]
        product = " × ".join(f"{number} {noun}{'s' * (number != 1)}" for number, noun in parts)
        product += f" × {repeats} repeats" if repeats > 1 else ""
        workers = (
            int(self._workers_field.value) if self._workers_field.value.isdigit() else machine.free_capacity().jobs()
        )
        lines = [f"{product} = {count} episodes" + (", and what more options add" if self._more_field.value else "")]
        if count and len(found.reasons) == len(found.places):
            lines.append(found.durations.told(dict.fromkeys(found.places, each), min(workers, count)))
        return "\n".join(lines)


def choices_of(catalog: Catalog) -> Choices:
    """Return what can be chosen."""
    from benchbot.evaluation.score import method_for_task

    names = {kind: catalog.names(kind) for kind in ("tasks", *LISTS)}
    evaluators = catalog.plugins.pool("evaluators")
    methods = {}
    for task in names["tasks"]:
        try:
            details = catalog.get("tasks", task).data
        except BenchbotError:
            continue
        fitting = [
            name
            for name in sorted(evaluators)
            if details.get("results_format") in evaluators[name].value.result_formats
        ]
        try:
            own = [method_for_task(catalog, None, dict(details)).name]
        except BenchbotError:
            own = []
        methods[task] = list(dict.fromkeys([*own, *fitting]))
    return Choices(names, methods)


def reasons_against(catalog: Catalog, task: str, place: Place) -> Sequence[BenchbotError]:
    """Return every reason why a batch cannot compute a task on a robot in an environment, as the command finds them."""
    from benchbot.core.selection import ImpossibleError

    robot, environment = place
    try:
        matrix.selections(request.BatchRequest(task, [robot], [environment]), catalog)
    except BenchbotError as error:
        return error.reasons if isinstance(error, ImpossibleError) else (error,)
    return ()


def solution_words(examples: Sequence[str], commands: str) -> list[str]:
    """Return the options for the chosen solutions, each with a name where there are several.

    Raises BenchbotError for several commands without names.
    """
    own = _named(commands)
    if len(examples) + len(own) == 1:
        name, command = next(iter(own), ("", ""))
        if examples:
            return ["--example", examples[0]]
        return ["--solution", f"{name}={command}"] if name else ["--native", command]
    nameless = [command for name, command in own if not name]
    if nameless:
        raise BenchbotError(
            "Several solutions need a name each.",
            f"This one has none: {nameless[0]}.",
            "Write NAME=COMMAND, with ';' between them: ours=python ours.py; base=python base.py",
        )
    named = [*((example, f"example:{example}") for example in examples), *own]
    return [word for name, command in named for word in ("--solution", f"{name}={command}")]


def matrix_text(found: Matrix) -> Text:
    """Return the places, ✓ or ✗ each, with the reasons; the impossible ones first."""
    text = Text()
    said: dict[str, BenchbotError] = {}
    for place in sorted(found.places, key=lambda each: not found.reasons.get(each)):
        reasons = found.reasons.get(place)
        sign, color = ("·", "dim") if reasons is None else ("✗", "red") if reasons else ("✓", "green")
        known_s = found.durations.of_place_s.get(place)
        text.append(f"\n{sign} ", color)
        text.append(one_line(f"{place[0]} in {place[1]}") + ("" if known_s is None else f"  {known_s:.0f} s each"))
        said |= {f"{reason.title}{reason.why}": reason for reason in reasons or ()}
    for reason in list(said.values())[:MOST_REASONS]:
        text.append(f"\n\n✗ {reason.title}", "bold")
        text.append(f"\n{reason.why}\n→ {reason.fix}")
    return text


def _named(commands: str) -> list[tuple[str, str]]:
    """Return names, empty where there is none, and commands of `NAME=COMMAND; COMMAND`."""
    found = []
    for text in filter(None, map(str.strip, commands.split(";"))):
        name, separator, command = text.partition("=")
        named = bool(separator) and name.strip().replace("-", "_").replace(".", "_").isidentifier()
        found.append((name.strip(), command.strip()) if named else ("", text))
    return found
