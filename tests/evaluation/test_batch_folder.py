import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation import evaluate_files
from benchbot.evaluation.batch_folder import episode_name
from tests.made_results import MakeRun

SEEDS = 4
MakeBatch = Callable[..., Path]


@pytest.fixture
def make_batch(tmp_path: Path, make_run: MakeRun) -> MakeBatch:
    """Make the folder of a batch over seeds 0 to 3 of flat:2, where all that is there is found; some are finished."""

    def make(*finished: int) -> Path:
        folder = tmp_path / "batch"
        episodes: list[dict[str, Any]] = [
            {"key": f"{seed:064x}"[::-1], "label": f"seed{seed}", "robot": "r", "environment": "flat:2", "seed": seed}
            for seed in range(SEEDS)
        ]
        plan: dict[str, Any] = dict.fromkeys(schema.schema("plan")["required"])
        folder.mkdir()
        write(folder / "plan.json", plan | {"task": "semantic_slam:passive:ground_truth", "episodes": episodes})
        for name in ("crew.json", "executor.json", "plan-1234.json"):
            write(folder / name, {"workers": []})
        for seed in finished:
            episode = folder / "episodes" / episode_name(episodes[seed]["label"], episodes[seed]["key"])
            result = make_run(0.0, variant=2, seed=seed)
            write(episode / "result.json", result)
            write(folder / "results" / f"{episode.name}.json", result)
            write(episode / "frames" / "recording.json", {"recorder": "frames"})
            write(episode / "attempt-1" / "result.json", make_run(variant=2, seed=seed))
            write(episode / "attempts.jsonl", {})
            write(episode / "work" / "result.json", make_run(variant=2, seed=seed))
            write(folder / "solutions" / "0" / "files" / "result.json", make_run(variant=2, seed=seed))
            write(folder / "solutions" / "0" / "snapshot.json", {})
        return folder

    return make


def write(path: Path, document: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document), "utf-8")


def test_a_batch_is_read_by_its_plan(make_batch: MakeBatch, catalog: Catalog) -> None:
    folder = make_batch(0, 1, 2, 3)

    for path in (folder, folder.parent):
        document = evaluate_files([path], catalog=catalog)

        assert document["scores"]["OMQ"] == 1.0
        assert (document["coverage"]["scored"], document["coverage"]["expected"]) == (SEEDS, SEEDS)
        assert document["coverage"]["own_files"] >= len(["plan.json", "plan-1234.json", "crew.json", "executor.json"])


def test_an_episode_that_is_not_finished_is_missing(make_batch: MakeBatch, catalog: Catalog) -> None:
    folder = make_batch(0, 2)

    document = evaluate_files([folder], catalog=catalog)
    so_far = evaluate_files([folder], catalog=catalog, missing="leave-out")

    assert [item["seed"] for item in document["coverage"]["missing"]] == [1, 3]
    assert {item["reason"] for item in document["coverage"]["missing"]} == {"Its batch has not finished this episode."}
    assert (document["scores"]["OMQ"], document["coverage"]["expected"]) == (0.5, SEEDS)
    assert so_far["scores"]["OMQ"] == 1.0


def test_an_unfinished_episode_of_a_required_environment_counts_once(make_batch: MakeBatch, catalog: Catalog) -> None:
    options: dict[str, Any] = {"catalog": catalog, "required_envs": ["flat:1", "flat:2"]}

    coverage = evaluate_files([make_batch(0, 1)], **options)["coverage"]

    assert [item["environment"] for item in coverage["missing"]] == ["flat:2"] * 2 + ["flat:1"] * SEEDS


@pytest.mark.parametrize("lost", ["episodes", "results", "plan.json"])
def test_a_copy_of_a_part_is_enough(make_batch: MakeBatch, catalog: Catalog, lost: str) -> None:
    folder = make_batch(0, 1, 2, 3)
    if (folder / lost).is_dir():
        shutil.rmtree(folder / lost)
    else:
        (folder / lost).unlink()

    document = evaluate_files([folder], catalog=catalog)

    assert document["scores"]["OMQ"] == 1.0
    assert (document["coverage"]["scored"], document["coverage"]["expected"]) == (SEEDS, SEEDS)


def test_a_broken_result_counts_and_those_of_no_plan_are_named(make_batch: MakeBatch, catalog: Catalog) -> None:
    folder = make_batch(0, 1, 2, 3)
    one, *_ = sorted(folder.glob("episodes/*/result.json"))
    shutil.copytree(one.parent, folder / "episodes" / "dropped-12345678")
    one.write_text("{}")

    coverage = evaluate_files([folder], catalog=catalog)["coverage"]

    assert [item["source"] for item in coverage["missing"]] == [str(one)]
    assert coverage["expected"] == SEEDS
    assert [item["source"] for item in coverage["skipped"]] == [f"{folder}/episodes/dropped-12345678/result.json"]


@pytest.mark.parametrize("label", ["../../elsewhere", "a/b", 7, None])
def test_a_plan_that_leads_elsewhere_makes_no_batch(make_batch: MakeBatch, catalog: Catalog, label: object) -> None:
    folder = make_batch(0, 1, 2, 3)
    plan = json.loads((folder / "plan.json").read_text())
    plan["episodes"][0]["label"] = label
    write(folder / "plan.json", plan)

    assert evaluate_files([folder], catalog=catalog)["coverage"]["expected"] == SEEDS


def test_results_of_several_solutions_have_no_score_together(make_batch: MakeBatch, catalog: Catalog) -> None:
    folder = make_batch(0, 1, 2, 3)
    plan = json.loads((folder / "plan.json").read_text("utf-8"))
    for number, episode in enumerate(plan["episodes"]):
        name = episode_name(episode["label"], episode["key"])
        episode["solution"] = "ours" if number < 2 else "base"
        (folder / "results" / episode["solution"]).mkdir(exist_ok=True)
        (folder / "results" / f"{name}.json").rename(folder / "results" / episode["solution"] / f"{name}.json")
    write(folder / "plan.json", plan)

    with pytest.raises(BenchbotError, match="It is a batch of several solutions") as caught:
        evaluate_files([folder], catalog=catalog)
    document = evaluate_files([folder / "results" / "base"], catalog=catalog)

    assert str(folder / "results" / "ours") in str(caught.value)
    assert document["coverage"]["scored"] == 2
