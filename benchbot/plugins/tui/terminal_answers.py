"""What the terminal answers about pictures: asked once, before the screens begin, and never for longer than a moment.

Within tmux that allows it, the terminal around tmux is asked, too: what is for that one passes through in an envelope.

Every terminal answers the last question (primary device attributes), so that the time-out is for those that are broken.
https://sw.kovidgoyal.net/kitty/graphics-protocol/#querying-support-and-available-transmission-mediums
https://vt100.net/docs/vt510-rm/DA1.html
https://github.com/tmux/tmux/wiki/FAQ#what-is-the-passthrough-escape-sequence-and-how-do-i-use-it
"""

import functools
import os
import re
import select
import subprocess
import sys
import termios
import time
import tty
from collections.abc import Iterable

from benchbot.plugins.tui import preferences

TIMEOUT_S = 0.5
_ID = 31
_SHOWS_KITTY = f"\x1b_Gi={_ID},s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\"
_QUESTIONS = f"{_SHOWS_KITTY}\x1b[c".encode()
ENVELOPE = ("\x1bPtmux;", "\x1b\\")
"""Between these stands what tmux passes through, with every ESC in it doubled."""
_CURSOR = re.compile(rb"\x1b\[\d+;(\d+)R")
_KITTY = re.compile(rb"\x1b_Gi=%d;OK\x1b\\" % _ID)
_ATTRIBUTES = re.compile(rb"\x1b\[\?([\d;]*)c")
_SIXEL = b"4"
_LATE = re.compile(r"\x1b_G[^\x1b]*\x1b\\|\x1b\[\?[\d;]*c|\x1b\[6;\d+;\d+t")
"""Answers about kitty's pictures, of the attributes, and of the size of cells. Textual knows that of the cursor."""
_BEGUN = re.compile(r"(\x1b_G[^\x1b]{0,100}\x1b?|\x1b\[\?[\d;]{0,100}|\x1b\[6(;\d{0,5}){0,2})\Z")
"""Such an answer, of which the rest has not come yet. None is longer."""


def way_of_images(asked_for: str | None = None) -> str:
    """Return how pictures are drawn: as asked for, else as the user has set it, else as the terminal answers.

    What the way needs to know of the terminal is asked, too: nothing else may read from it meanwhile.
    """
    way = asked_for or preferences.read().get("images", "auto")
    if way == "auto":
        # A page in a browser draws characters only.
        way = "halfcell" if "TEXTUAL_DRIVER" in os.environ or "NO_COLOR" in os.environ else kind_of_images()
    if way in ("sextant", "octant"):
        from benchbot.plugins.tui import mosaics

        # Terminals that take such a character for a wide one would shift all that stands to its right.
        way = way if draws_in_one_cell(mosaics.characters(mosaics.GRIDS[way])[4]) else "halfcell"
    if way in ("kitty", "sixel"):
        prepare(way)
    return way


def kind_of_images(timeout_s: float = TIMEOUT_S) -> str:
    """Return `kitty` or `sixel` where the terminal says that it shows them, else `halfcell`."""
    if not (sys.__stdin__ and sys.__stdout__ and sys.__stdin__.isatty() and sys.__stdout__.isatty()):
        return "halfcell"
    source, target = sys.__stdin__.fileno(), sys.__stdout__.fileno()
    kind = named(_asked(source, target, timeout_s))
    if kind == "halfcell" and passes_through():
        question = _SHOWS_KITTY.replace("\x1b", "\x1b\x1b").join(ENVELOPE).encode()
        # The last question would be answered by tmux itself, long before the terminal around it.
        kind = named(_asked(source, target, timeout_s, question, _KITTY))
    return kind


def prepare(kind: str) -> None:
    """Query the size of the terminal's cells, before an app begins to read from it; within tmux, reach the one around.

    Kitty's pictures stand where tmux shows characters that name them, so that only their pixels pass through it.
    """
    from textual_image._terminal import get_cell_size

    get_cell_size()
    if kind == "kitty" and passes_through():
        from textual_image.renderable import tgp

        begin, end = ENVELOPE
        vars(tgp)["_TGP_MESSAGE_START"] = f"{begin}\x1b\x1b_G"
        vars(tgp)["_TGP_MESSAGE_END"] = f"\x1b\x1b\\{end}"


def passes_through() -> bool:
    """Say whether this is within a tmux that passes on what is for the terminal around it, as tmux itself says."""
    if "TMUX" not in os.environ:
        return False
    words = ["tmux", "show-options", "-A", "-p", "-v", "allow-passthrough"]
    try:
        said = subprocess.run(words, capture_output=True, text=True, timeout=5, check=False).stdout.strip()
    except (OSError, subprocess.TimeoutExpired):
        return False
    return said in ("on", "all")


def draws_in_one_cell(character: str, timeout_s: float = TIMEOUT_S) -> bool:
    """Say whether the terminal answers that its cursor is one cell further after a character; it is erased again."""
    if not (sys.__stdin__ and sys.__stdout__ and sys.__stdin__.isatty() and sys.__stdout__.isatty()):
        return False
    question = f"\r{character}\x1b[6n\r\x1b[K\x1b[c".encode()
    found = _CURSOR.search(_asked(sys.__stdin__.fileno(), sys.__stdout__.fileno(), timeout_s, question))
    return found is not None and found[1] == b"2"


def named(answer: bytes) -> str:
    """Return the kind of pictures that an answer tells of."""
    if _KITTY.search(answer):
        return "kitty"
    attributes = _ATTRIBUTES.search(answer)
    return "sixel" if attributes is not None and _SIXEL in attributes[1].split(b";")[1:] else "halfcell"


def _asked(
    source: int,
    target: int,
    timeout_s: float,
    questions: bytes = _QUESTIONS,
    last: "re.Pattern[bytes]" = _ATTRIBUTES,
) -> bytes:
    answer = b""
    before = termios.tcgetattr(source)
    try:
        tty.setcbreak(source, termios.TCSADRAIN)
        os.write(target, questions)
        end_s = time.monotonic() + timeout_s
        while not last.search(answer):
            ready, _, _ = select.select([source], [], [], max(0.0, end_s - time.monotonic()))
            if not ready:
                _leave_out_late_answers()
                break
            answer += os.read(source, 1024)
    except (OSError, termios.error):
        pass
    finally:
        termios.tcsetattr(source, termios.TCSADRAIN, before)
    return answer


@functools.cache
def _leave_out_late_answers() -> None:
    """Keep answers that come after the time-out from being taken for keys."""
    from textual._xterm_parser import XTermParser
    from textual.drivers import linux_driver
    from textual.message import Message

    class Typed(XTermParser):
        _begun = ""

        def feed(self, data: str) -> Iterable[Message]:
            typed = _LATE.sub("", self._begun + data)
            begun = _BEGUN.search(typed)
            self._begun = "" if begun is None else begun[0]
            typed = typed.removesuffix(self._begun)
            # Nothing at all would mean that no more can be typed.
            return super().feed(typed) if typed or not data else ()

    vars(linux_driver)["XTermParser"] = Typed
