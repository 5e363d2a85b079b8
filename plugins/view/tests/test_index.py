"""The table of episodes: what is in it, and what becomes of it when files change."""

import json
import os
from pathlib import Path

import pytest

from benchbot.plugin import BenchbotError
from benchbot_view.index import Index, Source
from benchbot_view.memory import Memory
from benchbot_view.rows import Row, id_of
from benchbot_view.scoring import Scorer, together
from plugins.view.tests.conftest import HOSTILE, result, save


def rows_of(index: Index) -> dict[str, Row]:
    return {row.solution: row for row in index.rows()[2]}


def look(index: Index) -> None:
    index._next_s = 0.0
    for batch in index._batches.values():
        batch._looked_s = 0.0
    index.look()


def test_results_are_rows_and_other_files_are_none(results: Path) -> None:
    index = Index([Source.of(f"mine={results}")])
    index.look()

    rows = rows_of(index)
    assert len(index) == 3
    assert rows["good"].environment == "miniroom:1"
    assert (rows["good"].set, rows["good"].seed, rows["good"].steps) == ("mine", 0, 5)
    failed = next(row for row in rows.values() if row.state == "agent")
    assert "\u202e" not in failed.solution + failed.why
    assert "\\u202e" in failed.why
    assert HOSTILE[:9] in failed.why  # as text; pages escape it


def test_a_result_that_changed_is_read_again_and_loses_its_score(tmp_path: Path) -> None:
    path = save(tmp_path / "a.json", result("one"))
    index = Index([Source.of(str(tmp_path))])
    index.look()
    index.put_score(id_of(path), "OMQ", 0.5)
    revision = index.revision

    look(index)
    assert index.revision == revision
    assert rows_of(index)["one"].score == 0.5

    save(path, result("another"))
    os.utime(path, ns=(1, 1))
    look(index)

    assert [row.solution for row in index.rows(since=revision)[2]] == ["another"]
    assert rows_of(index)["another"].score is None
    assert index.unscored()


def planned(batch: Path, count: int) -> list[Path]:
    """Write the plan of a batch; return where the results of its episodes will lie."""
    keys = [f"{number:064x}" for number in range(count)]
    episodes = [
        {"key": key, "label": f"e{i}", "robot": "carter", "environment": "miniroom:1", "seed": i}
        for i, key in enumerate(keys)
    ]
    (batch / "events").mkdir(parents=True, exist_ok=True)
    (batch / "plan.json").write_text(json.dumps({"task": "t", "episodes": episodes}), "utf-8")
    return [batch / "episodes" / f"e{i}-{key[:8]}" / "result.json" for i, key in enumerate(keys)]


def test_what_was_read_is_kept_for_the_next_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    folder = tmp_path / "results"
    save(folder / "a.json", result("one"))
    save(planned(folder / "night", 1)[0], result("x"))
    Index([Source.of(str(folder))]).look()
    monkeypatch.setattr("benchbot_view.index.read_result", lambda *_: pytest.fail("It was read again."))
    index = Index([Source.of(str(folder))])

    index.look()

    assert {name: row.state for name, row in rows_of(index).items()} == {"one": "done", "results/night": "done"}


def test_a_batch_that_is_planned_further_keeps_its_scores(tmp_path: Path) -> None:
    index = Index([Source.of(str(tmp_path))])
    path = save(planned(tmp_path, 1)[0], result("x"))
    index.look()
    index.put_score(id_of(path), "OMQ", 0.5)

    planned(tmp_path, 2)
    look(index)

    assert [(row.state, row.score) for row in index.rows()[2]] == [("done", 0.5), ("pending", None)]


def test_a_cache_that_is_damaged_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path))
    memory = Memory()
    memory._path.write_bytes(b"no database" * 100)

    assert memory.find(tmp_path, tmp_path.stat()) == (False, None)
    memory.put(tmp_path, tmp_path.stat(), 1)
    memory.save()


def test_a_batch_shows_what_is_planned_and_grows_by_its_events(tmp_path: Path) -> None:
    batch = tmp_path / "night"
    paths = planned(batch, 3)
    index = Index([Source.of(str(batch))])
    index.look()
    assert [row.state for row in index.rows()[2]] == ["pending"] * 3
    revision = index.revision

    save(paths[1], result("x", 1))
    look(index)
    assert index.rows(since=revision)[2] == []  # no event has told of it

    with (batch / "events" / "w.jsonl").open("a") as file:
        file.write(json.dumps({"time_s": 1.0, "who": "w", "what": "finished", "key": f"{1:064x}"}) + "\n")
    look(index)

    (row,) = index.rows(since=revision)[2]
    assert (row.seed, row.state, row.solution, row.set) == (1, "done", "night", "night")
    scores = {
        "method": {"name": "omq", "headline": "OMQ"},
        "rows": [{"source": str(index.path(row.id)), "scores": {"OMQ": 0.25}}],
    }
    (batch / "scores.json").write_text(json.dumps(scores), "utf-8")
    look(index)
    found = index.row(row.id)
    assert found is not None
    assert (found.score_name, found.score) == ("OMQ", 0.25)


def test_scores_that_are_older_than_a_result_are_not_its_own(tmp_path: Path) -> None:
    path = save(tmp_path / "a.json", result("one"))
    scores = {"method": {"name": "omq", "headline": "OMQ"}, "rows": [{"source": "a.json", "scores": {"OMQ": 0.25}}]}
    (tmp_path / "scores.json").write_text(json.dumps(scores), "utf-8")
    os.utime(tmp_path / "scores.json", (1, 1))
    index = Index([Source.of(str(tmp_path))])
    index.look()

    row = index.row(id_of(path))
    assert row is not None
    assert row.score is None


def test_two_results_of_one_episode_are_scored_apart(results: Path) -> None:
    index = Index([Source.of(str(results))])
    index.look()
    waiting = [(row, path) for row, path in index.unscored() if row.state == "done"]

    assert len(waiting) == 2
    assert len(together(waiting, 100)) == 1


def test_a_scorer_that_is_closed_starts_no_process(results: Path) -> None:
    index = Index([Source.of(str(results))])
    index.look()
    scorer = Scorer(index)
    scorer.close()

    scorer.work()  # for an answer that was on its way

    assert index.unscored()
    assert scorer._pool is None


def test_a_folder_that_is_not_there_is_said_to_be_missing() -> None:
    with pytest.raises(BenchbotError, match="There is no /nowhere"):
        Source.of("/nowhere")
