from pathlib import Path

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.tui import result_rows
from tests.plugins.tui.written import write_results


def test_results_are_listed_scored_explained_and_reported(catalog: Catalog, home: Path) -> None:
    folder = write_results(home / "work" / "results")

    rows = {Path(row.source).name: row for row in result_rows.rows([folder])}

    assert rows["perfect.json"].about == "arena:1"
    assert rows["perfect.json"].task == "sample:passive"
    assert rows["perfect.json"].score == ""
    assert rows["nonsense.json"].problem

    table, path = result_rows.evaluate([folder / "perfect.json"], catalog)
    assert "1.0000" in table
    assert path == folder / "perfect.scores.json"
    assert result_rows.headline_of(path) == "OMQ 1.0000"
    result_rows.evaluate([folder / "one" / "result.json"], catalog)
    rows = {str(Path(row.source).relative_to(folder)): row for row in result_rows.rows([folder])}
    assert rows["perfect.json"].score == "OMQ 1.0000"
    assert rows["one/result.json"].score == "OMQ 0.0000"
    assert "perfect.scores.json" not in rows
    assert [row.score for row in result_rows.rows([folder / "one" / "result.json"])] == ["OMQ 0.0000"]

    why = result_rows.explain(folder / "perfect.json", catalog)
    assert "match" in why
    assert "bottle" in why
    report = result_rows.report([folder / "perfect.json"], catalog)
    assert report == folder / "perfect-report.html"
    assert "<html" in report.read_text()

    with pytest.raises(BenchbotError):
        result_rows.explain(folder / "nonsense.json", catalog)
    assert result_rows.headline_of(folder / "nonsense.json") == ""


def test_an_archive_is_a_file_of_many_results(home: Path) -> None:
    row = result_rows.ResultRow(f"{home}/all.zip:one/result.json")
    assert row.path == home / "all.zip"
