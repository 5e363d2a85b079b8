"""The matrix of a batch's episodes, a coloured sign for each; or a bar for each environment where there is no room.

Only rows that have changed are painted again: a thousand episodes of which none changes cost nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.geometry import Region, Size, Spacing
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from benchbot.plugins.tui.batch_facts import DONE, OTHER, PENDING, RUNNING, STATES, filled, shares, style, tally
from benchbot.plugins.watching.views import EpisodeCell

LONGEST_NAME = 22
TICK = 10
HEAD_LINES = 1

Column = tuple[str, int, int, int]
"""Solution and robot, seed, repeat, and a number for cells that differ in a setting only."""


@dataclass(frozen=True)
class Grid:
    """The cells by row and column: `places[row][column]` is an index into them, None where the plan has no episode."""

    environments: tuple[str, ...]
    columns: tuple[Column, ...]
    places: tuple[tuple[int | None, ...], ...]

    @classmethod
    def of(cls, cells: Sequence[EpisodeCell]) -> Self:
        """Return the grid of a batch's cells: environments and robots in their order, then seeds and repeats."""
        robots = {robot: place for place, robot in enumerate(dict.fromkeys(cell.who for cell in cells))}
        found: dict[str, dict[Column, int]] = {}
        for index, cell in enumerate(cells):
            row = found.setdefault(cell.environment, {})
            number = 0
            while (column := (cell.who, cell.seed, cell.repeat, number)) in row:
                number += 1
            row[column] = index
        every = {column for row in found.values() for column in row}
        columns = tuple(sorted(every, key=lambda column: (robots[column[0]], *column[1:])))
        places = tuple(tuple(row.get(column) for column in columns) for row in found.values())
        return cls(tuple(found), columns, places)

    def wrapped(self, width: int) -> Self:
        """Return the grid with each environment on as many lines as it needs; those after the first have no name."""
        names: list[str] = []
        places: list[tuple[int | None, ...]] = []
        for name, row in zip(self.environments, self.places, strict=True):
            there = [index for index in row if index is not None]
            for start in range(0, max(len(there), 1), width):
                line = there[start : start + width]
                names.append("" if start else name)
                places.append((*line, *[None] * (width - len(line))))
        return type(self)(tuple(names), self.columns[:width], tuple(places))

    @cached_property
    def position(self) -> dict[int, tuple[int, int]]:
        """Row and column of each cell."""
        return {
            index: (row, column)
            for row, places in enumerate(self.places)
            for column, index in enumerate(places)
            if index is not None
        }

    def index(self, row: int, column: int) -> int | None:
        """Return the index of the cell at a row and column."""
        return self.places[row][column]


class Matrix(ScrollView):
    """Shows the episodes of a batch, with a cursor."""

    DEFAULT_CSS: ClassVar[str] = """
    Matrix { height: 1fr; scrollbar-size-vertical: 1; scrollbar-size-horizontal: 1; }
    Matrix > .cell--cursor { color: $background; background: $foreground; text-style: bold; }
    Matrix > .cell--head { color: $foreground 60%; }
    """ + "".join(
        f"Matrix > .cell--{state} {{ color: {each.color}; background: {each.background};"
        f" text-style: {'bold' if each.bold else 'none'}; }}\n"
        for state, each in {**STATES, "other": OTHER}.items()
    )
    COMPONENT_CLASSES: ClassVar[set[str]] = {f"cell--{name}" for name in (*STATES, "other", "cursor", "head")}
    can_focus = False

    class Moved(Message):
        """The cursor is on another episode, or that is in another state."""

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self.cells: tuple[EpisodeCell, ...] = ()
        self.states: list[str] = []
        self.wants_counts: bool | None = None
        """Whether rows are to be bars; None means only where there is no room for signs."""
        self.shows_counts = False
        """Whether rows are bars just now."""
        self._whole = self._grid = Grid((), (), ())
        self._row = self._column = 0
        self._lines: dict[int, Strip] = {}

    @property
    def chosen(self) -> EpisodeCell | None:
        """The episode under the cursor."""
        if not self._grid.columns or self.shows_counts:
            return None
        index = self._grid.index(self._row, self._column)
        return None if index is None else self.cells[index]

    @property
    def chosen_row(self) -> tuple[str, dict[str, int]] | None:
        """The environment under the cursor, and the number of its episodes in each state."""
        if not self._grid.columns or not self.shows_counts:
            return None
        return self._grid.environments[self._row], self._tally(self._row)

    def show(self, cells: tuple[EpisodeCell, ...]) -> None:
        """Show the episodes of a batch from now on."""
        if cells is self.cells:
            return
        states = [cell.state for cell in cells]
        if len(cells) != len(self.cells) or (cells and (cells[0].name, cells[-1].name) != self._ends()):
            self._whole = self._grid = Grid.of(cells)
            self._row = self._column = 0
            self.cells, self.states = cells, states
            self._lay_out()
            self.post_message(self.Moved())
            return
        changed = {
            self._grid.position[i][0]
            for i, (new, old) in enumerate(zip(states, self.states, strict=True))
            if new != old
        }
        self.cells, self.states = cells, states
        for row in changed:
            self._repaint(row)
        self.post_message(self.Moved())

    def toggle(self) -> None:
        """Show signs in place of bars, or bars in place of signs."""
        self.wants_counts = not self.shows_counts
        self._lay_out()
        self.post_message(self.Moved())

    def move(self, rows: int, columns: int) -> None:
        """Move the cursor."""
        if not self._grid.columns:
            return
        self._go(
            min(max(self._row + rows, 0), len(self._grid.environments) - 1),
            min(max(self._column + columns, 0), len(self._grid.columns) - 1),
        )

    def next_failure(self, step: int) -> bool:
        """Move the cursor to the next episode that has failed, row by row; say whether there is one."""
        width = len(self._grid.columns)
        here = self._row * width + self._column
        failed = sorted(
            row * width + column
            for index, (row, column) in self._grid.position.items()
            if self.states[index] not in (PENDING, RUNNING, DONE)
        )
        if not failed:
            return False
        if step > 0:
            place = next((place for place in failed if place > here), failed[0])
        else:
            place = next((place for place in reversed(failed) if place < here), failed[-1])
        if self.shows_counts:
            self.wants_counts = False
            self._lay_out()
        self._go(*divmod(place, width))
        return True

    def on_click(self, event: events.Click) -> None:
        """Move the cursor to the episode, or to the bar, that was clicked on."""
        row, column = event.y - HEAD_LINES + self.scroll_offset.y, event.x - self._label_width + self.scroll_offset.x
        if event.y < HEAD_LINES or row >= len(self._grid.environments):
            return
        if self.shows_counts or 0 <= column < len(self._grid.columns):
            self._go(row, self._column if self.shows_counts else column)

    def on_resize(self) -> None:
        """Choose between signs and bars for the new size."""
        self._lay_out()

    def notify_style_update(self) -> None:
        """Render again in another theme."""
        self._lines.clear()
        super().notify_style_update()

    def render_line(self, y: int) -> Strip:
        """Return one line: the head stays, rows scroll below it."""
        width = self.scrollable_content_region.width
        base = self.rich_style
        if not self._grid.columns:
            return Strip.blank(width, base)
        scroll_x, scroll_y = self.scroll_offset
        label = self._label_width
        row = -1 if y < HEAD_LINES else y - HEAD_LINES + scroll_y
        if row >= len(self._grid.environments):
            return Strip.blank(width, base)
        strip = self._lines.get(row)
        if strip is None:
            strip = self._lines[row] = (
                self._head() if row < 0 else self._bars(row) if self.shows_counts else self._signs(row)
            )
        strip = strip.apply_style(base)
        if scroll_x:
            strip = Strip.join([strip.crop(0, label), strip.crop(label + scroll_x, strip.cell_length)])
        return strip.adjust_cell_length(width, base)

    @property
    def _label_width(self) -> int:
        longest = max((len(name) for name in self._whole.environments), default=0)
        return min(longest, LONGEST_NAME) + 1

    def _tally(self, row: int) -> dict[str, int]:
        return tally(self.states[index] for index in self._grid.places[row] if index is not None)

    def _ends(self) -> tuple[str, str]:
        return (self.cells[0].name, self.cells[-1].name) if self.cells else ("", "")

    def _lay_out(self) -> None:
        self._lines.clear()
        index = self._grid.index(self._row, self._column) if self._grid.columns and not self.shows_counts else None
        self._grid, self.shows_counts = self._chosen_grid()
        self._row, self._column = self._grid.position.get(index, (0, 0)) if index is not None else (0, 0)
        width = 0 if self.shows_counts else self._label_width + len(self._grid.columns)
        self.virtual_size = Size(width, HEAD_LINES + len(self._grid.environments))
        self.refresh()

    def _chosen_grid(self) -> tuple[Grid, bool]:
        """Return the grid to show at this size, and whether its rows are bars."""
        whole, room, lines = self._whole, self.size.width - self._label_width - 1, self.size.height - HEAD_LINES
        if self.wants_counts:
            return whole, True
        if len(whole.columns) <= room or room < TICK:
            return whole, self.wants_counts is None and len(whole.columns) > room
        wrapped = whole.wrapped(room // TICK * TICK)
        fits = len(wrapped.environments) <= lines
        # A few bars on an empty screen tell less than signs that scroll.
        return (
            (wrapped, False)
            if fits or self.wants_counts is False or 3 * len(whole.environments) < lines
            else (whole, True)
        )

    def _repaint(self, row: int) -> None:
        self._lines.pop(row, None)
        self.refresh(Region(0, HEAD_LINES + row - self.scroll_offset.y, self.size.width, 1))

    def _go(self, row: int, column: int) -> None:
        before = self._row
        self._row, self._column = row, column
        for changed in {before, row, -1}:
            self._repaint(changed)
        across = 0 if self.shows_counts else self._column
        self.scroll_to_region(
            Region(across, HEAD_LINES + row, 1, 1),
            spacing=Spacing(HEAD_LINES, self._label_width, 0, 0),
            animate=False, force=True,
        )  # fmt: skip
        self.post_message(self.Moved())

    def _head(self) -> Strip:
        style = self._style("head")
        label = " " * self._label_width
        if self.shows_counts:
            return Strip([Segment(f"{label}{len(self._grid.columns)} episodes each", style)])
        if self._grid is not self._whole:
            return Strip([Segment(f"{label}{len(self._grid.columns)} a line, by robot, seed and repeat", style)])
        line = [" "] * len(self._grid.columns)
        robot: str | None = None
        for place, (name, seed, repeat, number) in enumerate(self._grid.columns):
            text = ""
            if name != robot:
                robot, text = name, f"{name} {seed}"
            elif place % TICK == 0 and not repeat and not number:
                text = str(seed)
            before = "".join(line[max(0, place - 1) : place + len(text)])
            if text and not before.strip() and place + len(text) <= len(line):
                line[place : place + len(text)] = text
        return Strip([Segment(label + "".join(line), style)])

    def _label(self, row: int) -> Segment:
        name = self._grid.environments[row]
        name = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
        style = self._style("cursor") if row == self._row and self.shows_counts else Style()
        return Segment(f"{name:<{self._label_width - 1}} ", style)

    def _signs(self, row: int) -> Strip:
        cursor = self._column if row == self._row else -1
        runs: list[tuple[str, str]] = []
        for column, index in enumerate(self._grid.places[row]):
            state = "" if index is None else self.states[index]
            text = style(state).letter if state else " "
            name = "cursor" if column == cursor else state
            if runs and runs[-1][1] == name:
                runs[-1] = (runs[-1][0] + text, name)
            else:
                runs.append((text, name))
        return Strip([self._label(row), *(Segment(text, self._style(name)) for text, name in runs)])

    def _bars(self, row: int) -> Strip:
        counted = self._tally(row)
        widths = shares(list(counted.values()), self.scrollable_content_region.width - self._label_width)
        segments = [
            Segment(filled(state, counted[state], columns), self._style(state))
            for state, columns in zip(counted, widths, strict=True)
        ]
        return Strip([self._label(row), *segments])

    def _style(self, state: str) -> Style:
        if not state:
            return Style()
        known = state in STATES or state in ("cursor", "head")
        return self.get_component_rich_style(f"cell--{state if known else 'other'}")
