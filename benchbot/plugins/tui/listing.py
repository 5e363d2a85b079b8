"""A table of any length: a head that says how it is sorted, rows that are written only when they are seen, a cursor."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from rich.cells import cell_len, set_cell_size
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.geometry import Region, Size, Spacing
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from benchbot.core.text import one_line

HEAD_LINES = 1
MEASURED = 300
"""Columns are as wide as the cells of about so many rows, evenly spread, need."""
Item = TypeVar("Item")
Key = float | str | None
"""What a row is sorted by; None comes last, whichever way."""


@dataclass(frozen=True)
class Column(Generic[Item]):
    """A column: its title, its cells, what they are sorted by, and its largest width; `right` aligns numbers."""

    title: str
    text: Callable[[Item], str]
    key: Callable[[Item], Key]
    width: int
    right: bool = False
    state: Callable[[Item], str] | None = None
    """Returns the component class of a cell's colours, where it has any."""


class Listing(ScrollView, Generic[Item]):
    """Shows items as rows, filtered and sorted."""

    DEFAULT_CSS: ClassVar[str] = """
    Listing { height: 1fr; scrollbar-size-vertical: 1; scrollbar-size-horizontal: 0; overflow-x: hidden; }
    Listing > .listing--head { color: $foreground 60%; text-style: bold underline; }
    Listing > .listing--cursor { color: $background; background: $foreground; text-style: bold; }
    """
    COMPONENT_CLASSES: ClassVar[set[str]] = {"listing--head", "listing--cursor"}
    can_focus = False

    class Moved(Message):
        """The cursor is on another item, or there are other rows."""

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self.columns: Sequence[Column[Item]] = ()
        self.needle = ""
        """Only rows that contain all of these words are shown."""
        self.shown: list[Item] = []
        """The items as they are shown."""
        self._items: Sequence[Item] = ()
        self._widths: list[int] = []
        self._sort = 0
        self._downwards = False
        self._row = 0

    @property
    def chosen(self) -> Item | None:
        """The item under the cursor."""
        return self.shown[self._row] if self._row < len(self.shown) else None

    @property
    def order(self) -> str:
        """How it is sorted and filtered, in words."""
        if not self.columns:
            return ""
        arrow = "↓" if self._downwards else "↑"
        hidden = f" · {len(self.shown)} of {len(self._items)} with “{self.needle}”" if self.needle else ""
        return f"by {self.columns[self._sort].title.lower()} {arrow}{hidden}"

    def show(self, items: Sequence[Item], columns: Sequence[Column[Item]]) -> None:
        """Show these items from now on; the cursor stays in its line."""
        if items is self._items and len(columns) == len(self.columns):
            return
        self._items, self.columns = items, columns
        self._sort = min(self._sort, len(columns) - 1)
        self._arrange()

    def filter(self, needle: str) -> None:
        """Show only rows with these words."""
        self.needle = needle.strip()
        self._row = 0
        self._arrange()

    def sort(self, step: int = 0, column: int | None = None) -> None:
        """Sort by another column, `step` further; by the same one the other way round."""
        before = self._sort
        self._sort = (before + step) % len(self.columns) if column is None else column
        self._downwards = not self._downwards if self._sort == before else self.columns[self._sort].right
        self._row = 0
        self._arrange()

    def move(self, rows: int) -> None:
        """Move the cursor."""
        before = self._row
        self._row = min(max(self._row + rows, 0), max(len(self.shown) - 1, 0))
        for row in {before, self._row}:
            self.refresh(Region(0, HEAD_LINES + row - self.scroll_offset.y, self.size.width, 1))
        self.scroll_to_region(
            Region(0, HEAD_LINES + self._row, 1, 1), spacing=Spacing(HEAD_LINES, 0, 0, 0), animate=False, force=True
        )
        self.post_message(self.Moved())

    def find(self, wanted: Callable[[Item], bool], step: int) -> bool:
        """Move the cursor to the next such item, or the one before; say whether there is one."""
        count = len(self.shown)
        for place in range(1, count + 1):
            row = (self._row + step * place) % count
            if wanted(self.shown[row]):
                self.move(row - self._row)
                return True
        return False

    def on_click(self, event: events.Click) -> None:
        """Mark a row; on the head, sort by a column."""
        row = event.y - HEAD_LINES + self.scroll_offset.y
        if event.y >= HEAD_LINES:
            self.move(row - self._row)
            return
        end = 0
        for place, width in enumerate(self._widths):
            end += width + 1
            if event.x < end:
                self.sort(column=place)
                return

    def render_line(self, y: int) -> Strip:
        """Return one line: the head stays, rows scroll below it."""
        width, base = self.scrollable_content_region.width, self.rich_style
        if y < HEAD_LINES:
            return Strip([Segment(self._head(), self._style("listing--head"))]).adjust_cell_length(width, base)
        row = y - HEAD_LINES + self.scroll_offset.y
        if row >= len(self.shown):
            return Strip.blank(width, base)
        item, marked = self.shown[row], row == self._row
        cursor = self._style("listing--cursor")
        segments = []
        for column, cells in zip(self.columns, self._widths, strict=True):
            style = cursor if marked else self._style(column.state(item)) if column.state is not None else Style()
            segments += [
                Segment(_fitted(column.text(item), cells, right=column.right), style),
                Segment(" ", cursor if marked else None),
            ]
        return Strip(segments).adjust_cell_length(width, cursor if marked else base).apply_style(base)

    def _head(self) -> str:
        arrow = "↓" if self._downwards else "↑"
        titles = [f"{each.title}{arrow * (place == self._sort)}" for place, each in enumerate(self.columns)]
        columns = zip(titles, self.columns, self._widths, strict=True)
        return " ".join(_fitted(title, width, right=column.right) for title, column, width in columns)

    def _arrange(self) -> None:
        words = self.needle.casefold().split()
        column = self.columns[self._sort]
        shown = [item for item in self._items if self._holds(item, words)] if words else list(self._items)
        keys = [column.key(item) for item in shown]
        places = [place for place, key in enumerate(keys) if key is not None]
        places.sort(key=keys.__getitem__, reverse=self._downwards)  # type: ignore[arg-type]
        unknown = [item for item, key in zip(shown, keys, strict=True) if key is None]
        self.shown = [*(shown[place] for place in places), *unknown]
        self._widths = [self._needed(column) for column in self.columns]
        self._row = min(self._row, max(len(self.shown) - 1, 0))
        self.virtual_size = Size(0, HEAD_LINES + len(self.shown))
        self.refresh()
        self.post_message(self.Moved())

    def _needed(self, column: Column[Item]) -> int:
        rows = self.shown[:: len(self.shown) // MEASURED + 1]
        return min(column.width, max([len(column.title) + 1, *(cell_len(one_line(column.text(row))) for row in rows)]))

    def _holds(self, item: Item, words: Sequence[str]) -> bool:
        text = " ".join(column.text(item) for column in self.columns).casefold()
        return all(word in text for word in words)

    def _style(self, name: str) -> Style:
        return self.get_component_rich_style(name)


def _fitted(text: str, width: int, *, right: bool) -> str:
    text = one_line(text)
    text = text if len(text) <= width else f"{text[: width - 1]}…"
    return text.rjust(width) if right else set_cell_size(text, width)
