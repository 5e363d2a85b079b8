"""The screen of results: a table of scores and failures; evaluates and explains them, and makes reports."""

from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Footer, Input, Static

from benchbot.core.errors import BenchbotError
from benchbot.plugins.tui import result_rows
from benchbot.plugins.tui.base import BaseApp
from benchbot.plugins.tui.dialogs import AskText, TextScreen
from benchbot.plugins.tui.listing import Column, Listing
from benchbot.plugins.tui.map_panel import MapsScreen
from benchbot.plugins.tui.result_rows import Group, ResultRow

GROUPS = {"": None, "environment": "about", "robot": "robot", "task": "task", "failure": "failure"}
"""By what results are grouped, and the field of a row that tells it."""
GROUP_COLUMNS: list[Column[Group]] = [
    Column("Group", lambda group: group.title, lambda group: group.title, 30),
    Column("Results", lambda group: str(group.count), lambda group: group.count, 8, right=True),
    Column(
        "Failed", lambda group: f"✗ {group.failed}" if group.failed else "✓", lambda group: group.failed, 8, right=True
    ),
    Column("Mean score", lambda group: group.score, lambda group: group.mean, 24),
]
AT_ONCE = 50
MOST_ROWS = 5000


class ResultsScreen(Screen[None]):
    """The results in a folder, an archive or a file."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q", "back", "Back", key_display="esc"),
        Binding("e", "evaluate('marked')", "Evaluate", tooltip="Score the result that is marked"),
        Binding("E", "evaluate('all')", "all", tooltip="Score all of them together"),
        Binding("i", "explain('marked')", "Why", tooltip="Say why it has its score; shows the truth"),
        Binding("I", "explain('all')", "all", tooltip="Say what went wrong in all, by kind, and what each kind costs"),
        Binding("slash", "filter", "Filter", key_display="/", tooltip="Show only results with these words"),
        Binding("m", "group", "Group", tooltip="Group by environment, robot, task or failure, or not at all"),
        Binding(
            "space", "mark", "Mark", key_display="space", tooltip="Mark for a look at maps side by side", show=False
        ),
        Binding("M", "maps", "Maps", tooltip="Show the maps of the marked results side by side; shows the truth"),
        Binding("greater_than_sign", "sort(1)", "Sort", key_display=">", tooltip="Sort by the next column", show=False),
        Binding("less_than_sign", "sort(0)", "Turn", key_display="<", tooltip="Turn the order round", show=False),
        Binding("up,k", "move(-1)", "Up", show=False),
        Binding("down,j", "move(1)", "Down", show=False),
        Binding("pageup", "move(-10)", "Ten up", show=False),
        Binding("pagedown", "move(10)", "Ten down", show=False),
        Binding("home", f"move(-{MOST_ROWS})", "First", show=False),
        Binding("end", f"move({MOST_ROWS})", "Last", show=False),
        Binding("enter", "explain('marked')", "Why", show=False),
        Binding("o", "report('marked')", "Report", tooltip="Make report.html of the result that is marked"),
        Binding("O", "report('all')", "all", tooltip="Make one report of all"),
        Binding("F", "folder", "Folder", tooltip="Look into another folder"),
        Binding("f5", "read", "Read again", show=False),
    ]
    AUTO_FOCUS = ""
    app: BaseApp

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.rows: list[ResultRow] = []
        """The rows that have been read so far."""
        self._reading = 0
        self._group = ""
        self._marked: list[str] = []
        """The sources of the results that are marked, in the order in which they were."""
        self._table: Listing[ResultRow] = Listing(id="table")
        self._groups: Listing[Group] = Listing(id="groups")

    def compose(self) -> ComposeResult:
        """Show the table, still empty."""
        yield Static(f"Results in {self.path}", classes="bar", id="title", markup=False)
        yield Input(placeholder="a folder, an archive or a result", classes="filter", id="folder")
        yield self._table
        yield self._groups
        yield Static(id="status", markup=False)
        yield Footer()

    def on_mount(self) -> None:
        """Begin to read."""
        self._groups.display = False
        self.set_focus(None)
        self.action_read()

    @property
    def marked(self) -> ResultRow | None:
        """The row under the cursor."""
        return None if self._group else self._table.chosen

    def action_read(self) -> None:
        """Read the results again, in a thread; they appear as they are read."""
        self._reading += 1
        self.rows = []
        self._show()
        self.query_one("#title", Static).update(f"Results in {self.path}")
        self.query_one("#status", Static).update("Reading …")
        number, path = self._reading, self.path

        def read() -> None:
            waiting: list[ResultRow] = []
            for row in result_rows.rows([path]):
                waiting.append(row)
                if len(waiting) == AT_ONCE:
                    self.app.call_later(self._add, number, waiting)
                    waiting = []
                if number != self._reading or not self.is_attached or len(self.rows) >= MOST_ROWS:
                    break
            self.app.call_later(self._add, number, waiting)

        self.app.in_thread(read, lambda _: self._read_all(number))

    def on_listing_moved(self) -> None:
        """Show the source or the problem of the row under the cursor."""
        self._tell()

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        self._shown.move(rows)

    def action_sort(self, step: int) -> None:
        """Sort by the next column, or turn the order round."""
        self._shown.sort(step)

    def action_filter(self) -> None:
        """Ask for words, and show only results with them."""

        def filtered(text: str | None) -> None:
            if text is not None:
                self._table.filter(text)
                self._show()

        self.app.push_screen(AskText("Results with", self._table.needle), filtered)

    def action_group(self) -> None:
        """Group by the next of `GROUPS`."""
        names = list(GROUPS)
        self._group = names[(names.index(self._group) + 1) % len(names)]
        self._show()

    def action_mark(self) -> None:
        """Mark the result under the cursor, or take the mark off."""
        row = self.marked
        if row is not None:
            self._marked = [*self._marked, row.source] if row.source not in self._marked else [
                source for source in self._marked if source != row.source
            ]  # fmt: skip
            self._table.refresh()
            self.action_move(1)

    def action_maps(self) -> None:
        """Show the maps of the marked results side by side; of the one under the cursor where none is marked."""
        rows = [row for row in self.rows if row.source in self._marked and not row.problem]
        chosen = rows or ([row] if (row := self._usable()) is not None else [])
        if chosen:
            paths = {f"{row.about} {row.robot} {row.score}": row.path for row in chosen}
            self._status("Drawing …")
            self.app.in_thread(
                lambda: result_rows.maps(paths, self.app.catalog),
                lambda maps: self._push(MapsScreen(maps, self.app.images)),
            )

    def _push(self, screen: Screen[None]) -> None:
        self.app.push_screen(screen)
        self._tell()

    @property
    def _shown(self) -> Listing[ResultRow] | Listing[Group]:
        return self._groups if self._group else self._table

    def _show(self) -> None:
        self._table.show(list(self.rows), self._columns())
        field = GROUPS[self._group]
        if field is not None:
            self._groups.show(result_rows.grouped(self._table.shown, field), GROUP_COLUMNS)
        self._table.display, self._groups.display = field is None, field is not None
        self._tell()

    def _columns(self) -> list[Column[ResultRow]]:
        def file(row: ResultRow) -> str:
            path = Path(row.source)
            return str(path.relative_to(self.path)) if path.is_relative_to(self.path) else path.name

        def failed(row: ResultRow) -> str:
            return "✗ no result" if row.problem else f"✗ {row.failure}" if row.failure else "✓"

        return [
            Column("", lambda row: "●" if row.source in self._marked else "", lambda row: row.source, 1),
            Column("Score", lambda row: row.score or "-", lambda row: row.value, 13),
            Column("Failure", failed, failed, 16),
            Column("Environment", lambda row: row.about, lambda row: row.about, 24),
            Column("Robot", lambda row: row.robot, lambda row: row.robot, 16),
            Column(
                "Steps", lambda row: "" if row.steps is None else str(row.steps), lambda row: row.steps, 6, right=True
            ),
            Column("File", file, file, 30),
            Column("Task", lambda row: row.task, lambda row: row.task, 46),
        ]

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Look elsewhere."""
        path = Path(event.value.strip() or ".").expanduser().absolute()
        if not path.exists():
            self.notify(f"There is no {path}.", severity="error")
            return
        self.path = path
        self._ask(on=False)
        self.action_read()

    def action_folder(self) -> None:
        """Ask for another folder."""
        self._ask(on=True)

    def action_back(self) -> None:
        """Leave the field of the folder, or the screen."""
        if self.query_one("#folder").display:
            self._ask(on=False)
        else:
            self.app.pop_screen()

    def action_evaluate(self, of: str) -> None:
        """Score the marked result, or all together."""
        paths = self._paths(of)
        if not paths:
            return

        def done(found: tuple[str, Path]) -> None:
            text, path = found
            self.app.push_screen(TextScreen("Scores", f"{text}\n\n{path}"))
            if self.is_attached:
                self.action_read()

        self._status("Evaluating …")
        self.app.in_thread(lambda: result_rows.evaluate(paths, self.app.catalog), done)

    def action_explain(self, of: str) -> None:
        """Say why the marked result has its score, or what went wrong in all of them."""
        if of == "all":
            self._status("Asking why …")
            title = f"{self.path}: what went wrong (this shows the truth)"
            self.app.in_thread(
                lambda: result_rows.costs([self.path], self.app.catalog),
                lambda text: self._push(TextScreen(title, text)),
            )
            return
        row = self._usable()
        if row is not None:
            title = f"{row.about}: why (this shows the truth)"
            self._status("Asking why …")

            def done(text: str) -> None:
                self.app.push_screen(TextScreen(title, text))

            self.app.in_thread(lambda: result_rows.explain(row.path, self.app.catalog), done)

    def action_report(self, of: str) -> None:
        """Make a report of the marked result, or one of all."""
        paths = self._paths(of)
        if paths:
            self.app.make_report(paths)

    def _paths(self, of: str) -> list[Path]:
        """Return the path of the `marked` result, or that of `all`."""
        if of == "all":
            return [self.path]
        row = self._usable()
        return [] if row is None else [row.path]

    def _usable(self) -> ResultRow | None:
        row = self.marked
        if row is None:
            self.notify("There is no result here.")
        elif row.problem:
            self.app.tell(BenchbotError("This is not a result.", row.problem, "Choose another one."))
        else:
            return row
        return None

    def _add(self, number: int, rows: list[ResultRow]) -> None:
        if number != self._reading or not self.is_attached:
            return
        self.rows += rows
        self._show()

    def _read_all(self, number: int) -> None:
        if number == self._reading and self.is_attached:
            self._tell()

    def _tell(self) -> None:
        if self._group:
            self._status(f"{len(self._table.shown)} results by {self._group}. m groups otherwise.")
            return
        row = self.marked
        needle = f" with “{self._table.needle}”" if self._table.needle else ""
        count = (
            f"{len(self._table.shown)} of {len(self.rows)} results{needle}"
            if needle
            else f"{len(self.rows)} results"
            if len(self.rows) != 1
            else "1 result"
        )
        if row is None:
            self._status(f"{count}. F looks into another folder.")
        else:
            self._status(f"{count}. {row.problem or row.source}")

    def _status(self, text: str) -> None:
        if self.is_attached:
            self.query_one("#status", Static).update(text)

    def _ask(self, *, on: bool) -> None:
        field = self.query_one("#folder", Input)
        field.display = on
        if on:
            field.value = str(self.path)
            self.set_focus(field)
        else:
            self.set_focus(None)
