"""The log of a run: the newest lines that pass a filter, scrolled to the end unless the user has scrolled up."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual.content import Content
from textual.geometry import Size
from textual.scroll_view import ScrollView
from textual.strip import Strip

from benchbot.plugins.watching.views import LogLine

LEVELS = ("debug", "info", "warning", "error")
_MARKS = {"debug": "debug", "info": "info", "warning": "WARN", "error": "ERROR"}


@dataclass(frozen=True)
class LogFilter:
    """The lines to show; None is every source."""

    source: str | None = None
    level: str = "info"
    text: str = ""

    def passes(self, line: LogLine) -> bool:
        """Return whether to show a line."""
        if self.source is not None and line.source != self.source:
            return False
        if line.level in LEVELS and LEVELS.index(line.level) < LEVELS.index(self.level):
            return False
        return self.text.casefold() in line.text.casefold()

    def next_source(self, sources: Sequence[str]) -> "LogFilter":
        """Return the filter for the source after this one, and after the last one for all."""
        cycle = [None, *sources]
        place = cycle.index(self.source) if self.source in cycle else 0
        return replace(self, source=cycle[(place + 1) % len(cycle)])

    def next_level(self) -> "LogFilter":
        """Return the filter that is stricter by a level, and after the strictest the one that shows everything."""
        return replace(self, level=LEVELS[(LEVELS.index(self.level) + 1) % len(LEVELS)])

    def with_text(self, text: str) -> "LogFilter":
        """Return the filter for lines that hold a text."""
        return replace(self, text=text.strip())

    def __str__(self) -> str:
        """Return a description of the filter."""
        level = {"debug": "everything", "error": "errors"}.get(self.level, f"{self.level} and worse")
        text = f"with “{self.text}”" if self.text else ""
        return " · ".join(filter(None, [self.source or "all sources", level, text]))


class LogView(ScrollView):
    """Shows log lines without copying them."""

    DEFAULT_CSS: ClassVar[str] = """
    LogView { height: 1fr; scrollbar-size-vertical: 1; scrollbar-size-horizontal: 0; overflow-x: hidden; }
    LogView > .log--error { color: $text-error; text-style: bold; }
    LogView > .log--warning { color: $text-warning; }
    LogView > .log--info { color: $foreground; }
    LogView > .log--debug, LogView > .log--time { color: $text-muted; }
    LogView > .log--source { color: $text-accent; }
    """
    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "log--error", "log--warning", "log--info", "log--debug", "log--time", "log--source",
    }  # fmt: skip
    can_focus = False

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self.filter = LogFilter()
        self._log: tuple[LogLine, ...] = ()
        self._dropped = 0
        self._shown: list[LogLine] = []
        self._follows = True

    @property
    def sources(self) -> list[str]:
        """The sources of the lines, by name."""
        return sorted({line.source for line in self._log})

    @property
    def count(self) -> int:
        """The number of lines that pass the filter."""
        return len(self._shown)

    def show(self, log: tuple[LogLine, ...], dropped: int) -> None:
        """Show these lines from now on; `dropped` came before them."""
        if log is self._log or (log == self._log and dropped == self._dropped):
            return
        self._log, self._dropped = log, dropped
        self._select()

    def choose(self, chosen: LogFilter) -> None:
        """Show what passes another filter."""
        self.filter = chosen
        self._select()

    def scroll(self, where: str) -> None:
        """Scroll a `page_up` or `page_down`, `home` or to the `end`, where new lines appear."""
        getattr(self, f"scroll_{where}")(animate=False, force=True)
        self.call_after_refresh(self._note_end)

    def on_mouse_scroll_up(self) -> None:
        """Stop following the newest lines."""
        self.call_after_refresh(self._note_end)

    def on_mouse_scroll_down(self) -> None:
        """Follow the newest lines again, at the end."""
        self.call_after_refresh(self._note_end)

    def on_resize(self) -> None:
        """Stay at the end."""
        if self._follows:
            self.scroll_end(animate=False)

    def _note_end(self) -> None:
        self._follows = self.scroll_offset.y >= self.max_scroll_y

    def render_line(self, y: int) -> Strip:
        """Return one line."""
        width = self.scrollable_content_region.width
        index = y + self.scroll_offset.y
        if not 0 <= index < len(self._shown):
            return Strip.blank(width, self.rich_style)
        line = self._shown[index]
        level = line.level if line.level in LEVELS else "info"
        style, muted, source = (self._style(name) for name in (level, "time", "source"))
        stamp = time.strftime("%H:%M:%S", time.localtime(line.time_s))
        segments = [
            Segment(f"{' ' if line.is_exact else '~'}{stamp} ", muted),
            Segment(f"{line.source[:10]:<11}", source),
            Segment(f"{_MARKS[level]:<6}", muted if level in ("debug", "info") else style),
            Segment(line.text, style),
        ]
        return Strip(segments).adjust_cell_length(width, self.rich_style)

    def _style(self, name: str) -> Style:
        return self.get_component_rich_style(f"log--{name}")

    def _select(self) -> None:
        self._shown = [line for line in self._log if self.filter.passes(line)]
        self.virtual_size = Size(0, len(self._shown))
        dropped = f" · {self._dropped} older lines are gone" if self._dropped else ""
        parent = self.parent
        if parent is not None and hasattr(parent, "border_title"):
            parent.border_title = Content(f"Log · {self.filter}{dropped}")
        if self._follows:
            self.scroll_end(animate=False)
        self.refresh()
