"""Screens over others: a question, a line of text to type, a text to read, and the list of all keys."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen, Screen
from textual.widgets import Footer, Input, Log, Static


class QuestionDialog(ModalScreen[str | None]):
    """Asks before an action that cannot be undone. Returns the key of the chosen answer, or None to do nothing."""

    DEFAULT_CSS = """
    QuestionDialog { align: center middle; }
    QuestionDialog Vertical {
        width: 64; max-width: 100%; height: auto; max-height: 100%;
        border: round $warning; padding: 0 1; background: $surface; overflow-y: auto;
    }
    """

    def __init__(self, text: str, answers: Mapping[str, str]) -> None:
        super().__init__()
        self.text = text
        self.answers = dict(answers)

    def compose(self) -> ComposeResult:
        """Show the question and the meaning of each key."""
        rows = [f"  {key}    {meaning}" for key, meaning in self.answers.items()]
        yield Vertical(Static("\n".join([self.text, "", *rows, "  esc  back"]), markup=False))

    def on_key(self, event: events.Key) -> None:
        """Take the answer; ignore other keys."""
        event.stop()
        event.prevent_default()
        if event.key in self.answers:
            self.dismiss(event.key)
        elif event.key in ("escape", "ctrl+c", "q"):
            self.dismiss(None)


class AskText(ModalScreen[str | None]):
    """Asks for a line of text. Returns it, perhaps empty, or None to change nothing."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Back")]
    DEFAULT_CSS = """
    AskText { align: center bottom; background: transparent; }
    AskText Input { width: 100%; max-width: 80; margin-bottom: 1; }
    """

    def __init__(self, title: str, text: str) -> None:
        super().__init__()
        self._title = title
        self._text = text

    def compose(self) -> ComposeResult:
        """Show the line to type into."""
        field = Input(self._text, placeholder="any text; empty for all lines")
        field.border_title = self._title
        yield field

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Take the text."""
        self.dismiss(event.value)


class TextScreen(Screen[None]):
    """A long text to read: wrapped and from its beginning, or as a log, which is not wrapped, at its end."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,q,enter", "app.pop_screen", "Back", key_display="esc")]
    DEFAULT_CSS = "TextScreen Log { height: 1fr; background: $background; padding: 0 1; }"

    def __init__(self, title: str, text: str, *, is_log: bool = False) -> None:
        super().__init__()
        self._title, self._text, self._is_log = title, text, is_log

    def compose(self) -> ComposeResult:
        """Show the title and room for the text."""
        yield Static(self._title, classes="bar", markup=False)
        if self._is_log:
            yield Log()
        else:
            with VerticalScroll(classes="text"):
                yield Static(self._text, markup=False)
        yield Footer()

    def on_mount(self) -> None:
        """Fill in a log; let the arrows scroll."""
        if self._is_log:
            self.query_one(Log).write(self._text).focus()
        else:
            self.query_one(VerticalScroll).focus()


class HelpScreen(Screen[None]):
    """All keys, in sections with a title each."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q,question_mark", "app.pop_screen", "Back", key_display="esc")
    ]

    def __init__(self, sections: Sequence[tuple[str, Sequence[BindingType]]]) -> None:
        super().__init__()
        self._sections = sections

    def compose(self) -> ComposeResult:
        """Show the sections."""
        yield Static("Keys", classes="bar")
        with VerticalScroll(classes="text"):
            for title, bindings in self._sections:
                yield Static(Text(title), classes="heading")
                yield Static(_key_table(bindings))
        yield Footer()

    def on_mount(self) -> None:
        """Let the arrows scroll."""
        self.query_one(VerticalScroll).focus()


def _key_table(bindings: Sequence[BindingType]) -> Table:
    table = Table.grid(padding=(0, 2))
    table.add_column(width=14, no_wrap=True, style="bold")
    table.add_column()
    for each in bindings:
        binding = each if isinstance(each, Binding) else Binding(*each)
        if binding.description:
            key = binding.key_display or binding.key.replace(",", " ")
            table.add_row(key, binding.tooltip or binding.description)
    return table
