"""Pictures are shown in pixels where a terminal answers that it can, and nowhere else."""

import os
import pty
import select
import sys
import termios
import threading

import pytest

from benchbot.plugins.tui import terminal_answers

KITTY = b"\x1b_Gi=31;OK\x1b\\"


@pytest.mark.parametrize(
    ("answer", "kind"),
    [
        (KITTY + b"\x1b[?62;c", "kitty"),
        (b"\x1b_Gi=31;ENOTSUPPORTED:no\x1b\\\x1b[?62;4;22c", "sixel"),
        (b"\x1b[?62;22;14c", "halfcell"),
        (b"\x1b[?4c", "halfcell"),  # the first number is the terminal's own
        (b"q\x1b[?64;1;4;6c", "sixel"),  # a key was pressed meanwhile
        (b"", "halfcell"),
    ],
)
def test_a_terminal_is_asked_and_its_answer_decides(answer: bytes, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    outside, inside = pty.openpty()
    with os.fdopen(inside, "r+b", buffering=0) as terminal:
        monkeypatch.setattr(sys, "__stdin__", terminal)
        monkeypatch.setattr(sys, "__stdout__", terminal)
        before = termios.tcgetattr(inside)
        asked = bytearray()

        def reply() -> None:
            while not asked.endswith(b"\x1b[c") and select.select([outside], [], [], 5)[0]:
                asked.extend(os.read(outside, 1024))
            os.write(outside, answer)

        thread = threading.Thread(target=reply)
        thread.start()
        assert terminal_answers.kind_of_images(timeout_s=5.0 if answer else 0.2) == kind
        thread.join()
        assert b"a=q" in asked
        assert termios.tcgetattr(inside) == before
    os.close(outside)


def test_what_is_no_terminal_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    with open(os.devnull, "r+b") as nothing:  # noqa: PTH123
        monkeypatch.setattr(sys, "__stdin__", nothing)
        monkeypatch.setattr(sys, "__stdout__", nothing)
        assert terminal_answers.kind_of_images() == "halfcell"
