"""The screen of a diagnosis: what works on this machine or a real robot, what does not, and the fix beside it."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Static

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.findings import Level
from benchbot.plugins.screens.child_command import Outcome
from benchbot.plugins.screens.command_screen import CommandLine, CommandScreen
from benchbot.plugins.screens.widgets import ChoiceField, Facts, Table

MACHINE, WARM = "", "\0warm"
MACHINES = [("this machine", MACHINE), ("this machine; start every simulator, too", WARM)]
SIGNS = {Level.BROKEN: ("✗", "red"), Level.WARNING: ("!", "yellow"), Level.OK: ("✓", "green")}
ORDER = list(SIGNS)


class DoctorScreen(CommandScreen):
    """Looks at the machine at once, and at a real robot when it is chosen; the worst comes first."""

    HEADING = "Robots and machine"
    DEFAULT_CSS = "DoctorScreen #verdict { padding: 0 1; }"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f5", "look", "Look again", tooltip="Look once more"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._findings: list[Mapping[str, Any]] = []

    def body(self) -> ComposeResult:
        """Yield what to look at, the findings, and the marked one in full."""
        self._what_field = ChoiceField("Look at", MACHINES)
        yield self._what_field
        yield Static(id="verdict", markup=False)
        with Horizontal(classes="pane"):
            yield Table({"": 1, "Finding": 26, "Detail": None})
            with VerticalScroll(classes="details aside", can_focus=False):
                yield Facts(id="facts")

    def on_mount(self) -> None:
        """Look at the machine, and read in a thread which real robots there are."""
        super().on_mount()
        self.query_one(Table).focus()
        self.app.in_thread(lambda: real_robots(self.app.catalog), self._offer)
        self.action_look()

    def words(self) -> list[str]:
        """Return the command."""
        what = self._what_field.value
        return ["doctor", *([] if what == MACHINE else ["--warm"] if what == WARM else ["--robot", what])]

    def on_select_changed(self) -> None:
        """Look at what is chosen."""
        line = self.query_one(CommandLine)
        before = line.words
        self.show_words()
        if line.words != before and not self.is_busy:
            self.action_look()

    def action_look(self) -> None:
        """Look."""
        words = [*self.words(), "--json"]
        allowed = (ExitCode.OK, ExitCode.USAGE)
        self.run_command(words, self._found, doing="Looking", allowed=allowed, only_looks=True)

    def on_data_table_row_highlighted(self) -> None:
        """Show the marked finding in full, its fix first."""
        key = self.query_one(Table).marked
        finding = self._findings[int(key)] if key is not None else {}
        rows = {"Fix": finding.get("fix"), "Finding": finding.get("subject"), "Detail": finding.get("detail")}
        self.query_one("#facts", Facts).tell(rows)

    def on_data_table_row_selected(self) -> None:
        """Copy the fix of the marked finding."""
        key = self.query_one(Table).marked
        fix = self._findings[int(key)]["fix"] if key is not None else ""
        if fix:
            self.app.copy_to_clipboard(fix)
            self.notify(fix, title="Copied", timeout=3)

    def _offer(self, robots: Sequence[str]) -> None:
        if self.is_attached and robots:
            self._what_field.offer([*MACHINES, *((f"the robot {name}, which is switched on", name) for name in robots)])

    def _found(self, outcome: Outcome) -> None:
        if not outcome.output.strip():
            raise outcome.error()
        found = sorted(outcome.document, key=lambda finding: ORDER.index(Level(finding["level"])))
        self._findings = found
        counts = {level: sum(finding["level"] == level for finding in found) for level in ORDER}
        said = [
            f"{counts[level]} {word}" for level, word in zip(ORDER, ("broken", "to be looked at", "well"), strict=True)
        ]
        sign, color = SIGNS[next((level for level in ORDER if counts[level]), Level.OK)]
        self.query_one("#verdict", Static).update(Text(f"{sign} {', '.join(said)}", f"bold {color}"))
        self.query_one(Table).fill((str(number), _cells(finding)) for number, finding in enumerate(found))
        self.on_data_table_row_highlighted()


def real_robots(catalog: Catalog) -> list[str]:
    """Return the names of the robots that a driver drives."""
    drivers = catalog.plugins.pool("robot_drivers")
    found = []
    for name in catalog.names("robots"):
        try:
            if catalog.get("robots", name).data["type"] in drivers:
                found.append(name)
        except BenchbotError:
            continue  # the diagnosis of the machine tells what is wrong with it
    return found


def _cells(finding: Mapping[str, Any]) -> tuple[Text | str, ...]:
    sign, color = SIGNS[Level(finding["level"])]
    fix = f"  → {finding['fix']}" if finding["fix"] else ""
    return Text(sign, color), finding["subject"], f"{finding['detail']}{fix}"
