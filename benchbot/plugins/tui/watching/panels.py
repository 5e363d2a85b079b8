"""Small widgets of facts: rows, gauges, legends. They are painted anew only when their text changes."""

from collections.abc import Sequence
from typing import ClassVar

from textual.content import Content
from textual.widgets import Static

from benchbot.plugins.drawing.palette import Color
from benchbot.plugins.tui.watching.run_facts import Badge, Gauge, Row

FULL, EMPTY = "━", "╌"
LEGEND_MARK = "■"
MUTED = "$foreground 60%"


class Words(Static):
    """Text that is set again and again, mostly to what it is already."""

    DEFAULT_CSS: ClassVar[str] = "Words { height: auto; }"

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__("", id=id, classes=classes, markup=False)
        self._told = Content("")

    def tell(self, content: Content | str) -> None:
        """Show a text from now on."""
        told = Content(content) if isinstance(content, str) else content
        if not told.is_same(self._told):
            before, self._told = self._told.plain, told
            # Where text keeps its shape, nothing else on the screen has to be laid out anew.
            self.update(told, layout=not before or self._lines(before) != self._lines(told.plain))

    def _lines(self, text: str) -> int:
        width = self.size.width
        if self.styles.text_wrap == "nowrap" or not width:
            return text.count("\n")
        return sum(1 + len(line) // width for line in text.split("\n"))


def headline(badge: Badge, doing: str, title: str) -> Content:
    """Return the first line of a screen: what is going on, what was asked for and is not done yet, and of what."""
    tone = "bold reverse" if badge.tone == "muted" else f"bold reverse ${badge.tone}"
    waiting = f"  {doing} …" if doing else ""
    return Content.assemble((f" {badge.word} ", tone), (waiting, "$text-warning"), f"  {title}")


def rows(pairs: Sequence[Row]) -> Content:
    """Return labels and values as two columns, a line each."""
    width = max((len(label) for label, _ in pairs), default=0)
    lines = [Content.assemble((f"{label:<{width}}  ", MUTED), value) for label, value in pairs]
    return Content("\n").join(lines)


def bars(gauges: Sequence[Gauge], width: int) -> Content:
    """Return gauges as bars within so many columns, a line each."""
    if not gauges:
        return Content.styled("no limits", MUTED)
    names, figures = (
        max(map(len, texts)) for texts in zip(*((gauge.name, str(gauge)) for gauge in gauges), strict=True)
    )
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


def legend(entries: Sequence[tuple[Color, str]], width: int, marks: Sequence[str] = ()) -> Content:
    """Return what colours mean in one line, as many of them as fit; `marks` stand for them where there is none."""
    parts: list[Content] = []
    left = width
    for place, ((red, green, blue), name) in enumerate(entries):
        needed = len(name) + 2 + 2 * bool(parts)
        # Room is kept for saying that there are more.
        if needed > left - (4 if place < len(entries) - 1 else 0):
            parts.append(Content.styled(f"+{len(entries) - place}", MUTED))
            break
        left -= needed
        mark = Content(marks[place]) if marks else Content.styled(LEGEND_MARK, f"rgb({red},{green},{blue})")
        parts.append(Content.assemble(mark, f" {name}"))
    return Content("  ").join(parts)
