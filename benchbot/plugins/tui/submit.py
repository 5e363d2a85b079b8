"""Submitting a solution to a run that is alive."""

from typing import TYPE_CHECKING, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import Screen
from textual.widgets import Button, Footer, Static

from benchbot.core.errors import BenchbotError
from benchbot.plugins.tui import opening
from benchbot.plugins.tui.forms import SolutionForm, offers_of
from benchbot.plugins.tui.orders import submit_words
from benchbot.wire.run_state import RunState

if TYPE_CHECKING:
    from benchbot.plugins.tui.app import BenchbotApp


class SubmitScreen(Screen[None]):
    """Which solution, and how it is scored."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "app.pop_screen", "Back"),
        Binding("ctrl+s", "submit", "Submit", tooltip="Submit, and watch the run"),
    ]
    app: "BenchbotApp"

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
        yield Footer()

    def on_mount(self) -> None:
        """Offer what goes with the task."""
        self.query_one("#solution").focus()
        self.app.in_thread(
            lambda: offers_of(self.app.catalog, self.state.task),
            lambda found: self.query_one(SolutionForm).offer(found),
        )

    def on_button_pressed(self) -> None:
        """Submit."""
        self.action_submit()

    def action_submit(self) -> None:
        """Start the submission, which goes on without the screens, and watch the run."""
        try:
            solution = self.query_one(SolutionForm).order(self.state.environment)
            words = [] if solution is None else submit_words(solution)
        except BenchbotError as error:
            self.app.tell(error)
            return
        if solution is None:
            return
        self.app.pop_screen()
        opening.start(self.app, words, solution.result, variables=self.state.connection.environment())
        self.app.watch_run(self.state)
