"""The reference is what the code says: its pages are made from it, and those written by hand are compared with it."""

import re
from pathlib import Path

import pytest
from starlette.routing import Route

from benchbot.cli.app import EVERYDAY
from benchbot.core import entry_points
from benchbot.supervisor.http.app import create_app
from benchbot.supervisor.run import Run
from docs.tools.reference.__main__ import FOLDER, PAGES
from docs.tools.reference.meanings import MEANINGS
from docs.tools.reference.schemas import DECLARATIONS
from tests.docs.blocks import ROOT
from tests.supervisor.harness import sample_selection


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_what_the_code_says(name: str) -> None:
    assert (FOLDER / name).read_text("utf-8") == PAGES[name](), "make reference writes it anew"


def test_every_command_is_in_the_overview() -> None:
    page = (ROOT / "docs" / "cli.md").read_text("utf-8")
    assert [
        one.name for one in (*EVERYDAY, *entry_points.shipped("commands")) if f"`benchbot {one.name}`" not in page
    ] == []


@pytest.mark.parametrize("kind", DECLARATIONS)
def test_every_key_of_a_declaration_has_a_meaning(kind: str) -> None:
    page = (FOLDER / "declarations.md").read_text("utf-8")
    section = page.partition(f"\n## {kind}\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([^`]+)`.* \| (.*) \|$", section, re.MULTILINE)

    assert [key for key, meaning in rows if not meaning.strip()] == [], "say it in docs/tools/reference/meanings.py"
    assert set(MEANINGS.get(kind, {})) <= {key for key, _ in rows}


def test_every_environment_variable_is_on_its_page_and_no_other() -> None:
    sources = [*ROOT.glob("benchbot*/**/*.py"), *ROOT.glob("plugins/*/src/**/*.py")]
    used = {name for path in sources for name in re.findall(r"\bBENCHBOT_[A-Z_]+\b", path.read_text("utf-8"))}
    used.discard("BENCHBOT_API")  # a constant of plug-in modules
    page = (FOLDER / "environment-variables.md").read_text("utf-8")

    assert set(re.findall(r"\bBENCHBOT_[A-Z_]+\b", page)) == used


@pytest.fixture
def routes(tmp_path: Path) -> list[Route]:
    def never() -> None:
        raise AssertionError("no platform is needed to know the routes")

    run = Run(sample_selection(), never, tmp_path / "result.json")  # type: ignore[arg-type]
    return [route for route in create_app(run, "token", "operator").routes if isinstance(route, Route)]


def test_every_route_is_in_the_wire_and_no_other(routes: list[Route]) -> None:
    page = (ROOT / "docs" / "wire.md").read_text("utf-8")
    v2 = page.partition("\n## v2's routes\n")[2]
    told = re.findall(r"`(?:GET|POST) (/[^` ]*)`", page) + re.findall(r"^\| `(/[^`]*)`", v2, re.MULTILINE)
    paths = {re.sub(r"<[^>]*>(…)?|\{[^}]*\}", "x", path) for path in told}

    unknown = [path for path in paths if not any(route.path_regex.match(path) for route in routes)]
    untold = [route.path for route in routes if not any(route.path_regex.match(path) for path in paths)]
    # With and without a slash at the end is the same.
    assert (unknown, [path for path in untold if f"{path}/" not in paths]) == ([], [])
