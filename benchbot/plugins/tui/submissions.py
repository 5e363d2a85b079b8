"""The screens that submit a solution to a live run, and that follow a submission: its log, result and score."""

from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import Screen
from textual.widgets import Button, Footer, Static

from benchbot.core.errors import BenchbotError
from benchbot.plugins.screens.command_screen import COPY, CommandLine
from benchbot.plugins.tui import jobs
from benchbot.plugins.tui.base import BaseApp
from benchbot.plugins.tui.forms import SolutionForm, offers_of, submit_words
from benchbot.plugins.tui.jobs import Job
from benchbot.plugins.tui.results import ResultsScreen
from benchbot.wire.run_state import RunState

PERIOD_S = 0.5


class SubmitScreen(Screen[None]):
    """The form of a submission to a live run."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "app.pop_screen", "Back"),
        Binding("ctrl+s", "submit", "Submit", tooltip="Submit, and watch the run"),
        COPY,
    ]
    app: BaseApp

    def __init__(self, state: RunState) -> None:
        super().__init__()
        self.state = state

    def compose(self) -> ComposeResult:
        """Show the form."""
        yield Static(f"Submit to {self.state.environment}", classes="bar", markup=False)
        with VerticalScroll(classes="form", can_focus=False):
            yield Static(f"{self.state.task}  {self.state.robot}  seed {self.state.seed}", markup=False)
            yield SolutionForm(none=None)
            yield Button("Submit", variant="primary", id="go", compact=True)
        yield CommandLine()
        yield Footer()

    def on_mount(self) -> None:
        """Offer what fits the task."""
        self.query_one("#solution").focus()
        offer = self.query_one(SolutionForm).offer
        self.app.in_thread(lambda: offers_of(self.app.catalog, self.state.task), offer)

    def on_button_pressed(self) -> None:
        """Submit."""
        self.action_submit()

    def action_submit(self) -> None:
        """Start the submission, which goes on without the screens, and watch the run."""
        try:
            words, result = self._command()
        except BenchbotError as error:
            self.app.tell(error)
            return
        self.app.pop_screen()
        self.app.start(words, result)
        self.app.watch_run(self.state)

    def on_input_changed(self) -> None:
        """Show the command as it is now."""
        self._show_command()

    def on_select_changed(self) -> None:
        """Show the command as it is now."""
        self._show_command()

    def action_copy(self) -> None:
        """Copy the command line."""
        self.query_one(CommandLine).copy()

    def _command(self) -> tuple[list[str], Path]:
        """Return the command of the submission, and the file of its result; raises BenchbotError."""
        solution = self.query_one(SolutionForm).options(self.state.environment)
        if solution is None:
            raise BenchbotError("There is nothing to submit.", "No solution is chosen.", "Choose one.")
        return [*submit_words(solution), f"--run={self.state.name}"], solution.result

    def _show_command(self) -> None:
        self.query_one(CommandLine).tell(lambda: self._command()[0])


class JobScreen(Screen[None]):
    """The log of a job, as it grows, and what it has printed."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q", "app.pop_screen", "Back", key_display="esc"),
        Binding("w", "watch", "Watch", tooltip="Watch its run, while it is alive"),
        Binding("R", "results", "Result", tooltip="Look at its result"),
        Binding("r", "again", "Again", tooltip="Start the same once more; its result is written anew"),
        Binding("x", "end", "End it", tooltip="End it, as Ctrl-C in its terminal would"),
    ]
    app: BaseApp

    def __init__(self, job: Job) -> None:
        super().__init__()
        self.job = job
        self._shown: tuple[object, ...] = ()

    def compose(self) -> ComposeResult:
        """Lay out the title, the files and the log."""
        yield Static("Job", classes="bar", id="title", markup=False)
        yield Static(id="status", markup=False)
        with VerticalScroll(classes="text"):
            yield Static(id="log", markup=False)
        yield Footer()

    def on_mount(self) -> None:
        """Begin to follow it."""
        self.query_one(VerticalScroll).focus()
        self._show()
        self.set_interval(PERIOD_S, self._show)

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
            self.app.start(list(self.job.words), self.job.result, watch=self.job.words[0] in ("submit", "run"))

    def action_end(self) -> None:
        """Ask whether to end it."""
        if self.job.alive:
            self.app.end_job("End this job?", self.job)

    def _show(self) -> None:
        status = jobs.status_of(self.job)
        text = "\n\n".join(filter(None, [jobs.log_of(self.job), jobs.output_of(self.job)]))
        if (status, text) == self._shown:
            return
        self._shown = (status, text)
        self.query_one("#title", Static).update(f"{self.job.title}: {status.summary}")
        result = f"Result  {self.job.result}\n" if self.job.result is not None else ""
        self.query_one("#status", Static).update(f"{result}Log     {self.job.log}")
        self.query_one("#log", Static).update(text)
        self.query_one(VerticalScroll).scroll_end(animate=False)
