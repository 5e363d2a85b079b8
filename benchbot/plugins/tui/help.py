"""Every key, screen by screen; those of the screen that one comes from first."""

from typing import Any, ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import Screen
from textual.widgets import Footer, Static

EVERYWHERE = (
    ("↑ ↓ PgUp PgDn", "Move in a list"),
    ("Enter", "Choose, open"),
    ("Tab", "Go to the next part of the screen"),
    ("Esc", "Back"),
)


class HelpScreen(Screen[None]):
    """All keys."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q,question_mark", "app.pop_screen", "Back", key_display="esc")
    ]

    def __init__(self, coming_from: Screen[Any]) -> None:
        super().__init__()
        self._from = coming_from

    def compose(self) -> ComposeResult:
        """Show them."""
        yield Static("Keys", classes="bar")
        with VerticalScroll(classes="text"):
            for title, keys in sections(self._from):
                yield Static(Text(title), classes="heading")
                yield Static(_table(keys))
        yield Footer()

    def on_mount(self) -> None:
        """Let the arrows scroll."""
        self.query_one(VerticalScroll).focus()


def sections(coming_from: Screen[Any] | None = None) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the keys by screen: a title, and keys with what they do."""
    from benchbot.plugins.tui.app import BenchbotApp
    from benchbot.plugins.tui.batch_screen import BatchScreen
    from benchbot.plugins.tui.home import HomeScreen
    from benchbot.plugins.tui.job_screen import JobScreen
    from benchbot.plugins.tui.new_run import NewRunScreen
    from benchbot.plugins.tui.results import ResultsScreen
    from benchbot.plugins.tui.run_screen import RunScreen
    from benchbot.plugins.tui.submit import SubmitScreen

    screens: dict[str, type[Screen[Any]]] = {
        "What is alive": HomeScreen,
        "A new run": NewRunScreen,
        "A run": RunScreen,
        "A batch": BatchScreen,
        "Submitting": SubmitScreen,
        "A submission": JobScreen,
        "Results": ResultsScreen,
    }
    ordered = sorted(screens.items(), key=lambda item: not isinstance(coming_from, item[1]))
    return [
        *((title, _keys(screen.BINDINGS)) for title, screen in ordered[:1]),
        ("Everywhere", [*EVERYWHERE, *_keys(BenchbotApp.BINDINGS)]),
        *((title, _keys(screen.BINDINGS)) for title, screen in ordered[1:]),
    ]


def _keys(bindings: list[BindingType]) -> list[tuple[str, str]]:
    found = []
    for binding in bindings:
        made = binding if isinstance(binding, Binding) else Binding(*binding)
        if made.description:
            found.append((made.key_display or made.key.replace(",", " "), made.tooltip or made.description))
    return found


def _table(keys: list[tuple[str, str]]) -> Table:
    table = Table.grid(padding=(0, 2))
    table.add_column(width=14, no_wrap=True, style="bold")
    table.add_column()
    for key, meaning in keys:
        table.add_row(key, meaning)
    return table
