"""The documentation's site builds without a broken link, every page is in its navigation, and nothing is fetched."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from docs.tools import html_check, links, notebook
from docs.tools.site import build
from docs.tools.stage import BrokenLinksError, stage
from tests.docs.blocks import ROOT


def test_it_builds_without_broken_links(tmp_path: Path) -> None:
    assert build(tmp_path) == []
    assert (tmp_path / "site" / "tutorials" / "first-agent.html").is_file()


def pages_of(navigation: Any) -> Iterator[str]:
    """Yield the pages of a navigation, which is nested as it likes."""
    if isinstance(navigation, str):
        yield navigation
    else:
        for item in navigation.values() if isinstance(navigation, dict) else navigation:
            yield from pages_of(item)


def test_every_page_is_in_the_navigation_once(tmp_path: Path) -> None:
    stage(ROOT, tmp_path)
    shown = list(pages_of(tomllib.loads((ROOT / "docs" / "zensical.toml").read_text("utf-8"))["project"]["nav"]))
    there = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.md")}

    assert sorted(shown) == sorted(name for name in there if not name.startswith("source/"))


def test_a_link_to_nothing_is_found(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "code.py"):
        (tmp_path / name).write_text("# Words\n")
    (tmp_path / "docs" / "index.md").write_text("[code](../code.py) [gone](gone.md) ![gone](gone.png)\n")

    with pytest.raises(BrokenLinksError, match=r"docs/index\.md: gone\.md\ndocs/index\.md: gone\.png"):
        stage(tmp_path, tmp_path / "pages")
    assert "source/code.py.md" in (tmp_path / "pages" / "index.md").read_text()


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ('<a href="gone.html">x</a>', "leads nowhere: gone.html"),
        ('<a href="#gone">x</a>', "leads to no such heading: #gone"),
        ('<a href="two.html#gone">x</a>', "leads to no such heading: two.html#gone"),
        ('<script src="https://example.org/x.js"></script>', "loads from another host: https://example.org/x.js"),
        ("<p>So:\n- one\n- two</p>", "Markdown that was not understood: So:\n- one\n- two"),
    ],
)
def test_what_is_wrong_with_a_page_is_told(tmp_path: Path, body: str, problem: str) -> None:
    (tmp_path / "two.html").write_text('<h1 id="there">Two</h1>')
    (tmp_path / "one.html").write_text(f'<a href="two.html#there">fine</a><pre>- fine\n- fine</pre>{body}')

    assert html_check.problems(tmp_path) == [f"one.html: {problem}"]


def test_links_in_code_are_left_alone() -> None:
    page = "[a](b.md)\n```text\n[c](d.md)\n```\n[e](https://f) [g](#h) ![i](j.png)\n"

    assert list(links.targets(page)) == ["b.md", "j.png"]
    assert links.rewritten(page, str.upper) == page.replace("b.md", "B.MD").replace("j.png", "J.PNG")


def test_a_notebook_becomes_a_page() -> None:
    page = notebook.as_markdown(ROOT / "docs" / "tutorial.ipynb")

    assert page.startswith("# From nothing to a score\n")
    assert "```bash\nbenchbot list tasks\n" in page
    assert "```python\nimport subprocess\n" in page
