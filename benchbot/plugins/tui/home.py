"""The first screen: the runs and batches that are alive, and what was submitted from here."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.screen import Screen
from textual.widgets import Footer, OptionList, Static
from textual.widgets.option_list import Option

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch.status_lines import duration
from benchbot.plugins.tui import jobs
from benchbot.plugins.tui.alive import RUNNING, WELL, Started
from benchbot.plugins.tui.question import Question
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import BatchEntry
from benchbot.wire.run_state import RunState

if TYPE_CHECKING:
    from benchbot.plugins.tui.app import BenchbotApp

Item = RunState | BatchEntry | Started
SIGNS = {RUNNING: "▶", WELL: "✓"}
NOTHING = """\
No run and no batch of yours is alive on this machine.

n  a new run: choose a task, a robot and an environment
r  look at results

What is started in another terminal appears here by itself:
benchbot run, benchbot submit, benchbot batch"""


class HomeScreen(Screen[None]):
    """What is alive. Enter watches it, and it goes on when nobody does."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "open", "Watch", tooltip="Watch a run or a batch, look at a submission", show=True),
        Binding("n", "new", "New run", tooltip="Choose a task, a robot and an environment, and start"),
        Binding("s", "submit", "Submit", tooltip="Submit a solution to the run that is marked"),
        Binding("r", "results", "Results", tooltip="Look at results, evaluate them, make reports"),
        Binding("x", "end", "End it", tooltip="End the run or the submission that is marked"),
        Binding("q", "app.quit", "Quit", tooltip="Quit; what runs goes on"),
    ]
    app: "BenchbotApp"

    def __init__(self) -> None:
        super().__init__()
        self._items: dict[str, Item] = {}

    def compose(self) -> ComposeResult:
        """Show the lists."""
        yield Static("BenchBot", classes="bar")
        with Horizontal(classes="pane"):
            yield OptionList(id="alive", classes="list", markup=False)
            yield VerticalScroll(Static(id="about", markup=False), classes="details", can_focus=False)
        yield Footer()

    def on_mount(self) -> None:
        """Show what is known already."""
        self._show()

    def on_screen_resume(self) -> None:
        """Show what has changed while something else was shown."""
        self._show()

    def on_benchbot_app_looked(self) -> None:
        """Show the news."""
        if self.is_current:
            self._show()

    def on_option_list_option_highlighted(self) -> None:
        """Tell more of what is marked."""
        self._tell()

    def on_option_list_option_selected(self) -> None:
        """Open what is marked."""
        self.action_open()

    @property
    def marked(self) -> Item | None:
        """What the cursor is on."""
        option = self.query_one(OptionList).highlighted_option
        return None if option is None or option.id is None else self._items.get(option.id)

    def action_open(self) -> None:
        """Watch what is marked."""
        from benchbot.plugins.tui.job_screen import JobScreen

        item = self.marked
        if isinstance(item, RunState):
            self.app.watch_run(item)
        elif isinstance(item, BatchEntry):
            self.app.watch_batch(item.folder)
        elif item is not None:
            self.app.push_screen(JobScreen(item.job))

    def action_new(self) -> None:
        """Choose a new run."""
        from benchbot.plugins.tui.new_run import NewRunScreen

        self.app.push_screen(NewRunScreen())

    def action_submit(self) -> None:
        """Submit to the run that is marked."""
        from benchbot.plugins.tui.submit import SubmitScreen

        item = self.marked
        if isinstance(item, RunState):
            self.app.push_screen(SubmitScreen(item))
        else:
            self.notify("Mark a run first, or press n for a new one with a solution.")

    def action_results(self) -> None:
        """Look at results."""
        from benchbot.plugins.tui.results import ResultsScreen

        folder = Path.cwd() / "results"
        self.app.push_screen(ResultsScreen(folder if folder.is_dir() else Path.cwd()))

    def action_end(self) -> None:
        """End what is marked, if that is meant."""
        item = self.marked
        if isinstance(item, RunState):
            text = f"End the run of {item.environment}? A solution that is at work in it fails."
            self.app.push_screen(Question(text, {"e": "end it"}), lambda answer: self._end_run(item, answer))
        elif isinstance(item, Started) and item.job.alive:
            text = f"End the submission {item.title}?"
            self.app.push_screen(Question(text, {"e": "end it"}), lambda answer: self._end_job(item, answer))
        elif isinstance(item, BatchEntry):
            self.notify("Open the batch: there it can be cancelled.")

    def _end_run(self, state: RunState, answer: str | None) -> None:
        if answer is not None:
            feed = RunFeed(state)

            def stop() -> None:
                try:
                    feed.stop()
                finally:
                    feed.close()

            self.app.in_thread(stop, lambda _: self.notify(f"The run of {state.environment} is ending."))

    def _end_job(self, started: Started, answer: str | None) -> None:
        if answer is not None:
            try:
                jobs.end(started.job)
            except BenchbotError as error:
                self.app.tell(error)

    def _show(self) -> None:
        """Show the lists anew, the cursor where it was."""
        now = self.app.alive
        options = self.query_one(OptionList)
        option = options.highlighted_option
        before = None if option is None else option.id
        self._items = {}
        rows: list[Option] = []
        for heading, items in (("Runs", now.runs), ("Batches", now.batches), ("Submitted from here", now.started)):
            if items:
                rows.append(Option(Text(heading, "bold underline"), disabled=True))
            for item in items:
                name = _name(item)
                self._items[name] = item
                rows.append(Option(_prompt(item), id=name))
        if not rows:
            rows.append(Option(Text(NOTHING), disabled=True))
        shown = [(row.id, str(row.prompt)) for row in rows]
        if shown != [(row.id, str(row.prompt)) for row in options.options]:
            options.set_options(rows)
            keys = [row.id for row in rows]
            named = [key for key in keys if key is not None]
            if named:
                options.highlighted = keys.index(before if before in named else named[0])
            elif not self.is_current or options.has_focus:
                options.highlighted = None
        self._tell()

    def _tell(self) -> None:
        self.query_one("#about", Static).update(_about(self.marked))


def _name(item: Item) -> str:
    return str(item.job.folder if isinstance(item, Started) else item.folder)


def _prompt(item: Item) -> Text:
    if isinstance(item, RunState):
        first, second = f"▶ {item.environment}  {item.robot}  seed {item.seed}", item.task
    elif isinstance(item, BatchEntry):
        sign = "▶" if item.alive else "✓" if item.finished == item.episodes else "◼"
        first, second = f"{sign} {item.folder.name}  {item.finished} of {item.episodes}", str(item.folder.parent)
    else:
        first, second = f"{SIGNS.get(item.state, '✗')} {item.title}", item.said
    return Text.assemble(first, "\n", (f"  {second}", "dim"))


def _about(item: Item | None) -> str:
    if item is None:
        return ""
    if isinstance(item, RunState):
        rows = {
            "Task": item.task,
            "Robot": item.robot,
            "Environment": item.environment,
            "Seed": str(item.seed),
            "Alive for": duration(max(0.0, time.time() - item.started_s)),
            "Address": item.connection.url or item.connection.socket or "",
            "Process": str(item.pid),
            "Run": Path(item.folder).name,
        }
    elif isinstance(item, BatchEntry):
        rows = {
            "Batch": str(item.folder),
            "Episodes": f"{item.finished} of {item.episodes} are finished",
            "Now": "alive" if item.alive else "nobody works on it",
        }
    else:
        rows = {
            "Submission": item.title,
            "Now": item.said,
            "Result": str(item.job.result or ""),
            "Command": item.command,
        }
    return "\n".join(f"{label}\n  {value}" for label, value in rows.items() if value)
