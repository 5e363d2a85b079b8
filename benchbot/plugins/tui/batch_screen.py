"""The screen that watches a batch: its matrix of episodes, workers, score and failures; and the keys of its host."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Footer, Static

from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.tui import batch_facts, panels
from benchbot.plugins.tui.base import WatchScreen
from benchbot.plugins.tui.batch_facts import DONE, PENDING, RUNNING
from benchbot.plugins.tui.dialogs import AskText, QuestionDialog, TextScreen
from benchbot.plugins.tui.episodes import EpisodeTable, columns_of, heat
from benchbot.plugins.tui.matrix import Matrix
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.logs import end_of
from benchbot.plugins.watching.views import BatchView, EpisodeCell

MOST_LOG_BYTES = 1 << 20
MOST_COLUMNS = 100_000
COLUMNS = [(0, "-tiny"), (12, "-narrow"), (110, "-wide")]
LINES = [(0, "-flat"), (14, "-short"), (32, "-tall")]
"""The class of the screen from so many columns or lines on: batch_screen.tcss says what it shows then."""
VIEWS = ("matrix", "table", "heat")
"""What stands in the middle: all episodes at once, a row for each, or the scores of solutions by environments."""
TITLES = {"matrix": "Episodes", "table": "Episodes", "heat": "Mean scores, how many they are of, ✗ failed"}
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
        Binding("left,h", "move(0,-1)", "Left", show=False),
        Binding("right,l", "move(0,1)", "Right", show=False),
        Binding("pageup", "move(-10,0)", "Ten rows up", show=False),
        Binding("pagedown", "move(10,0)", "Ten rows down", show=False),
        Binding("home", f"move(0,-{MOST_COLUMNS})", "First", show=False),
        Binding("end", f"move(0,{MOST_COLUMNS})", "Last", show=False),
        Binding("enter", "open", "Logs", key_display="enter"),
        Binding("f", "failure(1)", "Next failure"),
        Binding("F", "failure(-1)", "Failure before", show=False),
        Binding("m", "next_view", "View", tooltip="Show all at once, as a table, or as a map of scores"),
        Binding("b", "counts", "Bars or signs", show=False),
        Binding(
            "slash", "filter", "Filter", key_display="/", tooltip="Show only the rows of the table with these words"
        ),
        Binding("greater_than_sign", "sort(1)", "Sort", key_display=">", tooltip="Sort the table by its next column"),
        Binding("less_than_sign", "sort(0)", "Turn", key_display="<", tooltip="Turn the order round", show=False),
        Binding("w", "watch", "Watch its run"),
        Binding("r", "retry", "Retry"),
        Binding("g", "go_on", "Go on"),
        Binding("A", "add_seeds", "Add seeds", tooltip="Add seeds to this batch, and compute them"),
        Binding("x", "cancel", "Cancel"),
        Binding("escape,q", "leave", "Leave", key_display="esc"),
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
        self._table = EpisodeTable(id="table")
        self._heat = Static(id="heat", markup=False)
        self._shows = VIEWS[0]
        self._tabled: tuple[EpisodeCell, ...] | None = None

    def compose(self) -> ComposeResult:
        """Lay out everything; the size of the terminal decides which parts are shown."""
        words = self._words
        yield from (words[name] for name in ("headline", "problem", "bar", "compact"))
        with Horizontal(id="middle"):
            with Vertical(id="episodes", classes="panel") as episodes:
                episodes.border_title = TITLES[self._shows]
                yield self._matrix
                yield self._table
                with VerticalScroll(id="heat-frame", can_focus=False):
                    yield self._heat
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
        chosen = self._chosen
        match action:
            case "filter" | "sort":
                return self._shows == "table"
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
        self._show_middle()
        words = self._words
        words["headline"].tell(panels.headline(batch_facts.badge(view), self._under_way, str(view.folder)))
        problem = view.problem or (view.status.paused if view.status is not None else None) or ""
        words["problem"].display = bool(problem)
        words["problem"].tell(problem)
        words["bar"].tell(batch_facts.state_bar(self._matrix.states, self.size.width - 2))
        words["numbers"].tell(panels.rows(batch_facts.numbers(view)))
        scores = batch_facts.scores(view)
        words["score"].tell("\n".join(scores).replace(" [", "\n["))
        failures = dict(view.status.failures) if view.status is not None else {}
        words["failures"].tell(batch_facts.failure_counts(failures))
        words["workers"].tell(batch_facts.workers(view))
        words["compact"].tell(f"{batch_facts.compact(view)}\n{'  '.join(scores)}")
        self._show_episode()

    def _show_middle(self) -> None:
        """Fill what is in the middle; what is not seen costs nothing."""
        view = self.feed.view
        self._matrix.display = self._shows == "matrix"
        self._table.display = self._shows == "table"
        self.query_one("#heat-frame").display = self._shows == "heat"
        title = TITLES[self._shows]
        self.set_class(self._shows == "table", "-table")
        if self._shows == "table" and view.cells is not self._tabled:
            self._tabled = view.cells
            self._table.show(view.cells, columns_of(view.cells))
        if self._shows == "table":
            title = f"{title} {self._table.order}"
        if self._shows == "heat":
            width = self.query_one("#episodes").size.width - 2
            self._heat.update(heat(view.cells, width, colored=not self.app.no_color))
        self.query_one("#episodes").border_title = title

    @property
    def _chosen(self) -> EpisodeCell | None:
        """The episode under the cursor."""
        return {"matrix": self._matrix.chosen, "table": self._table.chosen}.get(self._shows)

    def _show_episode(self) -> None:
        view, chosen, row = self.feed.view, self._chosen, self._matrix.chosen_row
        text = ""
        if chosen is not None:
            text = batch_facts.episode(chosen)
        elif row is not None and self._shows == "matrix":
            counts = ", ".join(f"{count} {state}" for state, count in row[1].items())
            text = f"{row[0]}: {counts}. Press b for its episodes."
        self._words["episode"].tell(text)
        failed = view.status is not None and bool(view.status.failures)
        self._show_keys((view.alive, failed, None if chosen is None else chosen.state))

    def on_matrix_moved(self) -> None:
        """Show the episode under the cursor."""
        self._show_episode()

    def on_listing_moved(self) -> None:
        """Show the episode under the cursor, and how the table is sorted."""
        if self._shows == "table":
            self.query_one("#episodes").border_title = f"{TITLES['table']} {self._table.order}"
        self._show_episode()

    # What keys do

    def action_move(self, rows: int, columns: int) -> None:
        """Move the cursor."""
        if self._shows == "matrix":
            self._matrix.move(rows, columns)
        elif self._shows == "table":
            ends = {-MOST_COLUMNS: -len(self._table.shown), MOST_COLUMNS: len(self._table.shown)}
            self._table.move(rows + ends.get(columns, 0))
        else:
            self.query_one("#heat-frame").scroll_relative(y=rows, animate=False)

    def action_counts(self) -> None:
        """Show signs in place of bars, or bars in place of signs."""
        self._matrix.toggle()

    def action_next_view(self) -> None:
        """Show all at once, as a table, or as a map of scores."""
        self._shows = VIEWS[(VIEWS.index(self._shows) + 1) % len(VIEWS)]
        self._show_middle()
        self._show_episode()
        self.refresh_bindings()

    def action_filter(self) -> None:
        """Ask for words, and show only the rows with them."""

        def filtered(text: str | None) -> None:
            if text is not None:
                self._table.filter(text)

        self.app.push_screen(AskText("Episodes with", self._table.needle), filtered)

    def action_sort(self, step: int) -> None:
        """Sort the table by its next column, or turn the order round."""
        self._table.sort(step)

    def action_failure(self, step: int) -> None:
        """Go to the next episode that has failed."""
        if self._shows == "table":
            self._table.find(lambda cell: cell.state not in (DONE, PENDING, RUNNING), step)
            return
        self._shows = "matrix"
        self._show_middle()
        self._matrix.next_failure(step)

    def action_open(self) -> None:
        """Show the logs of the episode under the cursor; where rows are bars, its row's episodes."""
        chosen = self._chosen
        if chosen is None:
            if self._shows == "matrix" and self._matrix.shows_counts:
                self._matrix.toggle()
            return
        folder = Folder(self.feed.view.folder).episode(chosen.name)
        title = f"{chosen.name}: {chosen.state}"

        def show(text: str) -> None:
            self.app.push_screen(TextScreen(title, text, is_log=True))

        self._command("Reading", partial(_logs_of, folder), show)

    def action_watch(self) -> None:
        """Watch the run of the episode under the cursor."""
        chosen = self._chosen
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

    def action_add_seeds(self) -> None:
        """Add seeds to the batch: a form of its own."""
        from benchbot.plugins.batch.seeds_screen import AddSeedsScreen

        self.app.push_screen(AddSeedsScreen(self.feed.view.folder))

    def action_cancel(self) -> None:
        """End the workers, or only stop watching: ask which."""
        self._ask_to_end(
            "End all workers of this batch?\n\nWhat is finished stays; the batch can go on later.",
            {"x": "end the workers now", "q": "only stop watching: the batch goes on"},
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
