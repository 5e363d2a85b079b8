"""The tutorials work as they stand: a reader with an empty folder types what they say."""

from pathlib import Path

import pytest

from tests.docs.blocks import ROOT, blocks
from tests.docs.walkthrough import reader

RUNNER = "tests/docs/test_tutorials.py"
PAGES = [path for path in sorted(ROOT.glob("docs/**/*.md")) if f"<!-- run by {RUNNER} -->" in path.read_text("utf-8")]


@pytest.mark.slow
@pytest.mark.xdist_group("main job")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_works_as_it_stands(page: Path, tmp_path: Path, kernel_cache: Path) -> None:
    reader(tmp_path, kernel_cache).walk(page.read_text("utf-8"), RUNNER)


def test_there_are_tutorials() -> None:
    assert {page.parent.name for page in PAGES} >= {"tutorials"}
    assert all(any(block.run_by for block in blocks(page.read_text("utf-8"))) for page in PAGES)


def test_the_simulator_that_the_tutorial_writes_and_runs_has_at_most_150_lines_of_python() -> None:
    page = ROOT / "docs/tutorials/simulator.md"
    assert page in PAGES
    lines = [block.text.splitlines() for block in blocks(page.read_text("utf-8")) if block.language == "python"]
    assert len(lines) == 2, "its simulator.py and its plugin.py"
    assert 0 < sum(map(len, lines)) <= 150
