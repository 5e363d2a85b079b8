"""A question that a person answers with one key before something happens that cannot be undone."""

from collections.abc import Mapping

from textual import events
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Static


class Question(ModalScreen[str | None]):
    """Asks; its result is the key of the answer that was chosen, or None when nothing is to happen."""

    DEFAULT_CSS = """
    Question { align: center middle; }
    Question Vertical {
        width: 64; max-width: 100%; height: auto; max-height: 100%;
        border: round $warning; padding: 0 1; background: $surface; overflow-y: auto;
    }
    """

    def __init__(self, text: str, answers: Mapping[str, str]) -> None:
        super().__init__()
        self.text = text
        self.answers = dict(answers)

    def compose(self) -> ComposeResult:
        """Show the question and what each key means."""
        rows = [f"  {key}    {meaning}" for key, meaning in self.answers.items()]
        yield Vertical(Static("\n".join([self.text, "", *rows, "  esc  back"]), markup=False))

    def on_key(self, event: events.Key) -> None:
        """Take the answer; every other key is no answer."""
        event.stop()
        event.prevent_default()
        if event.key in self.answers:
            self.dismiss(event.key)
        elif event.key in ("escape", "ctrl+c", "q"):
            self.dismiss(None)
