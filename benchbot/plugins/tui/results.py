"""The screen of results: a table of scores and failures; evaluates and explains them, and makes reports."""

from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.coordinate import Coordinate
from textual.screen import Screen
from textual.widgets import DataTable, Footer, Input, Static

from benchbot.core.errors import BenchbotError
from benchbot.core.text import one_line
from benchbot.plugins.tui import result_rows
from benchbot.plugins.tui.base import BaseApp
from benchbot.plugins.tui.dialogs import TextScreen
from benchbot.plugins.tui.result_rows import ResultRow

COLUMNS = {"Score": 13, "Failure": 14, "Environment": 26, "Robot": 20, "Steps": 6, "Task": 46, "File": 60}
"""The columns of the table, and their widths in cells."""
AT_ONCE = 50
MOST_ROWS = 5000


class ResultsScreen(Screen[None]):
    """The results in a folder, an archive or a file."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q", "back", "Back", key_display="esc"),
        Binding("e", "evaluate('marked')", "Evaluate", tooltip="Score the result that is marked"),
        Binding("E", "evaluate('all')", "all", tooltip="Score all of them together"),
        Binding("i", "explain", "Why", tooltip="Say why it has its score; shows the truth"),
        Binding("o", "report('marked')", "Report", tooltip="Make report.html of the result that is marked"),
        Binding("O", "report('all')", "all", tooltip="Make one report of all"),
        Binding("D", "folder", "Folder", tooltip="Look into another folder"),
        Binding("f5", "read", "Read again", show=False),
    ]
    app: BaseApp

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.rows: list[ResultRow] = []
        """The rows that have been read so far."""
        self._reading = 0

    def compose(self) -> ComposeResult:
        """Show the table, still empty."""
        yield Static(f"Results in {self.path}", classes="bar", id="title", markup=False)
        yield Input(placeholder="a folder, an archive or a result", classes="filter", id="folder")
        yield DataTable(cursor_type="row", zebra_stripes=True)
        yield Static(id="status", markup=False)
        yield Footer()

    def on_mount(self) -> None:
        """Begin to read."""
        table = self.query_one(DataTable)
        for label, width in COLUMNS.items():
            table.add_column(label, width=width)
        table.focus()
        self.action_read()

    @property
    def marked(self) -> ResultRow | None:
        """The row under the cursor."""
        row = self.query_one(DataTable).cursor_row
        return self.rows[row] if 0 <= row < len(self.rows) else None

    def action_read(self) -> None:
        """Read the results again, in a thread; they appear as they are read."""
        self._reading += 1
        self.rows = []
        self.query_one(DataTable).clear()
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

    def on_data_table_row_highlighted(self) -> None:
        """Show the source or the problem of the marked row."""
        self._tell()

    def on_data_table_row_selected(self) -> None:
        """Explain it."""
        self.action_explain()

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

    def action_explain(self) -> None:
        """Say why it has its score."""
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
        table = self.query_one(DataTable)
        for row in rows:
            self.rows.append(row)
            file = Path(row.source)
            shown = str(file.relative_to(self.path)) if file.is_relative_to(self.path) else file.name
            steps = "" if row.steps is None else str(row.steps)
            failure = "no result" if row.problem else row.failure
            cells = (row.score or "-", failure or "-", row.about, row.robot, steps, row.task, shown)
            table.add_row(*(Text(one_line(cell)) for cell in cells))  # a mere string would be markup

    def _read_all(self, number: int) -> None:
        if number == self._reading and self.is_attached:
            table = self.query_one(DataTable)
            if self.rows and table.cursor_row < 0:
                table.cursor_coordinate = Coordinate(0, 0)
            self._tell()

    def _tell(self) -> None:
        row = self.marked
        count = f"{len(self.rows)} results" if len(self.rows) != 1 else "1 result"
        if row is None:
            self._status(f"{count}. D looks into another folder.")
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
            self.query_one(DataTable).focus()
