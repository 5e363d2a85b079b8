"""The first screen: the runs and batches that are alive, and the jobs from here."""

import time
from contextlib import closing
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.screen import Screen
from textual.widgets import Footer, OptionList, Static
from textual.widgets.option_list import Option

from benchbot.plugins.batch.status_lines import duration
from benchbot.plugins.tui.base import BaseApp
from benchbot.plugins.tui.jobs import RUNNING, WELL, JobStatus
from benchbot.plugins.watching.views import BatchEntry
from benchbot.wire.run_state import RUN, RunState

Item = RunState | BatchEntry | JobStatus
SIGNS = {RUNNING: "▶", WELL: "✓"}
SIGN_COLORS = {"▶": "blue", "✓": "green", "◐": "yellow", "✗": "red"}
"""The colours of the signs, as the terminal's palette has them."""
NOTHING = """\
No run and no batch of yours is alive on this machine.

n  a new run: choose a task, a robot and an environment
R  look at results
Ctrl-P  every screen and action, by name

What is started in another terminal appears here by itself:
benchbot run, benchbot submit, benchbot batch"""


class HomeScreen(Screen[None]):
    """Lists what is alive. Enter watches it; leaving the screens does not end it."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "open", "Watch", tooltip="Watch a run or a batch, look at a job", show=True),
        Binding("n", "new", "New run", tooltip="Choose a task, a robot and an environment, and start"),
        Binding("s", "submit", "Submit", tooltip="Submit a solution to the run that is marked"),
        Binding("R", "results", "Results", tooltip="Look at results, evaluate them, make reports"),
        Binding("x", "end", "End it", tooltip="End the run or the job that is marked"),
        Binding("j", "app.simulate_key('down')", "Down", show=False),
        Binding("k", "app.simulate_key('up')", "Up", show=False),
        Binding("q", "app.quit", "Quit", tooltip="Quit; what runs goes on"),
    ]
    app: BaseApp

    def __init__(self) -> None:
        super().__init__()
        self._items: dict[str, Item] = {}
        self._told = ""
        self._shown: list[tuple[str | None, str]] = []

    def compose(self) -> ComposeResult:
        """Show the lists."""
        yield Horizontal(Static("BenchBot"), Static("Ctrl-P  every screen and action", id="palette"), classes="bar")
        with Horizontal(classes="pane"):
            yield OptionList(id="alive", classes="list", markup=False)
            yield VerticalScroll(Static(id="about", markup=False), classes="details", can_focus=False)
        yield Footer()

    def on_screen_resume(self) -> None:
        """Show the lists of this moment."""
        self._show()

    def on_base_app_looked(self) -> None:
        """Show the new lists."""
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
        """The item under the cursor."""
        option = self.query_one(OptionList).highlighted_option
        return None if option is None or option.id is None else self._items.get(option.id)

    def action_open(self) -> None:
        """Watch what is marked."""
        item = self.marked
        if isinstance(item, RunState):
            self.app.watch_run(item)
        elif isinstance(item, BatchEntry):
            self.app.watch_batch(item.folder)
        elif item is not None:
            self.app.show_job(item.job)

    def action_new(self) -> None:
        """Choose a new run."""
        # What is imported here would make the first screen wait.
        from benchbot.plugins.tui.new_run import NewRunScreen

        self.app.push_screen(NewRunScreen())

    def action_submit(self) -> None:
        """Submit to the run that is marked."""
        from benchbot.plugins.tui.submissions import SubmitScreen

        item = self.marked
        if isinstance(item, RunState) and item.owner == RUN:
            self.app.push_screen(SubmitScreen(item))
        elif isinstance(item, RunState):
            self.notify(f"It lets in the solutions of {item.owner} only.")
        else:
            self.notify("Mark a run first, or press n for a new one with a solution.")

    def action_results(self) -> None:
        """Look at results."""
        from benchbot.plugins.tui.results import ResultsScreen

        folder = Path.cwd() / "results"
        self.app.push_screen(ResultsScreen(folder if folder.is_dir() else Path.cwd()))

    def action_end(self) -> None:
        """Ask whether to end what is marked."""
        item = self.marked
        if isinstance(item, RunState):
            text = f"End the run of {item.environment}? A solution that is at work in it fails."
            self.app.confirm(text, "x", "end it", lambda: self._end_run(item))
        elif isinstance(item, JobStatus) and item.job.alive:
            self.app.end_job(f"End {item.job.title}?", item.job)
        elif isinstance(item, BatchEntry):
            self.notify("Open the batch: there it can be cancelled.")

    def _end_run(self, state: RunState) -> None:
        from benchbot.plugins.watching.run_feed import ANSWER_TIMEOUT_S, WatchClient

        def stop() -> None:
            with closing(WatchClient(state, ANSWER_TIMEOUT_S)) as client:
                client.stop("a key of its screen")

        self.app.in_thread(stop, lambda _: self.notify(f"The run of {state.environment} is ending."))

    def _show(self) -> None:
        """Update the lists, and keep the cursor where it was."""
        alive = self.app.alive
        options = self.query_one(OptionList)
        option = options.highlighted_option
        before = None if option is None else option.id
        self._items = {}
        rows: list[Option] = []
        for heading, items in (("Runs", alive.runs), ("Batches", alive.batches), ("Submitted from here", alive.jobs)):
            if items:
                rows.append(Option(Text(heading, "bold underline"), disabled=True))
            for item in items:
                name = str(item.job.folder if isinstance(item, JobStatus) else item.folder)
                self._items[name] = item
                title, subtitle, _ = _described(item)
                colored = Text.assemble((title[0], SIGN_COLORS.get(title[0], "")), title[1:])
                rows.append(Option(Text.assemble(colored, "\n", (f"  {subtitle}", "dim")), id=name))
        if not rows:
            rows.append(Option(Text(NOTHING), disabled=True))
        shown = [(row.id, str(row.prompt)) for row in rows]
        if shown != self._shown:
            self._shown = shown
            options.set_options(rows)
            keys = [row.id for row in rows]
            named = [key for key in keys if key is not None]
            if named:
                options.highlighted = keys.index(before if before in named else named[0])
            elif not self.is_current or options.has_focus:
                options.highlighted = None
        self._tell()

    def _tell(self) -> None:
        item = self.marked
        facts = {} if item is None else _described(item)[2]
        text = "\n".join(f"{label}\n  {value}" for label, value in facts.items() if value)
        if text != self._told:
            self._told = text
            self.query_one("#about", Static).update(text)


def _described(item: Item) -> tuple[str, str, dict[str, str]]:
    """Return title, subtitle and facts of an item."""
    if isinstance(item, RunState):
        facts = {
            "Task": item.task,
            "Robot": item.robot,
            "Environment": item.environment,
            "Seed": str(item.seed),
            "Alive for": duration(max(0.0, time.time() - item.started_s)),
            "Address": item.connection.url or item.connection.socket or "",
            "Process": str(item.pid),
            "Run": item.name,
            "Started by": "" if item.owner == RUN else item.owner,
        }
        subtitle = "  ".join(filter(None, [item.task, facts["Started by"]]))
        return f"▶ {item.environment}  {item.robot}  seed {item.seed}", subtitle, facts
    if isinstance(item, BatchEntry):
        counts = [f"{count} {name}" for name, count in item.failures.items()]
        facts = {
            "Batch": str(item.folder),
            "Episodes": f"{item.finished} of {item.episodes} are finished",
            "Failed": ", ".join(counts),
            "Score": "" if item.score is None else f"{item.score.name} {item.score.value:.4f}",
            "Now": "alive" if item.alive else "nobody works on it",
        }
        failed = sum(item.failures.values())
        score = f", {item.score.name} {item.score.value:.3f}" if item.score is not None else ""
        said = f"{item.finished} of {item.episodes}" + (f", ✗ {failed} failed" if failed else "") + score
        return f"{_sign(item, failed)} {item.folder.name}  {said}", str(item.folder.parent), facts
    job = item.job
    facts = {"Job": job.title, "Now": item.summary, "Result": str(job.result or ""), "Command": job.command}
    return f"{SIGNS.get(item.state, '✗')} {job.title}", item.summary, facts


def _sign(item: BatchEntry, failed: int) -> str:
    """Return ▶ of a batch that is alive, ◼ of one that was left; else ✓ without failures, ✗ with nothing but them."""
    if item.alive:
        return "▶"
    if item.finished < item.episodes:
        return "◼"
    return "✓" if not failed else "✗" if failed == item.finished else "◐"
