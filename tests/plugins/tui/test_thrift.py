"""What is sent to a terminal is shorter, and shows the same."""

import io
import re
from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.color import Color
from rich.console import Console
from rich.segment import Segment, Segments
from rich.style import Style

from benchbot.plugins.tui.thrift import ShownCells, thrifty

COLORS = st.sampled_from([None, "#010203", "#a0b0c0", "#ffffff"]).map(lambda name: name and Color.parse(name))
PIECES = st.lists(st.tuples(st.text("▀a ", min_size=1, max_size=3), COLORS, COLORS, st.booleans()), max_size=12)


def cells(text: str) -> list[tuple[str, str, str, bool]]:
    """Return each character with its colours and whether it is bold, as a terminal understands them."""
    found = []
    fore, back, bold = "", "", False
    for codes, letter in re.findall(r"\x1b\[([\d;]*)m|([^\x1b])", text):
        if letter:
            found.append((letter, fore, back, bold))
            continue
        numbers = codes.split(";")
        while numbers:
            code = numbers.pop(0)
            if code in ("38", "48"):
                color, numbers = ";".join(numbers[:4]), numbers[4:]
                fore, back = (color, back) if code == "38" else (fore, color)
            elif code == "1":
                bold = True
            else:
                fore, back, bold = "", "", False
    return found


@given(PIECES)
def test_it_shows_the_same_in_no_more_bytes(pieces: list[tuple[str, Color | None, Color | None, bool]]) -> None:
    segments = [Segment(text, Style(color=fore, bgcolor=back, bold=bold or None)) for text, fore, back, bold in pieces]
    console = Console(file=io.StringIO(), force_terminal=True, color_system="truecolor", width=200)
    with console.capture() as capture:
        console.print(Segments(segments), end="")
    sent = capture.get()
    assert cells(thrifty(sent)) == cells(sent)
    assert len(thrifty(sent)) <= len(sent)


Span = tuple[int, int, list[tuple[str, str]]]
STYLES = st.sampled_from(["", "1", "38;2;1;2;3;48;2;9;8;7", "38;2;1;2;3;48;2;0;0;0"])
SPANS: st.SearchStrategy[Span] = st.tuples(
    st.integers(0, 3),
    st.integers(0, 9),
    st.lists(st.tuples(st.text("▀ab 界e\u0301", min_size=1, max_size=6), STYLES), min_size=1, max_size=4),
)


def painted(spans: Sequence[Span]) -> str:
    """Return what Textual writes for spans: a move, texts whose attributes are reset, and the place of the cursor."""
    lines = []
    for line, column, pieces in spans:
        texts = "".join(f"\x1b[{style}m{text}\x1b[0m" if style else text for text, style in pieces)
        lines.append(f"\x1b[{line + 1};{column + 1}H{texts}\n")
    return "".join([*lines, "\x1b[1;1H"])


class Screen:
    """A terminal of one's own: what stands in which cell, and where the cursor is."""

    def __init__(self) -> None:
        self.cells: dict[tuple[int, int], tuple[str, tuple[str, str, bool]]] = {}
        self.cursor = (0, 0)

    def write(self, text: str) -> None:
        for line, column, sent in re.findall(r"\x1b\[(\d+);(\d+)H((?:[^\x1b]|\x1b\[[\d;]*m)*)", text):
            x, y = int(column) - 1, int(line) - 1
            for letter, fore, back, bold in cells(sent.replace("\n", "")):
                width = cell_len(letter)
                if not width:
                    before = self.cells.get((y, x - 1), ("", ("", "", False)))
                    self.cells[y, x - 1] = (before[0] + letter, before[1])
                    continue
                # Half of a wide character that is overwritten leaves a blank.
                for place in (x, x + width - 1):
                    if self.cells.get((y, place), ("", None))[0] == "right half":
                        self.cells[y, place - 1] = (" ", ("", "", False))
                if cell_len(self.cells.get((y, x + width - 1), ("", None))[0]) == 2:
                    self.cells[y, x + width] = (" ", ("", "", False))
                self.cells[y, x] = (letter, (fore, back, bold))
                if width == 2:
                    self.cells[y, x + 1] = ("right half", (fore, back, bold))
                x += width
            self.cursor = (y, x)


@given(st.lists(st.lists(SPANS, max_size=4), max_size=6))
def test_a_terminal_that_is_sent_only_news_shows_the_same(updates: list[list[Span]]) -> None:
    everything, news, shown = Screen(), Screen(), ShownCells()
    for spans in updates:
        everything.write(painted(spans))
        news.write(shown.news(painted(spans)))
        assert news.cells == everything.cells
        assert news.cursor == everything.cursor


def test_what_is_there_already_is_not_sent_again_until_anything_else_was_written() -> None:
    shown, text = ShownCells(), painted([(0, 0, [("▀▀a", "1")])])
    assert "▀▀a" in shown.news(text)
    assert shown.news(text) == "\x1b[1;1H"
    assert shown.news("\x1b[?25l") == "\x1b[?25l"
    assert shown.news(painted([(0, 0, [("▀▀b", "1")])])) == "\x1b[1;3H\x1b[1mb\x1b[0m\x1b[1;1H"
    # A picture of kitty's: nobody knows which cells it covers.
    assert shown.news("\x1b_Ga=T;AAAA\x1b\\") == "\x1b_Ga=T;AAAA\x1b\\"
    assert "▀▀b" in shown.news(painted([(0, 0, [("▀▀b", "1")])]))
