"""Exploration: tasks, format and method, and a run from the command line."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot_eval_exploration import evaluator
from plugins.task_navigation.tests.floors import arena_truth

COMMAND = [sys.executable, "-m", "benchbot"]
CAMERA = ("image_depth", "image_depth_info", "image_rgb", "image_rgb_info")
TASK = "exploration:active:ground_truth:laser"


def result(*rows: list[Any], tracks: int = 1) -> Any:
    return {"track": [{"rows": list(rows), "path_length_m": 0.5, "collisions": 1}] * tracks}


def test_a_robot_that_stays_where_it_is_sees_some_of_the_arena() -> None:
    scores = evaluator.evaluate(result([0, 0.0, -2.0, 0.0, 0.0]), [arena_truth()])

    assert tuple(scores) == evaluator.NAMES
    assert 0.1 < scores["coverage"] < 0.9
    assert scores["coverage_over_10m"] == pytest.approx(scores["coverage"])
    assert 0 < scores["visited"] < 0.1
    assert (scores["path_length_m"], scores["collisions"]) == (0.5, 1.0)


def test_a_reset_gives_up_what_was_seen_and_forgets_no_collision() -> None:
    last = result([0, 0.0, -2.0, 0.0, 0.0])
    spent = {"steps": 90, "looks": 0, "restarts": 4, "collisions": 3, "path_length_m": 9.5, "simulated_time_s": 200.0}
    again: Any = {**last, "provenance": {"steps": 0, "restarts": 4, "spent": spent}}

    alone, after = (evaluator.evaluate(one, [arena_truth()]) for one in (last, again))

    assert after == {**alone, "collisions": 3.0, "path_length_m": 9.5}


@pytest.mark.parametrize("document", [{}, result(), result([0, 0, 0, 0, 0], tracks=2)])
def test_a_result_without_one_track_is_refused(document: Any) -> None:
    with pytest.raises(BenchbotError, match="does not say where the robot went"):
        evaluator.evaluate(document, [arena_truth()])


def test_what_is_missing_has_seen_nothing() -> None:
    scores = evaluator.evaluate(result([0, 0.0, -2.0, 0.0, 0.0]), [arena_truth()])
    record = load().record("evaluators", "exploration")
    combined = record.combine([scores, {}])

    assert combined["coverage"] == scores["coverage"] / 2
    assert (combined["path_length_m"], combined["collisions"]) == (0.5, 1.0)
    assert record.combine([{}]) == dict.fromkeys(evaluator.ZERO_WHEN_MISSING, 0.0)


@pytest.mark.parametrize(("suffix", "more"), [("", CAMERA), (":laser", ())])
@pytest.mark.parametrize("localisation", ["ground_truth", "dead_reckoning"])
def test_a_task_can_be_run_on_a_robot_in_the_miniroom(localisation: str, suffix: str, more: tuple[str, ...]) -> None:
    name = f"exploration:active:{localisation}{suffix}"
    selection = select(
        Catalog(load()), RunRequest(task=name, robot="carter", environment="miniroom:1", method="exploration")
    )

    assert selection.observations == (*more, "laser", "poses")
    assert selection.localisation == ("ground_truth" if localisation == "ground_truth" else "noisy")
    assert selection.limits.steps == 100


def test_results_are_empty_and_claims_are_refused() -> None:
    declared = Catalog(load()).get("formats", "exploration")
    formats.validate(declared, formats.call(declared, "create", [], {}))

    with pytest.raises(BenchbotError, match="not a valid exploration"):
        formats.validate(declared, {"coverage": 1.0})


def test_a_robot_wanders_and_its_coverage_is_scored(tmp_path: Path) -> None:
    (tmp_path / "truth.json").write_text(json.dumps(arena_truth()))
    variables = {"BENCHBOT_STATE_DIR": str(tmp_path / "state"), "BENCHBOT_CACHE_DIR": str(tmp_path / "cache")}

    def benchbot(*words: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [*COMMAND, *words],
            cwd=tmp_path,
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
            check=False,
        )

    done = benchbot(
        *("submit", "--task", TASK, "--robot", "sample_robot", "--env", "arena:1"),
        *("--example", "wander", "--args", "--steps 15", "--results-location", "result.json"),
    )
    assert done.returncode == 0, done.stderr
    done = benchbot("eval", "result.json", "--ground-truth", "truth.json", "--require", "coverage>0.3")

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("coverage 0.")
    scores = json.loads((tmp_path / "scores.json").read_text())["scores"]
    assert 0.3 < scores["coverage_over_10m"] < scores["coverage"]


def test_every_score_says_how_it_is_read() -> None:
    method = load().record("evaluators", "exploration")

    assert set(method.scores) == set(evaluator.NAMES)
    assert [name for name in evaluator.NAMES if method.score(name).lower_is_better] == ["collisions"]
