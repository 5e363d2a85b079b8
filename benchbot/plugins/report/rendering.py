"""Rendering a report in the format that a file's name asks for."""

from collections.abc import Callable
from pathlib import Path

from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.text import visible
from benchbot.plugins.report.episodes import ReportData

FORMATS = ("html", "csv", "tex", "md", "xml")
"""By the ending of a file: the page, CSV, a LaTeX table, Markdown, JUnit XML."""


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


def render(data: ReportData, name: str) -> str:
    """Return the report in one of FORMATS: the same text for the same data."""
    from benchbot.plugins.report import exports, page

    formats: dict[str, Callable[[ReportData], str]] = {
        "html": page.html,
        "csv": exports.to_csv,
        "tex": exports.to_latex,
        "md": exports.to_markdown,
        "xml": exports.to_junit,
    }
    # Also in a page nothing may be unseen, or turn a number round; and no file can hold half of a surrogate pair.
    return visible(formats[name](data))
