"""Sets side by side, as a page."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.evaluation.score import score_files
from benchbot.plugins.report import comparison, result_sets, side_by_side
from benchbot.plugins.report.episodes import ReportData, gather
from benchbot.plugins.report.result_sets import ResultSet
from tests.made_results import Make, Save
from tests.plugins.report.conftest import TRACK, provenance
from tests.plugins.report.pages import Page

Sides = Callable[[], tuple[list[ReportData], dict[str, Any]]]


@pytest.fixture
def sides(catalog: Catalog, make_result: Make, save: Save) -> Sides:
    """`new`, which finds all chairs of two flats, and `old`, whose boxes are off and which misses one chair."""

    def make() -> tuple[list[ReportData], dict[str, Any]]:
        sets: dict[str, list[tuple[int, tuple[float, ...]]]] = {
            "new": [(1, (0.0, 3.0)), (2, (0.0,))],
            "old": [(1, (0.2,)), (2, (0.2,))],
        }
        paths: dict[str, list[Path]] = {}
        for name, results in sets.items():
            for variant, places in results:
                document = make_result(*places, variant=variant, provenance=provenance(0), track=[TRACK])
                paths.setdefault(name, []).append(save(f"{name}_{variant}.json", document))
        scored = {name: score_files(files, catalog=catalog) for name, files in paths.items()}
        named = [ResultSet(name, evaluation.document) for name, evaluation in scored.items()]
        document = comparison.compare(named, result_sets.evaluator_of(named, catalog))
        return [gather(scored[name], paths[name], catalog=catalog, name=name) for name in scored], document

    return make


def test_the_page_ranks_plots_and_tells_objects_won(sides: Sides) -> None:
    source = side_by_side.html(*sides())
    page = Page(source)

    ranked = [" ".join(row.text.split()) for row in page.all("tr")][1:3]
    assert ranked[0].startswith("1. new")
    assert ranked[1].startswith("2. old")
    assert "1 object found by new only · 0 by old only" in page.text
    assert [item.text.split()[:3] for item in page.all("li", class_="weak")] == [["chair", "no", "picture"]]
    assert re.search(r"flat:1\s+\+0\.\d{3}\s+1", page.text)
    heat = [cell.text for cell in page.all("text") if cell.attributes.get("class") in ("on-dark", "on-light")]
    assert len(heat) == 4
    assert heat[0] == heat[2] == "1.000"
    assert "missed" in page.text
    assert side_by_side.html(*sides()) == source
    assert not page.all("script")


def test_maps_of_one_episode_show_the_same_part_of_the_floor(sides: Sides) -> None:
    (new, old), document = sides()
    meetings = side_by_side.meetings(new, old, document["score"])

    assert [meeting.label for meeting in meetings] == ["flat:1, seed 0", "flat:2, seed 0"]  # most apart first
    for meeting in meetings:
        first, second = (drawing for drawing in meeting.drawings if drawing is not None)
        assert first.layout.transform == second.layout.transform
