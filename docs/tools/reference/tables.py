"""Tables and text as Markdown."""

from collections.abc import Iterable, Sequence

GENERATED = "<!-- Made from the code by `make reference`: change it there. -->\n\n"


def table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; cells are Markdown already."""
    lines = [heading, ["---"] * len(heading), *rows]
    return "".join(f"| {' | '.join(map(_cell, row))} |\n" for row in lines)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def plain(text: str) -> str:
    """Return text that Markdown shows as it is."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace("*", "\\*").replace("_", "\\_")


def code(text: str) -> str:
    """Return text as code."""
    return f"`{text}`" if text else ""


def paragraph(text: str) -> str:
    """Return a docstring's lines as one paragraph or several, code in it as it is."""
    return "\n\n".join(" ".join(part.split()) for part in text.strip().split("\n\n"))
