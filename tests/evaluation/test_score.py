import json
import zipfile
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.results import read_scores, write_scores
from benchbot.evaluation import evaluate, evaluate_files, validate_files
from tests.made_results import Make, Save, chair, ground_truth


def test_one_result_against_its_ground_truth(make_result: Make, tmp_path: Path) -> None:
    result, truth = make_result(0.0, 3.0), ground_truth(1, chair(0.0), chair(3.0))
    before = deepcopy((result, truth))

    document = evaluate(result, [truth], method="omq")

    assert document["scores"]["OMQ"] == 1.0
    reading = document["method"].pop("scores")
    assert document["method"] == {"name": "omq", "version": "1.0", "headline": "OMQ"}
    assert reading["OMQ"] == {"lower_is_better": False, "least": 0.0, "greatest": 1.0}
    assert set(reading) == set(document["scores"])
    assert document["task_details"] == result["task_details"]
    assert document["environment_details"] == result["environment_details"]
    assert document["rows"][0]["ground_truths"][0]["environment"] == "flat:1"
    assert (result, truth) == before
    write_scores(tmp_path / "scores.json", document)
    assert read_scores(tmp_path / "scores.json") == document


def test_a_file_is_scored_by_the_method_and_the_truth_that_belong_to_it(
    catalog: Catalog, make_result: Make, save: Save, tmp_path: Path
) -> None:
    document = evaluate_files([save("a.json", make_result(0.0))], catalog=catalog)

    assert document["method"]["name"] == "omq"
    assert document["scores"]["OMQ"] == 0.5
    coverage = document["coverage"]
    assert (coverage["expected"], coverage["scored"], coverage["missing_counts"]) == (1, 1, "zero")
    assert not any(coverage[key] for key in ("failures", "warnings", "missing", "skipped"))
    assert schema.problems(document, "scores", tmp_path) == []


def test_scores_of_many_results_are_their_mean(catalog: Catalog, make_result: Make, save: Save) -> None:
    files = [save("a.json", make_result(0.0, 3.0)), save("b.json", make_result(variant=2))]

    document = evaluate_files(files, catalog=catalog)

    assert [row["scores"]["OMQ"] for row in document["rows"]] == [1.0, 0.0]
    assert document["scores"]["OMQ"] == 0.5
    assert document["environment_details"] == [[{"name": "flat", "variant": 1}], [{"name": "flat", "variant": 2}]]


def test_an_archive_counts_as_the_results_in_it(catalog: Catalog, make_result: Make, tmp_path: Path) -> None:
    archive = tmp_path / "results.zip"
    with zipfile.ZipFile(archive, "w") as out:
        out.writestr("b/two.json", json.dumps(make_result(0.0, variant=2)))
        out.writestr("a/one.json", json.dumps(make_result(0.0)))
        out.writestr("submission.json", "{}")
        out.writestr("notes.txt", "not a result")

    document = evaluate_files([archive], catalog=catalog)

    assert [row["source"] for row in document["rows"]] == [f"{archive}:a/one.json", f"{archive}:b/two.json"]


def test_one_broken_file_does_not_stop_the_others_and_counts_as_zero(
    catalog: Catalog, make_result: Make, save: Save
) -> None:
    broken = make_result(0.0, variant=2)
    broken["results"]["objects"][0]["label_probs"] = [1.0]
    files = [
        save("good.json", make_result(0.0, 3.0)),
        save("broken.json", broken),
        save("cut.json", '{"task_details": {'),
        save("list.json", "[]"),
    ]

    document = evaluate_files(files, catalog=catalog)

    assert document["scores"]["OMQ"] == 0.25
    reasons = {item["source"].rpartition("/")[2]: item["reason"] for item in document["coverage"]["missing"]}
    assert "results.objects[0].label_probs: 1 numbers, class_list has 3" in reasons["broken.json"]
    assert "not valid JSON" in reasons["cut.json"]
    assert "list" in reasons["list.json"]


def test_required_environments_without_a_result_count_as_zero(catalog: Catalog, make_result: Make, save: Save) -> None:
    document = evaluate_files(
        [save("a.json", make_result(0.0, 3.0))], catalog=catalog, required_envs=["flat:1", "flat:2"]
    )

    assert document["scores"]["OMQ"] == 0.5
    assert document["coverage"]["expected"] == 2
    assert document["coverage"]["missing"][0]["environment"] == "flat:2"


def test_an_unreadable_file_is_not_counted_twice_beside_the_environment_it_leaves_missing(
    catalog: Catalog, make_result: Make, save: Save
) -> None:
    files = [save("a.json", make_result(0.0, 3.0)), save("b.json", "no")]

    document = evaluate_files(files, catalog=catalog, required_envs=["flat:1", "flat:2"])

    assert document["scores"]["OMQ"] == 0.5
    assert document["coverage"]["skipped"][0]["source"] == str(files[1])


def test_results_of_other_environments_and_tasks_are_left_out(catalog: Catalog, make_result: Make, save: Save) -> None:
    other_task = make_result(0.0, task_details={"name": "scd:passive:ground_truth"})
    files = [
        save("a.json", make_result(0.0, 3.0)),
        save("b.json", make_result(variant=2)),
        save("c.json", other_task),
    ]

    document = evaluate_files(
        files,
        catalog=catalog,
        required_task="semantic_slam:passive:ground_truth",
        required_envs=["flat:1"],
    )

    assert document["scores"]["OMQ"] == 1.0
    assert [item["source"] for item in document["coverage"]["skipped"]] == [str(files[1]), str(files[2])]


def test_a_failed_episode_counts_as_zero_and_keeps_its_class(
    catalog: Catalog, make_result: Make, failed_episode: dict[str, Any], save: Save
) -> None:
    files = [save("a.json", make_result(0.0, 3.0)), save("failed.json", failed_episode)]

    document = evaluate_files(files, catalog=catalog)

    assert document["scores"]["OMQ"] == 0.5
    missing = document["coverage"]["missing"][0]
    assert missing["failure"] == "agent"
    assert missing["environment"] == "flat:2"
    assert "exited with status 1" in missing["reason"]


def test_nothing_but_a_failed_episode_scores_zero(catalog: Catalog, failed_episode: dict[str, Any], save: Save) -> None:
    document = evaluate_files([save("failed.json", failed_episode)], catalog=catalog)

    assert document["scores"]["OMQ"] == 0.0
    assert document["coverage"]["scored"] == 0


def test_an_episode_that_failed_with_results_is_scored_and_says_so(
    catalog: Catalog, make_result: Make, failed_episode: dict[str, Any], save: Save
) -> None:
    result = failed_episode | {"results": make_result(0.0)["results"]}

    document = evaluate_files([save("a.json", result)], catalog=catalog)

    assert document["scores"]["OMQ"] == 1.0
    assert document["rows"][0]["failure"] == "agent"
    assert document["rows"][0]["provenance"] == failed_episode["provenance"]


def test_a_named_ground_truth_goes_before_the_installed_ones(catalog: Catalog, make_result: Make, save: Save) -> None:
    truth = save("truth.json", ground_truth(1, chair(9.0)))

    document = evaluate_files([save("a.json", make_result(9.0))], catalog=catalog, ground_truth_paths=[truth])

    assert document["scores"]["OMQ"] == 1.0


def test_a_folder_of_ground_truths_may_be_named(
    catalog: Catalog, make_result: Make, save: Save, tmp_path: Path
) -> None:
    (tmp_path / "truths").mkdir()
    for variant in (1, 2):
        save(f"truths/{variant}.json", ground_truth(variant, chair(9.0)))
    files = [save("a.json", make_result(9.0)), save("b.json", make_result(9.0, variant=2))]

    document = evaluate_files(files, catalog=catalog, ground_truth_paths=[tmp_path / "truths"])

    assert document["scores"]["OMQ"] == 1.0


def test_a_ground_truth_is_the_same_however_its_keys_are_ordered(
    catalog: Catalog, make_result: Make, save: Save
) -> None:
    truth = ground_truth(1, chair(0.0))
    turned = dict(reversed(truth.items()))
    result = save("result.json", make_result(0.0))

    first, second, other = (
        evaluate_files([result], catalog=catalog, ground_truth_paths=[save(name, document)])["rows"][0]["ground_truths"]
        for name, document in (("a.json", truth), ("b.json", turned), ("c.json", ground_truth(1, chair(0.1))))
    )

    assert first == second
    assert first != other


def test_variants_match_however_they_are_written(catalog: Catalog, make_result: Make, save: Save) -> None:
    result = make_result(0.0, 3.0, environment_details=[{"name": "flat", "variant": "1"}])

    assert evaluate_files([save("a.json", result)], catalog=catalog)["scores"]["OMQ"] == 1.0


def test_changes_are_scored_against_both_scenes_in_their_order(catalog: Catalog, make_result: Make, save: Save) -> None:
    result = make_result(3.0, variant=[1, 2])
    result["task_details"] = {"name": "scd:passive:ground_truth", "results_format": "object_map_with_states"}
    result["results"]["state_list"] = ["added", "removed", "unchanged"]
    result["results"]["objects"][0]["state_probs"] = [0.0, 1.0, 0.0]

    document = evaluate_files([save("a.json", result)], catalog=catalog)

    assert document["rows"][0]["environment"] == "flat:1:2"
    assert document["scores"]["OMQ"] == document["scores"]["avg_state_quality"] == 1.0


def test_a_missing_ground_truth_is_told_with_what_there_is(catalog: Catalog, make_result: Make, save: Save) -> None:
    with pytest.raises(BenchbotError, match="no ground truth of the environment 'flat:3'") as caught:
        evaluate_files([save("a.json", make_result(variant=3))], catalog=catalog)

    assert "flat:1, flat:2" in caught.value.why


def test_two_truths_of_one_environment_are_never_chosen_from_silently(
    catalog: Catalog, make_result: Make, save: Save
) -> None:
    truths = [save("one.json", ground_truth(1)), save("two.json", ground_truth(1))]

    with pytest.raises(BenchbotError, match="two ground truths of the environment 'flat:1'"):
        evaluate_files([save("a.json", make_result())], catalog=catalog, ground_truth_paths=truths)


def test_results_of_two_tasks_are_not_mixed(catalog: Catalog, make_result: Make, save: Save) -> None:
    other = make_result(task_details={"name": "other", "results_format": "object_map"})

    with pytest.raises(BenchbotError, match="different tasks"):
        evaluate_files([save("a.json", make_result()), save("b.json", other)], catalog=catalog)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"method": "omg"}, "Did you mean 'omq'"),
        ({"required_task": "semantic_slam:passive:ground_thruth"}, "Did you mean"),
        ({"required_envs": ["flat:9"]}, "'flat:9' is not a known environment"),
        ({"required_envs": ["flat:2"]}, "nothing to score"),
    ],
)
def test_a_wrong_name_is_told(
    catalog: Catalog, make_result: Make, save: Save, options: dict[str, Any], text: str
) -> None:
    with pytest.raises(BenchbotError, match=text):
        evaluate_files([save("a.json", make_result())], catalog=catalog, **options)


def test_a_lone_file_that_is_no_result_is_an_error(catalog: Catalog, tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="no such file"):
        evaluate_files([tmp_path / "missing.json"], catalog=catalog)


def test_several_files_of_which_none_is_a_result_are_listed_with_their_reasons(
    catalog: Catalog, save: Save, tmp_path: Path
) -> None:
    files = [save("torn.json", "{"), tmp_path / "nowhere.json"]

    with pytest.raises(BenchbotError) as lone:
        evaluate_files(files[1:], catalog=catalog)
    with pytest.raises(BenchbotError) as several:
        evaluate_files(files, catalog=catalog)

    assert (lone.value.title, lone.value.why) == (f"{files[1]} is not a result.", "There is no such file.")
    assert several.value.title == "There is nothing to score."
    torn, nowhere = several.value.why.splitlines()
    assert torn.startswith(f"{files[0]}: It is not valid JSON")
    assert nowhere == f"{files[1]}: There is no such file."


def test_results_whose_format_no_method_reads_are_told(catalog: Catalog, make_result: Make, save: Save) -> None:
    result = make_result(task_details={"name": "poetry", "results_format": "poem"})

    with pytest.raises(BenchbotError, match="no method that scores"):
        evaluate_files([save("a.json", result)], catalog=catalog)


def test_validation_alone_needs_no_ground_truth(catalog: Catalog, make_result: Make, save: Save) -> None:
    files = [save("a.json", make_result(variant=3)), save("b.json", "no")]

    coverage = validate_files(files, catalog=catalog)

    assert coverage["scored"] == 1
    assert coverage["missing"][0]["source"] == str(files[1])
