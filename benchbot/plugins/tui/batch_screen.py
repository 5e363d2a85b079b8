"""The screen that watches a batch: its matrix of episodes, workers, score and failures; and the keys of who runs it."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import Screen
from textual.widgets import Footer

from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.tui.question import Question
from benchbot.plugins.tui.watching import batch_facts, panels, state_bar
from benchbot.plugins.tui.watching.commands import Commands
from benchbot.plugins.tui.watching.feeds import BatchFeed, leave
from benchbot.plugins.tui.watching.matrix import Matrix
from benchbot.plugins.tui.watching.matrix_grid import RUNNING
from benchbot.plugins.tui.watching.panels import Words
from benchbot.plugins.tui.watching.text_screen import TextScreen, logs_of
from benchbot.plugins.watching.views import BatchView, EpisodeCell

PERIOD_S = 0.2
MOST_WORKERS = 40
COLUMNS = [(0, "-tiny"), (12, "-narrow"), (110, "-wide")]
LINES = [(0, "-flat"), (14, "-short"), (32, "-tall")]
"""From how many on the screen is of which class: what is shown then is in batch_screen.tcss."""


class BatchScreen(Screen[None]):
    """Watches a batch until its user leaves; it closes its feed then, which does the batch no harm.

    `open_run` shows the live run of an episode; `go_on` drives a batch that nobody drives any more. Keys for what is
    None are not there.
    """

    CSS_PATH = "watching/batch_screen.tcss"
    HORIZONTAL_BREAKPOINTS = COLUMNS
    VERTICAL_BREAKPOINTS = LINES
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up,k", "move(-1,0)", "Up", show=False),
        Binding("down,j", "move(1,0)", "Down", show=False),
        Binding("left", "move(0,-1)", "Left", show=False),
        Binding("right", "move(0,1)", "Right", show=False),
        Binding("pageup", "move(-10,0)", "Ten rows up", show=False),
        Binding("pagedown", "move(10,0)", "Ten rows down", show=False),
        Binding("home", "move(0,-100000)", "First column", show=False),
        Binding("end", "move(0,100000)", "Last column", show=False),
        Binding("enter", "open", "Logs", key_display="enter"),
        Binding("f", "failure(1)", "Next failure"),
        Binding("F", "failure(-1)", "Failure before", show=False),
        Binding("m", "counts", "Matrix or counts"),
        Binding("w", "watch", "Watch its run"),
        Binding("r", "retry", "Retry"),
        Binding("g", "go_on", "Go on"),
        Binding("x", "cancel", "Cancel"),
        Binding("escape", "leave", "Leave"),
    ]

    def __init__(
        self,
        feed: BatchFeed,
        *,
        open_run: Callable[[EpisodeCell], None] | None = None,
        go_on: Callable[[Path], None] | None = None,
    ) -> None:
        super().__init__()
        self.feed = feed
        self._open_run = open_run
        self._go_on = go_on
        self._commands = Commands()
        self._view: BatchView | None = None
        self._keys: object = None
        self._matrix = Matrix(id="matrix")
        names = ("headline", "problem", "bar", "numbers", "score", "failures", "workers", "compact", "episode")
        self._words = {name: Words(id=name) for name in names}

    def compose(self) -> ComposeResult:
        """Lay out everything; which parts of it are shown is for the size to say."""
        words = self._words
        yield words["headline"]
        yield words["problem"]
        yield words["bar"]
        yield words["compact"]
        with Horizontal(id="middle"):
            with Vertical(id="episodes", classes="panel") as episodes:
                episodes.border_title = "Episodes"
                yield self._matrix
            with VerticalScroll(id="side", can_focus=False):
                for title, name in (
                    ("Batch", "numbers"),
                    ("Score", "score"),
                    ("Failures", "failures"),
                    ("Workers", "workers"),
                ):
                    with Vertical(classes="panel") as panel:
                        panel.border_title = title
                        yield words[name]
        yield words["episode"]
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Look at the feed from now on."""
        self._tick()
        self.set_interval(PERIOD_S, self._tick)

    def on_unmount(self) -> None:
        """Leave the batch to itself."""
        leave(self.feed)

    def on_resize(self) -> None:
        """Lay out for the new size."""
        self.call_after_refresh(self._show_all)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Say which keys mean something now."""
        view = self._view
        status = None if view is None else view.status
        chosen = self._matrix.chosen
        match action:
            case "watch":
                return self._open_run is not None and chosen is not None and chosen.state == RUNNING
            case "retry":
                return status is not None and bool(status.failures)
            case "cancel":
                return view is not None and view.alive
            case "go_on":
                return (
                    self._go_on is not None and view is not None and not view.alive and bool(status and status.pending)
                )
            case "failure":
                return status is not None and bool(status.failures)
            case _:
                return True

    # What is shown

    def _tick(self) -> None:
        for outcome in self._commands.ended():
            if outcome.error is not None:
                error = outcome.error
                self.notify(f"{error.why}\n{error.fix}", title=error.title, severity="error", timeout=10, markup=False)
            elif outcome.done is not None:
                outcome.done(outcome.value)
            self._show_all()
        if self.feed.view is not self._view:
            self._show_all()

    def _show_all(self) -> None:
        view = self._view = self.feed.view
        if not self.is_mounted:
            return
        self._matrix.show(view.cells)
        words = self._words
        title = batch_facts.title(view)
        words["headline"].tell(panels.headline(batch_facts.badge(view), self._commands.under_way, title))
        problem = view.problem or (view.status.paused if view.status is not None else None) or ""
        words["problem"].display = bool(problem)
        words["problem"].tell(problem)
        words["bar"].tell(state_bar.state_bar(self._matrix.states, self.size.width - 2))
        words["numbers"].tell(panels.rows(batch_facts.numbers(view)))
        words["score"].tell(batch_facts.score(view).replace(" [", "\n["))
        failures = dict(view.status.failures) if view.status is not None else {}
        words["failures"].tell(state_bar.failures(failures))
        words["workers"].tell(_workers(view))
        words["compact"].tell(f"{batch_facts.compact(view)}\n{batch_facts.score(view)}")
        self._show_episode()
        self._refresh_keys()

    def _refresh_keys(self) -> None:
        view, chosen = self.feed.view, self._matrix.chosen
        failed = view.status is not None and bool(view.status.failures)
        keys = (view.alive, failed, None if chosen is None else chosen.state)
        if keys != self._keys:
            self._keys = keys
            self.refresh_bindings()

    def _show_episode(self) -> None:
        chosen, row = self._matrix.chosen, self._matrix.chosen_row
        if chosen is not None:
            self._words["episode"].tell(batch_facts.cell(chosen))
        elif row is not None and self._matrix.shows_counts:
            told = ", ".join(f"{count} {state}" for state, count in row[1].items())
            self._words["episode"].tell(f"{row[0]}: {told}. Press m for its episodes.")
        else:
            self._words["episode"].tell("")

    def on_matrix_moved(self) -> None:
        """Tell of the episode beneath the cursor."""
        self._show_episode()
        self._refresh_keys()

    # What keys do

    def action_move(self, rows: int, columns: int) -> None:
        """Move the cursor."""
        self._matrix.move(rows, columns)

    def action_counts(self) -> None:
        """Show letters in place of bars, or bars in place of letters."""
        self._matrix.toggle()

    def action_failure(self, step: int) -> None:
        """Go to the next episode that has failed."""
        self._matrix.next_failure(step)

    def action_open(self) -> None:
        """Show the logs of the episode beneath the cursor; where rows are bars, its row's episodes."""
        chosen = self._matrix.chosen
        if chosen is None:
            if self._matrix.shows_counts:
                self._matrix.toggle()
            return
        folder = Folder(self.feed.view.folder).episode(chosen.name)
        title = f"{chosen.name}: {chosen.state}"
        self._command("Reading", partial(logs_of, folder), lambda text: self._read(title, text))

    def _read(self, title: str, text: str) -> None:
        self.app.push_screen(TextScreen(title, text))

    def action_watch(self) -> None:
        """Watch the run of the episode beneath the cursor."""
        chosen = self._matrix.chosen
        if self._open_run is not None and chosen is not None:
            self._open_run(chosen)

    def action_retry(self) -> None:
        """Ask which failed episodes are to be computed once more."""
        status = self.feed.view.status
        failures = {} if status is None else dict(status.failures)
        answers = {"a": f"all that failed ({sum(failures.values())})"}
        answers |= {str(place): f"{name} ({count})" for place, (name, count) in enumerate(failures.items(), 1)}
        chosen = {"a": tuple(failures), **{str(place): (name,) for place, name in enumerate(failures, 1)}}
        text = "Compute which episodes once more? What they left is kept beside."
        self.app.push_screen(Question(text, answers), lambda answer: self._retry(chosen.get(answer or "", ())))

    def _retry(self, classes: Sequence[str]) -> None:
        if classes:
            done = "{} episodes are computed once more."
            self._command("Beginning", partial(self.feed.retry, classes), lambda n: self.notify(done.format(n)))

    def action_go_on(self) -> None:
        """Drive a batch on whose workers have ended."""
        if self._go_on is not None:
            self._go_on(self.feed.view.folder)

    def action_cancel(self) -> None:
        """End the workers, or only stop watching: ask which."""
        text = "End all workers of this batch?\n\nWhat is finished stays; the batch can go on later."
        answers = {"x": "end the workers now", "w": "only stop watching: the batch goes on"}
        self.app.push_screen(Question(text, answers), self._cancel_as)

    def _cancel_as(self, answer: str | None) -> None:
        if answer == "x":
            self._command("Ending the workers", self.feed.cancel)
        elif answer == "w":
            self.action_leave()

    def action_leave(self) -> None:
        """Stop watching: the batch goes on."""
        self.dismiss(None)

    def _command(self, what: str, call: Callable[[], Any], done: Callable[[Any], None] | None = None) -> None:
        if self._commands.begin(what, call, done):
            self._show_all()


def _workers(view: BatchView) -> str:
    rows = [batch_facts.worker(row) for row in view.workers[:MOST_WORKERS]]
    if len(view.workers) > MOST_WORKERS:
        rows.append(f"and {len(view.workers) - MOST_WORKERS} more")
    return "\n".join(rows) or "none is known"
