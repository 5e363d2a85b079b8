"""What is missing: how it counts, and whose fault it was."""

from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation import evaluate_files, validate_files
from tests.made_results import Make, MakeRun, Save


def test_what_is_missing_counts_as_zero_or_not_at_all_and_the_document_says_which(
    catalog: Catalog, make_result: Make, failed_episode: dict[str, Any], save: Save
) -> None:
    files = [save("a.json", make_result(0.0, 3.0)), save("b.json", failed_episode), save("c.json", "no")]

    as_zero = evaluate_files(files, catalog=catalog)
    left_out = evaluate_files(files, catalog=catalog, missing="leave-out")

    assert as_zero["scores"]["OMQ"] == pytest.approx(1 / 3)
    assert left_out["scores"]["OMQ"] == 1.0
    assert as_zero["coverage"]["missing_counts"] == "zero"
    means_of = dict.fromkeys(left_out["scores"], 1)
    assert left_out["coverage"] == as_zero["coverage"] | {"missing_counts": "leave-out", "means_of": means_of}


def test_required_environments_can_be_left_out_too(catalog: Catalog, make_result: Make, save: Save) -> None:
    files = [save("a.json", make_result(0.0, 3.0))]

    document = evaluate_files(files, catalog=catalog, required_envs=["flat:1", "flat:2"], missing="leave-out")

    assert document["scores"]["OMQ"] == 1.0
    assert document["coverage"]["expected"] == 2


def test_with_nothing_left_there_is_no_score(catalog: Catalog, failed_episode: dict[str, Any], save: Save) -> None:
    with pytest.raises(BenchbotError, match="None of the results can be scored") as caught:
        evaluate_files([save("a.json", failed_episode)], catalog=catalog, missing="leave-out")

    assert "exited with status 1" in caught.value.why


def test_failures_are_counted_by_class_whether_or_not_they_left_a_result(
    catalog: Catalog, make_run: MakeRun, save: Save
) -> None:
    classes = ["collision", "timeout", "timeout", "agent"]
    runs = [make_run(0.0, seed=seed) for seed in range(5)]
    for run, name in zip(runs, classes, strict=False):
        run["provenance"]["failure"] = {"class": name, "why": "it is a test"}
    del runs[1]["results"], runs[3]["results"]

    document = evaluate_files([save(f"{number}.json", run) for number, run in enumerate(runs)], catalog=catalog)

    assert list(document["coverage"]["failures"].items()) == [("agent", 1), ("collision", 1), ("timeout", 2)]
    assert [row["failure"] for row in document["rows"]] == ["collision", "timeout", None]
    assert [item["failure"] for item in document["coverage"]["missing"]] == ["timeout", "agent"]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-1e999"])
def test_a_number_that_is_not_finite_is_told_with_its_place_and_its_environment_counts(
    catalog: Catalog, make_result: Make, save: Save, number: str
) -> None:
    import json

    text = json.dumps(make_result(0.0, environment_details=[{"name": "flat", "variant": 2, "start_pose": [1, 4321]}]))
    files = [save("a.json", make_result(0.0, 3.0)), save("b.json", text.replace("4321", number))]

    document = evaluate_files(files, catalog=catalog)

    assert document["scores"]["OMQ"] == 0.5
    (missing,) = document["coverage"]["missing"]
    assert missing["environment"] == "flat:2"
    assert "not finite, at /environment_details/0/start_pose/1" in missing["reason"]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"results": ...}, "has no results. The key 'results' is missing."),
        (
            {"environment_details": [{"name": "flat", "variant": 2}, {"name": "loft", "variant": 1}]},
            "Its scenes are of different environments: flat, loft.",
        ),
    ],
)
def test_a_result_that_cannot_be_scored_is_missing_with_the_reason(
    catalog: Catalog, make_result: Make, save: Save, change: dict[str, Any], why: str
) -> None:
    changed = {key: value for key, value in (make_result(variant=2) | change).items() if value is not ...}
    files = [save("a.json", make_result(0.0, 3.0)), save("b.json", changed)]

    document = evaluate_files(files, catalog=catalog)

    assert document["scores"]["OMQ"] == 0.5
    assert why in document["coverage"]["missing"][0]["reason"]


def test_results_of_a_task_without_a_format_cannot_be_scored(catalog: Catalog, make_result: Make, save: Save) -> None:
    result = save("a.json", make_result(task_details={"name": "tour"}))

    (missing,) = validate_files([result], catalog=catalog)["missing"]
    assert "Its task 'tour' has no results_format." in missing["reason"]
    with pytest.raises(BenchbotError, match="The method 'omq' cannot score these results"):
        evaluate_files([result], catalog=catalog, method="omq")


def test_files_of_different_tasks_are_named(catalog: Catalog, make_result: Make, save: Save) -> None:
    other = make_result(task_details={"name": "other", "results_format": "object_map"})
    files = [save("a.json", make_result()), save("b.json", other), save("c.json", make_result(0.0))]

    with pytest.raises(BenchbotError, match="different tasks") as caught:
        evaluate_files(files, catalog=catalog)

    assert f"of 'other' (object_map): {files[1]}" in caught.value.why
    assert f"{files[0]}, {files[2]}" in caught.value.why
    assert "--required-task semantic_slam:passive:ground_truth" in caught.value.fix
