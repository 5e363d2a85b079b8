"""Screens as they must look: an app's SVG screenshot, compared with the one that is kept in `snapshots`.

`BENCHBOT_REWRITE_SNAPSHOTS=1` writes them anew: look at each before it is committed.
"""

import html
import os
import re
from pathlib import Path
from typing import Any

from textual.app import App

SNAPSHOTS = Path(__file__).parent / "snapshots"
REWRITE = "BENCHBOT_REWRITE_SNAPSHOTS"

_FONTS = re.compile(r"@font-face \{.*?\}\s*", re.DOTALL)
_IDS = re.compile(r"terminal-\d+")
_TEXT = re.compile(r'<text class="terminal-r[^>]*? x="([\d.]+)" y="([\d.]+)"[^>]*>(.*?)</text>', re.DOTALL)
_CELL_WIDTH = 12.2


def matches(app: App[Any], name: str) -> None:
    """Compare what an app shows with `snapshots/NAME-WIDTHxHEIGHT.svg`; say line by line what differs."""
    path = SNAPSHOTS / f"{name}-{app.size.width}x{app.size.height}.svg"
    shown = picture(app)
    if os.environ.get(REWRITE):
        path.parent.mkdir(exist_ok=True)
        path.write_text(shown, "utf-8")
        return
    assert path.is_file(), f"There is no {path.name} yet: run with {REWRITE}=1, and look at it."
    kept = path.read_text("utf-8")
    assert lines(shown) == lines(kept), f"{path.name}: if it is better so, run with {REWRITE}=1."
    assert shown == kept, f"{path.name} says the same in other colours or places: look, then run with {REWRITE}=1."


def picture(app: App[Any]) -> str:
    """Return the app's screen as SVG, without what is of this process alone, and with no font from the network."""
    drawn = app.export_screenshot(simplify=True)
    return _IDS.sub("terminal", _FONTS.sub("", drawn))


def lines(svg: str) -> list[str]:
    """Return the text of a picture, a string per row."""
    rows: dict[float, str] = {}
    for x, y, text in _TEXT.findall(svg):
        before = rows.get(float(y), "").ljust(round(float(x) / _CELL_WIDTH))
        rows[float(y)] = before + html.unescape(text).replace("\xa0", " ")
    return [text.rstrip() for _, text in sorted(rows.items())]
