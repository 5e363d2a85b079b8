import os
import pty
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.cli.kit.solution_output import ERASE, MarkedOutput, cells

COLUMNS = 40
CHUNKS = st.lists(st.binary() | st.text(st.sampled_from("\x1b[2J\r\n\t\x07 é世x")).map(str.encode), max_size=8)


@pytest.fixture(scope="module")
def terminal() -> Iterator[int]:
    """Yield the handle of a terminal of 40 columns."""
    import termios

    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, COLUMNS))
    yield theirs
    os.close(theirs)
    os.close(ours)


def test_each_line_says_that_it_is_the_solution_s() -> None:
    output = MarkedOutput(None, rewrites=False)

    assert output.shown(b"Result: 1.0\n\nWhich w") == "solution | Result: 1.0\nsolution |\nsolution | Which w"
    assert not output.at_line_start
    assert output.shown(b"ay? ") == "ay? "
    assert output.line_end() == "\n"
    assert output.shown(b"left\r\n") == "solution | left\n"


def test_a_progress_bar_is_rewritten_where_a_terminal_can_and_lines_elsewhere() -> None:
    bar = b"\r 10 %\r 20 %\r\n\r\rdone\n"

    assert MarkedOutput(None, rewrites=True).shown(bar) == f"solution |  10 %{ERASE}solution |  20 %\nsolution | done\n"
    assert MarkedOutput(None, rewrites=False).shown(bar) == "solution |  10 %\nsolution |  20 %\nsolution | done\n"


def test_characters_may_come_in_parts() -> None:
    output = MarkedOutput(None, rewrites=False)

    assert "".join(output.shown(bytes([byte])) for byte in "Grüße 世\n".encode()) == "solution | Grüße 世\n"


def test_no_line_begins_where_a_terminal_breaks_a_long_one(terminal: int) -> None:
    """Padded to the terminal's width, what follows would stand at the beginning of a line."""
    padded = f"{'':<{COLUMNS - len('solution | ') - 1}}Result: 1.0\n".encode()

    shown = MarkedOutput(terminal, rewrites=True).shown(padded)

    assert shown.splitlines()[1] == "solution | Result: 1.0"


@given(CHUNKS)
def test_every_line_is_marked_and_fits(terminal: int, chunks: list[bytes]) -> None:
    for rewrites in (True, False):
        output = MarkedOutput(terminal, rewrites=rewrites)
        shown = "".join(map(output.shown, chunks)) + output.line_end()

        assert output.at_line_start
        for line in shown.split("\n")[:-1]:
            for state in line.split(ERASE) if rewrites else [line]:
                assert state.startswith("solution |")
                assert cells(state) < COLUMNS
                assert state.isprintable() or "\x1b" not in state
