"""Tables of measured figures name the script that measures them, and it is there."""

import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.docs.blocks import ROOT, pages

_TABLE = re.compile(r"(?:^<!-- figures: (?P<mark>.+?) -->\n\n?)?(?P<table>(?:^\|.*\n)+)", re.MULTILINE)
_FIGURE = re.compile(r"[-+−]?\d[\d.,k ]*(?:%|s|ms|m|MB|GB)?(?:(?: ?(?:–|-|/|·|to|,) ?)[-+]?\d[\d.]* ?%?)*\*{0,2}")


def tables(page: str) -> Iterator[tuple[str, str]]:
    """Yield the tables that consist of figures for the most part, each with what its mark says."""
    for match in _TABLE.finditer(page):
        rows = [line.strip("|\n ").split("|")[1:] for line in match["table"].splitlines()[2:]]
        cells = [cell.strip() for row in rows for cell in row if cell.strip()]
        if match["mark"] or (cells and sum(bool(_FIGURE.fullmatch(cell)) for cell in cells) > len(cells) / 2):
            yield match["table"], match["mark"] or ""


MEASURED = [
    pytest.param(page, table, mark, id=f"{page.relative_to(ROOT)}: {table.splitlines()[0].strip('| ')}")
    for page in pages()
    for table, mark in tables(page.read_text("utf-8"))
]


@pytest.mark.parametrize(("page", "table", "mark"), MEASURED)
def test_figures_name_the_script_that_makes_them(page: Path, table: str, mark: str) -> None:
    assert mark, f"write <!-- figures: python -m … --> above it:\n{table}"
    if not mark.startswith("not made again: "):
        found = re.fullmatch(r"python -m (?P<module>[\w.]+)(?: (?P<name>\w+))?(?: --.*)?", mark)
        assert found, mark
        module = f"benchmarks.bench_{found['name']}" if found["module"] == "benchmarks" else found["module"]
        assert importlib.util.find_spec(module), f"{page.relative_to(ROOT)}: there is no {module}"


def test_every_picture_says_how_it_is_made() -> None:
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    made = re.findall(r"^\| `([^`]+\.(?:jpg|png|svg))`.* \|$", page, re.MULTILINE)

    assert [path.name for path in images() if not any(path.match(pattern) for pattern in made)] == []
    for module in re.findall(r"`python -m (benchmarks\.\w+|benchbot\w+[\w.]*)", page):
        assert importlib.util.find_spec(module), module


def test_every_picture_is_on_a_page() -> None:
    shown = {name for page in pages() for name in re.findall(r"images/([\w./-]+)\)", page.read_text("utf-8"))}

    assert shown == {path.relative_to(ROOT / "docs" / "images").as_posix() for path in images()}


def images() -> list[Path]:
    return [path for path in (ROOT / "docs" / "images").rglob("*") if path.is_file()]


def test_there_are_such_tables() -> None:
    assert len(MEASURED) > 10
