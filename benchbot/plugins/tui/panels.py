"""Text panels: headlines, rows, gauges and legends."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from textual.content import Content
from textual.widgets import Static

if TYPE_CHECKING:
    from benchbot.plugins.drawing.palette import Color

FULL, EMPTY = "━", "╌"
SPARKS = "▁▂▃▄▅▆"
"""Lower than a line, so that lines below one another stay apart."""
LEGEND_MARK = "■"
MUTED = "$foreground 60%"

Row = tuple[str, str]


@dataclass(frozen=True)
class Badge:
    """A state in a word, and its tone (`success`, `warning`, `error`, `accent` or `muted`)."""

    word: str
    tone: str


@dataclass(frozen=True)
class Gauge:
    """The used part of a limit."""

    name: str
    used: float
    limit: float
    unit: str

    @property
    def share(self) -> float:
        """From 0 to 1."""
        return min(max(self.used / self.limit, 0.0), 1.0) if self.limit > 0 else 1.0

    def __str__(self) -> str:
        """Return the figures."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{_short(self.used)}/{_short(self.limit)}{unit}"


class Words(Static):
    """Text that is updated often; it is painted again only when it changes."""

    DEFAULT_CSS: ClassVar[str] = "Words { height: auto; }"

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__("", id=id, classes=classes, markup=False)
        self._shown = Content("")

    def tell(self, content: Content | str) -> None:
        """Show a text from now on."""
        shown = Content(content) if isinstance(content, str) else content
        if not shown.is_same(self._shown):
            before, self._shown = self._shown.plain, shown
            # Text that keeps its number of lines needs no new layout of the screen.
            self.update(shown, layout=not before or self._lines(before) != self._lines(shown.plain))

    def _lines(self, text: str) -> int:
        width = self.size.width
        if self.styles.text_wrap == "nowrap" or not width:
            return text.count("\n")
        return sum(1 + len(line) // width for line in text.split("\n"))


def headline(badge: Badge, under_way: list[str], title: str) -> Content:
    """Return the first line of a screen: the badge, the commands under way, and the title."""
    tone = "bold reverse" if badge.tone == "muted" else f"bold reverse ${badge.tone}"
    waiting = f"  {', '.join(under_way)} …" if under_way else ""
    return Content.assemble((f" {badge.word} ", tone), (waiting, "$text-warning"), f"  {title}")


def rows(pairs: Sequence[Row], names: int = 0) -> Content:
    """Return labels and values as two columns, a line each; the labels have so many columns at least."""
    width = max([names, *(len(label) for label, _ in pairs)])
    lines = [Content.assemble((f"{label:<{width}}  ", MUTED), value) for label, value in pairs]
    return Content("\n").join(lines)


@dataclass(frozen=True)
class Trend:
    """A figure in words, and the values that it has had; None where it was not known."""

    name: str
    now: str
    values: Sequence[float | None]


def trends(shown: Sequence[Trend], width: int) -> Content:
    """Return figures with the lines of what they have been, within so many columns, a line each."""
    names = max((len(each.name) for each in shown), default=0)
    figures = max((len(each.now) for each in shown if each.values), default=0)
    room = max(0, width - names - figures - 4)
    lines = [
        Content.assemble(
            (f"{each.name:<{names}}  ", MUTED), f"{each.now:<{figures}}  ", (spark(each.values, room), "$accent 70%")
        )
        for each in shown
    ]
    return Content("\n").join(lines)


def spark(values: Sequence[float | None], width: int) -> str:
    """Return the newest values as a line of blocks from 0 to their greatest, one a column; gaps where none is known."""
    newest = list(values[-width:]) if width > 0 else []
    most = max((value for value in newest if value is not None), default=0.0)
    steps = len(SPARKS) - 1
    return "".join(
        " " if value is None else SPARKS[round(max(value, 0.0) / most * steps) if most > 0 else 0] for value in newest
    )


def bars(gauges: Sequence[Gauge], width: int, names: int = 0) -> Content:
    """Return gauges as bars within so many columns, a line each; the names have so many columns at least."""
    names = max([names, *(len(gauge.name) for gauge in gauges)])
    figures = max((len(str(gauge)) for gauge in gauges), default=0)
    room = max(4, width - names - figures - 3)
    lines = [
        Content.assemble((f"{gauge.name:<{names}}  ", MUTED), bar(gauge.share, room), f" {gauge}") for gauge in gauges
    ]
    return Content("\n").join(lines)


def bar(share: float, width: int) -> Content:
    """Return a bar; its two parts differ in form, not in colour alone."""
    full = max(round(share * width), share > 0)
    tone = "$error" if share >= 0.9 else "$warning" if share >= 0.75 else "$success"
    return Content.assemble((FULL * full, tone), (EMPTY * (width - full), MUTED))


def legend(entries: "Sequence[tuple[Color, str]]", width: int, marks: Sequence[str] = ()) -> Content:
    """Return colours and their meanings in one line, as many as fit; `marks` replace colours where there are none."""
    parts: list[Content] = []
    left = width
    for place, ((red, green, blue), name) in enumerate(entries):
        needed = len(name) + 2 + 2 * bool(parts)
        # Room is kept for the number of those that do not fit.
        if needed > left - (4 if place < len(entries) - 1 else 0):
            parts.append(Content.styled(f"+{len(entries) - place}", MUTED))
            break
        left -= needed
        mark = Content(marks[place]) if marks else Content.styled(LEGEND_MARK, f"rgb({red},{green},{blue})")
        parts.append(Content.assemble(mark, f" {name}"))
    return Content("  ").join(parts)


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 10 or value == int(value) else f"{value:.1f}"
