"""Asks for a word or two: what lines of a log must hold."""

from textual.app import ComposeResult
from textual.binding import Binding
from textual.screen import ModalScreen
from textual.widgets import Input


class AskText(ModalScreen[str | None]):
    """Its result is the text, which may be empty, or None when nothing is to change."""

    BINDINGS = [Binding("escape", "dismiss", "Back")]  # noqa: RUF012 - as Textual declares it
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
        asked = Input(self._text, placeholder="any text; empty for all lines")
        asked.border_title = self._title
        yield asked

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Take the text."""
        self.dismiss(event.value)
