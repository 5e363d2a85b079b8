from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.results import read_scores, write_scores

DOCUMENT = {
    "version": 1,
    "method": {"name": "omq", "version": "1.0", "headline": "OMQ"},
    "task_details": {"name": "semantic_slam:passive:ground_truth"},
    "environment_details": [],
    "scores": {"OMQ": 0.5},
    "rows": [],
    "coverage": {"expected": 0, "scored": 0, "missing": [], "skipped": []},
}


def test_scores_are_read_as_written(tmp_path: Path) -> None:
    write_scores(tmp_path / "scores.json", DOCUMENT)

    assert read_scores(tmp_path / "scores.json") == DOCUMENT


@pytest.mark.parametrize("version", [None, 2, "1"])
def test_another_version_is_refused(tmp_path: Path, version: Any) -> None:
    import json

    (tmp_path / "scores.json").write_text(json.dumps(DOCUMENT | {"version": version}))

    with pytest.raises(BenchbotError, match="this BenchBot reads version 1"):
        read_scores(tmp_path / "scores.json")


def test_scores_that_are_not_valid_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="unknown key 'score'"):
        write_scores(tmp_path / "scores.json", DOCUMENT | {"score": 1})

    assert list(tmp_path.iterdir()) == []
