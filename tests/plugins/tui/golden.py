"""Screens as they must look: the cells of an app's screen with their styles, compared with those kept in `snapshots`.

`snapshots/NAME.json.xz` holds a screen at several sizes and looks (`dark`, `light`, `no-color`). With
`BENCHBOT_REWRITE_SNAPSHOTS=1` tests write them anew; `python -m tests.plugins.tui.golden FOLDER [NAME…]` draws them as
SVG: look at each before it is committed.
"""

import io
import json
import lzma
import os
import sys
import tempfile
from difflib import unified_diff
from itertools import groupby
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.segment import Segment, Segments
from rich.style import Style
from textual._compositor import LayoutUpdate
from textual.app import App

SNAPSHOTS = Path(__file__).parent / "snapshots"
REWRITE = "BENCHBOT_REWRITE_SNAPSHOTS"
TEXT = [{"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "lc": 0, "pb": 0}]
"""What stores these screens in the fewest bytes."""

Cells = list[list[tuple[str, str]]]
"""The lines of a screen: texts, each with its style in the words of Rich."""


def matches(app: App[Any], name: str) -> None:
    """Compare what an app shows with what is kept; say line by line what differs, and draw both."""
    variant = f"{app.size.width}x{app.size.height} {look(app)}"
    shown = cells(app)
    path = SNAPSHOTS / f"{name}.json.xz"
    kept = read(path)
    if os.environ.get(REWRITE):
        _write(path, {**kept, variant: shown})
        return
    assert variant in kept, f"{path.name} has no {variant} yet: run with {REWRITE}=1, and look at it."
    if shown != kept[variant]:
        folder = Path(tempfile.mkdtemp(prefix="benchbot-screens-"))
        for what, each in (("shown", shown), ("kept", kept[variant])):
            (folder / f"{name}-{variant.replace(' ', '-')}-{what}.svg").write_text(svg(each), "utf-8")
        words = "\n".join(unified_diff(lines(kept[variant]), lines(shown), "kept", "shown", lineterm=""))
        raise AssertionError(
            f"{name} at {variant}: look at {folder}; if it is better so, run with {REWRITE}=1.\n"
            f"{words or 'The same words in other colours.'}"
        )


def look(app: App[Any]) -> str:
    """Return `dark`, `light` or `no-color`."""
    return "no-color" if app.no_color else "dark" if app.current_theme.dark else "light"


def cells(app: App[Any]) -> Cells:
    """Return what an app shows."""
    update = app.screen._compositor.render_update(full=True, screen_stack=app._background_screens)
    assert isinstance(update, LayoutUpdate)
    found: Cells = []
    for line in update.strips:
        segments = [segment for strip in line for segment in strip]
        texts = [(segment.text, segment.style) for segment in segments if segment.text and not segment.control]
        groups = groupby(texts, key=lambda each: each[1])
        found.append([("".join(text for text, _ in group), _words(style)) for style, group in groups])
    return found


def lines(shown: Cells) -> list[str]:
    """Return the text of a screen, a string per row."""
    return ["".join(text for text, _ in row).rstrip() for row in shown]


def svg(shown: Cells) -> str:
    """Return a picture of a screen."""
    width = max(sum(len(text) for text, _ in row) for row in shown)
    console = Console(
        width=width,
        file=io.StringIO(),
        force_terminal=True,
        color_system="truecolor",
        record=True,
        legacy_windows=False,
    )
    for row in shown:
        console.print(Segments([*(Segment(text, Style.parse(style)) for text, style in row), Segment.line()]), end="")
    return console.export_svg(title="BenchBot")


def read(path: Path) -> dict[str, Cells]:
    """Return a kept screen by size and look; nothing where there is none yet."""
    if not path.is_file():
        return {}
    document = json.loads(lzma.decompress(path.read_bytes()))
    styles = document["styles"]
    return {
        variant: [[(text, styles[number]) for text, number in row] for row in rows]
        for variant, rows in document["screens"].items()
    }


def _write(path: Path, screens: dict[str, Cells]) -> None:
    styles = sorted({style for rows in screens.values() for row in rows for _, style in row})
    numbers = {style: number for number, style in enumerate(styles)}
    numbered = {
        variant: [[(text, numbers[style]) for text, style in row] for row in rows]
        for variant, rows in sorted(screens.items())
    }
    document = json.dumps({"styles": styles, "screens": numbered}, ensure_ascii=False, separators=(",", ":"))
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(lzma.compress(document.encode(), check=lzma.CHECK_CRC32, filters=TEXT))


def _words(style: Style | None) -> str:
    return "none" if style is None else str(style)


def main() -> None:
    """Draw the kept screens."""
    folder, *names = sys.argv[1:]
    for path in sorted(SNAPSHOTS.glob("*.json.xz")):
        name = path.name.removesuffix(".json.xz")
        for variant, shown in read(path).items() if not names or name in names else ():
            Path(folder, f"{name}-{variant.replace(' ', '-')}.svg").write_text(svg(shown), "utf-8")


if __name__ == "__main__":
    main()
