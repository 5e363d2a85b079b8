"""A submission that was started from these screens: what it says, its result and its score."""

from typing import TYPE_CHECKING, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import Screen
from textual.widgets import Footer, Static

from benchbot.core.errors import BenchbotError
from benchbot.plugins.tui import jobs, opening
from benchbot.plugins.tui.alive import started
from benchbot.plugins.tui.jobs import Job
from benchbot.plugins.tui.question import Question
from benchbot.plugins.tui.results import ResultsScreen

if TYPE_CHECKING:
    from benchbot.plugins.tui.app import BenchbotApp


class JobScreen(Screen[None]):
    """What a submission says, as it says it."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "app.pop_screen", "Back"),
        Binding("w", "watch", "Watch", tooltip="Watch its run, while it is alive"),
        Binding("r", "results", "Result", tooltip="Look at its result"),
        Binding("a", "again", "Again", tooltip="Start the same once more; its result is written anew"),
        Binding("x", "end", "End it", tooltip="End it, as Ctrl-C in its terminal would"),
    ]
    app: "BenchbotApp"

    def __init__(self, job: Job) -> None:
        super().__init__()
        self.job = job
        self._shown = ""

    def compose(self) -> ComposeResult:
        """Show what it says."""
        yield Static("Submission", classes="bar", id="title", markup=False)
        yield Static(id="status", markup=False)
        with VerticalScroll(classes="text"):
            yield Static(id="log", markup=False)
        yield Footer()

    def on_mount(self) -> None:
        """Begin to follow it."""
        self.query_one(VerticalScroll).focus()
        self._show()
        self.set_interval(0.5, self._show)

    def action_watch(self) -> None:
        """Watch its run."""
        state = jobs.run_of(self.job)
        if state is None:
            self.notify("Its run is not alive.")
        else:
            self.app.watch_run(state)

    def action_results(self) -> None:
        """Look at its result."""
        if self.job.result is None or not self.job.result.exists():
            self.notify("It has no result.")
        else:
            self.app.push_screen(ResultsScreen(self.job.result))

    def action_again(self) -> None:
        """Start the same once more."""
        if self.job.alive:
            self.notify("It has not ended yet.")
        else:
            self.app.pop_screen()
            opening.start(self.app, list(self.job.words), self.job.result, watch=True)

    def action_end(self) -> None:
        """End it, if that is meant."""
        if self.job.alive:
            self.app.push_screen(Question("End this submission?", {"e": "end it"}), self._end)

    def _end(self, answer: str | None) -> None:
        if answer is not None:
            try:
                jobs.end(self.job)
            except BenchbotError as error:
                self.app.tell(error)

    def _show(self) -> None:
        now = started(self.job)
        text = jobs.log_of(self.job)
        shown = f"{now.state}{now.said}{text}"
        if shown == self._shown:
            return
        self._shown = shown
        self.query_one("#title", Static).update(f"{now.title}: {now.said}")
        where = f"Result  {self.job.result}\n" if self.job.result is not None else ""
        self.query_one("#status", Static).update(f"{where}Log     {self.job.log}")
        self.query_one("#log", Static).update(text)
        self.query_one(VerticalScroll).scroll_end(animate=False)
