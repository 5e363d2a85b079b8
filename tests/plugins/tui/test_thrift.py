"""What is sent to a terminal is shorter, and shows the same."""

import io
import re

from hypothesis import given
from hypothesis import strategies as st
from rich.color import Color
from rich.console import Console
from rich.segment import Segment, Segments
from rich.style import Style

from benchbot.plugins.tui.thrift import thrifty

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
