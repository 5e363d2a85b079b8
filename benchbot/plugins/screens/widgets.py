"""Widgets of forms and lists: a labelled field, a table of plain text, and facts; nothing in them is markup."""

import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import ClassVar

from rich.text import Text
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import DataTable, Input, Label, OptionList, Select, Static
from textual.widgets.option_list import Option as Choice

from benchbot.core.errors import BenchbotError
from benchbot.core.text import one_line

Option = tuple[str, str]
"""The words of a choice, and its value."""


class FormField(Horizontal):
    """A label and a widget beside it, one line high."""

    DEFAULT_CSS = """
    FormField { height: 1; width: 1fr; }
    FormField > Label { width: 16; color: $text-muted; }
    FormField > Input { width: 1fr; height: 1; border: none; padding: 0 1; background: $boost; }
    FormField > Input:focus { background: $primary-muted; }
    FormField > Select { width: 1fr; }
    """

    def __init__(self, label: str, widget: Input | Select[str]) -> None:
        super().__init__(Label(label, markup=False), widget)
        self.widget = widget


class TextField(FormField):
    """A line of text."""

    def __init__(self, label: str, value: str = "", *, placeholder: str = "", name: str | None = None) -> None:
        field = Input(value, placeholder=placeholder, compact=True, name=name or label)
        super().__init__(label, field)
        # A cursor that blinks would send bytes for ever over a connection where nothing happens.
        field.cursor_blink = False
        self._input = field

    @property
    def value(self) -> str:
        """The text without blanks around it."""
        return self._input.value.strip()

    @value.setter
    def value(self, text: str) -> None:
        self._input.value = text

    def focus_input(self) -> None:
        """Move the cursor into it at once, so that keys typed ahead already go there."""
        self.screen.set_focus(self._input)


class OptionsField(TextField):
    """Any options of a command that have no field of their own, as they are typed in a shell."""

    def __init__(self, *, placeholder: str = "as in a shell") -> None:
        super().__init__("More options", placeholder=placeholder)

    @property
    def words(self) -> list[str]:
        """The options, word by word; raises BenchbotError for a quotation that is not closed."""
        return words_of(self.value)


def words_of(text: str) -> list[str]:
    """Return the words of options as a shell reads them; raises BenchbotError for a quotation that is not closed."""
    try:
        return shlex.split(text)
    except ValueError as error:
        raise BenchbotError("More options cannot be read.", f"{error}: {text}.", "Close the quotation.") from error


class ChoiceField(FormField):
    """One of several values."""

    def __init__(
        self, label: str, options: Sequence[Option], *, value: str | None = None, name: str | None = None
    ) -> None:
        first = options[0][1] if value is None else value
        select: Select[str] = Select(_shown(options), value=first, allow_blank=False, compact=True, name=name or label)
        super().__init__(label, select)
        self._select = select

    @property
    def value(self) -> str:
        """The chosen value."""
        return str(self._select.value)

    @value.setter
    def value(self, value: str) -> None:
        self._select.value = value

    def offer(self, options: Sequence[Option]) -> None:
        """Offer other options; the present choice stays where it is still among them."""
        before = self.value
        self._select.set_options(_shown(options))
        if before in [value for _, value in options]:
            self._select.value = before


class CheckList(OptionList):
    """Names of which any number can be chosen, by Space, Enter or mouse; a letter says so, no colour alone."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "select", "Choose", show=False),
        Binding("j", "cursor_down", "Down", show=False),
        Binding("k", "cursor_up", "Up", show=False),
    ]
    DEFAULT_CSS = """
    CheckList { height: auto; max-height: 7; border: none; padding: 0; background: $background; text-wrap: nowrap; }
    CheckList:focus { border: none; background-tint: $foreground 4%; }
    Screen.-low CheckList, Screen.-flat CheckList { max-height: 4; }
    """

    class Chosen(Message):
        """Other names are chosen now."""

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id, markup=False)
        self._labels: dict[str, str] = {}
        self._chosen: set[str] = set()

    @property
    def chosen(self) -> list[str]:
        """The chosen names, in the order of the list."""
        return [name for name in self._labels if name in self._chosen]

    def offer(self, labels: Mapping[str, str], chosen: Collection[str] = ()) -> None:
        """Offer names with what is shown for each; some of them are chosen already."""
        self._labels = {name: one_line(label) for name, label in labels.items()}
        self._chosen = {name for name in chosen if name in labels}
        self.set_options([Choice(self._prompt(name), id=name) for name in labels])
        if labels:
            self.highlighted = 0

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Choose the marked one, or choose it no more."""
        event.stop()
        if event.option_id is not None:
            self._chosen ^= {event.option_id}
            self.replace_option_prompt(event.option_id, self._prompt(event.option_id))
            self.post_message(self.Chosen())

    def _prompt(self, name: str) -> Text:
        is_chosen = name in self._chosen
        return Text(f"[{'x' if is_chosen else ' '}] {self._labels[name]}", "bold" if is_chosen else "")


class Table(DataTable[Text]):
    """Rows of plain text, each with a key, with vi's keys beside the arrows."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("j", "cursor_down", "Down", show=False),
        Binding("k", "cursor_up", "Up", show=False),
        Binding("home", "scroll_top", "First", show=False),
        Binding("end", "scroll_bottom", "Last", show=False),
    ]
    DEFAULT_CSS = """
    Table { overflow-x: hidden; height: 1fr; background: $background; scrollbar-size-vertical: 1; }
    Table:focus { background-tint: $foreground 0%; }
    """

    def __init__(self, columns: Mapping[str, int | None], *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(cursor_type="row", zebra_stripes=True, id=id)
        self._widths = columns
        self._keys: list[str] = []

    def on_mount(self) -> None:
        """Make the columns."""
        for label, width in self._widths.items():
            self.add_column(label, width=width)

    @property
    def marked(self) -> str | None:
        """The key of the row under the cursor."""
        return self._keys[self.cursor_row] if 0 <= self.cursor_row < len(self._keys) else None

    def fill(self, rows: Iterable[tuple[str, Sequence[str | Text]]]) -> None:
        """Show other rows; the cursor stays on the row of the same key."""
        before = self.marked
        self.clear()
        self._keys = []
        for key, cells in rows:
            self._keys.append(key)
            self.add_row(*(Text(one_line(cell)) if isinstance(cell, str) else cell for cell in cells), key=key)
        if before in self._keys:
            self.move_cursor(row=self._keys.index(before))


class Facts(Static):
    """Plain text, such as labels and values."""

    DEFAULT_CSS = "Facts { height: auto; }"

    def __init__(self, text: str = "", *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(text, markup=False, id=id, classes=classes)

    def tell(self, rows: Mapping[str, object]) -> None:
        """Show labels with their values below each; what is empty is left out."""
        shown = [Text.assemble((label, "bold"), "\n  ", Text(str(value))) for label, value in rows.items() if value]
        self.update(Text("\n").join(shown))


def _shown(options: Sequence[Option]) -> list[tuple[Text, str]]:
    return [(Text(one_line(label)), value) for label, value in options]
