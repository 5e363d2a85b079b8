"""What the terminal answers about pictures: asked once, before the screens begin, and never for longer than a moment.

Every terminal answers the last question (primary device attributes), so that the time-out is for those that are broken.
https://sw.kovidgoyal.net/kitty/graphics-protocol/#querying-support-and-available-transmission-mediums
https://vt100.net/docs/vt510-rm/DA1.html
"""

import os
import re
import select
import sys
import termios
import time
import tty

TIMEOUT_S = 0.5
_ID = 31
_QUESTIONS = f"\x1b_Gi={_ID},s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\\x1b[c".encode()
_CURSOR = re.compile(rb"\x1b\[\d+;(\d+)R")
_KITTY = re.compile(rb"\x1b_Gi=%d;OK\x1b\\" % _ID)
_ATTRIBUTES = re.compile(rb"\x1b\[\?([\d;]*)c")
_SIXEL = b"4"


def kind_of_images(timeout_s: float = TIMEOUT_S) -> str:
    """Return `kitty` or `sixel` where the terminal says that it shows them, else `halfcell`."""
    if not (sys.__stdin__ and sys.__stdout__ and sys.__stdin__.isatty() and sys.__stdout__.isatty()):
        return "halfcell"
    return named(_asked(sys.__stdin__.fileno(), sys.__stdout__.fileno(), timeout_s))


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


def _asked(source: int, target: int, timeout_s: float, questions: bytes = _QUESTIONS) -> bytes:
    answer = b""
    before = termios.tcgetattr(source)
    try:
        tty.setcbreak(source, termios.TCSADRAIN)
        os.write(target, questions)
        end_s = time.monotonic() + timeout_s
        while not _ATTRIBUTES.search(answer):
            ready, _, _ = select.select([source], [], [], max(0.0, end_s - time.monotonic()))
            if not ready:
                break
            answer += os.read(source, 1024)
    except (OSError, termios.error):
        pass
    finally:
        termios.tcsetattr(source, termios.TCSADRAIN, before)
    return answer
