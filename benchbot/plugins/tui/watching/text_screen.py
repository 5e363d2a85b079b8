"""A text to read: the logs of an episode."""

from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Footer, Log, Static

MOST_BYTES = 1 << 20


class TextScreen(ModalScreen[None]):
    """Shows a text, at its end. `escape` leaves it."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,q,enter", "dismiss", "Back", key_display="esc")]
    DEFAULT_CSS: ClassVar[str] = """
    TextScreen { align: center middle; }
    TextScreen Static { height: 1; background: $panel; padding: 0 1; text-style: bold; }
    TextScreen Log { height: 1fr; background: $background; padding: 0 1; }
    """

    def __init__(self, title: str, text: str) -> None:
        super().__init__()
        self._title = title
        self._text = text

    def compose(self) -> ComposeResult:
        """Show it."""
        yield Static(self._title, markup=False)
        yield Log()
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Fill it in, and let the arrows scroll."""
        log = self.query_one(Log)
        log.write(self._text)
        log.focus()


def logs_of(folder: Path) -> str:
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
        with path.open("rb") as log:
            size = log.seek(0, 2)
            log.seek(max(0, size - MOST_BYTES))
            text = log.read().decode("utf-8", "replace")
    except OSError as error:
        return f"It cannot be read: {error.strerror}."
    # Colours and cursor movements of a solution would be commands to this terminal.
    return "".join(character for character in text if character.isprintable() or character in "\n\t")
