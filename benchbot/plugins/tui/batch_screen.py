"""The screen that watches a batch: its matrix of episodes, workers, score and failures; and the keys of its host."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Footer

from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.tui import batch_facts, panels
from benchbot.plugins.tui.base import WatchScreen
from benchbot.plugins.tui.batch_facts import RUNNING
from benchbot.plugins.tui.dialogs import QuestionDialog, TextScreen
from benchbot.plugins.tui.matrix import Matrix
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.logs import end_of
from benchbot.plugins.watching.views import BatchView, EpisodeCell

MOST_LOG_BYTES = 1 << 20
COLUMNS = [(0, "-tiny"), (12, "-narrow"), (110, "-wide")]
LINES = [(0, "-flat"), (14, "-short"), (32, "-tall")]
"""The class of the screen from so many columns or lines on: batch_screen.tcss says what it shows then."""
WORDS = ("headline", "problem", "bar", "numbers", "score", "failures", "workers", "compact", "episode")


class BatchScreen(WatchScreen):
    """Watches a batch; leaving it does the batch no harm.

    `open_run` shows the live run of an episode; `go_on` drives a batch without a driver. Keys for what is
    None are not there.
    """

    CSS_PATH = "batch_screen.tcss"
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
    feed: BatchFeed

    def __init__(
        self,
        feed: BatchFeed,
        *,
        open_run: Callable[[EpisodeCell], None] | None = None,
        go_on: Callable[[Path], None] | None = None,
    ) -> None:
        super().__init__(feed, WORDS)
        self._open_run = open_run
        self._go_on = go_on
        self._view: BatchView | None = None
        self._matrix = Matrix(id="matrix")

    def compose(self) -> ComposeResult:
        """Lay out everything; the size of the terminal decides which parts are shown."""
        words = self._words
        yield from (words[name] for name in ("headline", "problem", "bar", "compact"))
        with Horizontal(id="middle"):
            with Vertical(id="episodes", classes="panel") as episodes:
                episodes.border_title = "Episodes"
                yield self._matrix
            with VerticalScroll(id="side", can_focus=False):
                for name in ("numbers", "score", "failures", "workers"):
                    with Vertical(classes="panel") as panel:
                        panel.border_title = "Batch" if name == "numbers" else name.capitalize()
                        yield words[name]
        yield words["episode"]
        yield Footer(compact=True, show_command_palette=False)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Say which keys mean something now."""
        view = self.feed.view
        failed = view.status is not None and bool(view.status.failures)
        chosen = self._matrix.chosen
        match action:
            case "watch":
                return self._open_run is not None and chosen is not None and chosen.state == RUNNING
            case "retry" | "failure":
                return failed
            case "cancel":
                return view.alive
            case "go_on":
                return self._go_on is not None and not view.alive and bool(view.status and view.status.pending)
            case _:
                return True

    # What is shown

    def _has_news(self) -> bool:
        return self.feed.view is not self._view

    def _show_all(self) -> None:
        view = self._view = self.feed.view
        if not self.is_mounted:
            return
        self._matrix.show(view.cells)
        words = self._words
        words["headline"].tell(panels.headline(batch_facts.badge(view), self._under_way, str(view.folder)))
        problem = view.problem or (view.status.paused if view.status is not None else None) or ""
        words["problem"].display = bool(problem)
        words["problem"].tell(problem)
        words["bar"].tell(batch_facts.state_bar(self._matrix.states, self.size.width - 2))
        words["numbers"].tell(panels.rows(batch_facts.numbers(view)))
        words["score"].tell(batch_facts.score(view).replace(" [", "\n["))
        failures = dict(view.status.failures) if view.status is not None else {}
        words["failures"].tell(batch_facts.failure_counts(failures))
        words["workers"].tell(batch_facts.workers(view))
        words["compact"].tell(f"{batch_facts.compact(view)}\n{batch_facts.score(view)}")
        self._show_episode()

    def _show_episode(self) -> None:
        view, chosen, row = self.feed.view, self._matrix.chosen, self._matrix.chosen_row
        text = ""
        if chosen is not None:
            text = batch_facts.episode(chosen)
        elif row is not None and self._matrix.shows_counts:
            counts = ", ".join(f"{count} {state}" for state, count in row[1].items())
            text = f"{row[0]}: {counts}. Press m for its episodes."
        self._words["episode"].tell(text)
        failed = view.status is not None and bool(view.status.failures)
        self._show_keys((view.alive, failed, None if chosen is None else chosen.state))

    def on_matrix_moved(self) -> None:
        """Show the episode under the cursor."""
        self._show_episode()

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
        """Show the logs of the episode under the cursor; where rows are bars, its row's episodes."""
        chosen = self._matrix.chosen
        if chosen is None:
            if self._matrix.shows_counts:
                self._matrix.toggle()
            return
        folder = Folder(self.feed.view.folder).episode(chosen.name)
        title = f"{chosen.name}: {chosen.state}"

        def show(text: str) -> None:
            self.app.push_screen(TextScreen(title, text, is_log=True))

        self._command("Reading", partial(_logs_of, folder), show)

    def action_watch(self) -> None:
        """Watch the run of the episode under the cursor."""
        chosen = self._matrix.chosen
        if self._open_run is not None and chosen is not None:
            self._open_run(chosen)

    def action_retry(self) -> None:
        """Ask which failed episodes are to be computed once more."""
        status = self.feed.view.status
        failures = {} if status is None else dict(status.failures)
        classes = {"a": tuple(failures), **{str(place): (name,) for place, name in enumerate(failures, 1)}}
        answers = {"a": f"all that failed ({sum(failures.values())})"}
        answers |= {str(place): f"{name} ({count})" for place, (name, count) in enumerate(failures.items(), 1)}

        def retry(answer: str | None) -> None:
            if answer is not None and classes[answer]:
                self._command(
                    "Beginning",
                    partial(self.feed.retry, classes[answer]),
                    lambda count: self.notify(f"{count} episodes are computed once more."),
                )

        text = "Compute which episodes once more? What they left is kept beside."
        self.app.push_screen(QuestionDialog(text, answers), retry)

    def action_go_on(self) -> None:
        """Drive a batch on whose workers have ended."""
        if self._go_on is not None:
            self._go_on(self.feed.view.folder)

    def action_cancel(self) -> None:
        """End the workers, or only stop watching: ask which."""
        self._ask_to_end(
            "End all workers of this batch?\n\nWhat is finished stays; the batch can go on later.",
            {"x": "end the workers now", "w": "only stop watching: the batch goes on"},
            partial(self._command, "Ending the workers", self.feed.cancel),
        )


def _logs_of(folder: Path) -> str:
    """Return the logs of all attempts at an episode, the newest last; of long ones the end."""
    paths = [*sorted(folder.glob("attempt-*/log.txt"), key=_number), *folder.glob("log.txt")]
    if not paths:
        return f"There is no log in {folder}: the episode has not been begun, or it printed nothing."
    return f"{folder}\n" + "\n".join(f"\n── {path.relative_to(folder)}\n\n{_end(path)}" for path in paths)


def _number(path: Path) -> int:
    digits = path.parent.name.removeprefix("attempt-")
    return int(digits) if digits.isdigit() else 0


def _end(path: Path) -> str:
    try:
        return end_of(path, MOST_LOG_BYTES)
    except OSError as error:
        return f"It cannot be read: {error.strerror}."
