"""Reports of results: a page for people, tables for papers and programs, test cases for continuous integration."""

from collections.abc import Callable
from pathlib import Path

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.plugins.drawing.episodes import Material, gather

FORMATS = ("html", "csv", "tex", "md", "xml")
"""By the ending of a file: the page, CSV, a LaTeX table, Markdown, JUnit XML."""

__all__ = ["FORMATS", "Material", "format_of", "gather", "render", "write"]


def format_of(path: Path) -> str:
    """Return the format that a file's name asks for; raises BenchbotError when that is none."""
    ending = path.suffix.lower().removeprefix(".")
    if ending == "htm":
        return "html"
    if ending in FORMATS:
        return ending
    raise BenchbotError(
        f"It is not known what to write into {path}.",
        f"Its name ends in none of: {', '.join('.' + name for name in FORMATS)}."
        f"{did_you_mean(ending, list(FORMATS)) if ending else ''}",
        "Name it like that, or say the format with --format.",
    )


def render(material: Material, name: str) -> str:
    """Return the report in one of FORMATS: the same text for the same material."""
    from benchbot.plugins.report import junit, page, tables

    formats: dict[str, Callable[[Material], str]] = {
        "html": page.html,
        "csv": tables.to_csv,
        "tex": tables.to_latex,
        "md": tables.to_markdown,
        "xml": junit.to_junit,
    }
    # JSON can hold half of a surrogate pair, which no text file can.
    return formats[name](material).encode("utf-8", "replace").decode("utf-8")


def write(path: Path, text: str) -> None:
    """Write a report atomically, UTF-8; raises BenchbotError when it cannot be written, `path` is then as it was."""
    atomic.write_text(path, text)
