"""Several results of one environment."""

from pathlib import Path
from random import Random
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.evaluation import evaluate_files
from benchbot.evaluation.collect import distinct
from benchbot.evaluation.coverage import Coverage
from benchbot.evaluation.result_document import ResultDocument
from tests.made_results import Make, MakeRun, Save


def test_results_of_several_seeds_are_repeats(catalog: Catalog, make_run: MakeRun, save: Save) -> None:
    files = [save("a.json", make_run(0.0, 3.0, seed=1)), save("b.json", make_run(seed=2))]

    document = evaluate_files(files, catalog=catalog)

    assert [(row["environment"], row["seed"]) for row in document["rows"]] == [("flat:1", 1), ("flat:1", 2)]
    assert document["scores"]["OMQ"] == 0.5
    assert document["coverage"]["warnings"] == []


def test_the_same_result_twice_counts_once(catalog: Catalog, make_run: MakeRun, save: Save) -> None:
    files = [save("a.json", make_run(0.0)), save("b.json", make_run(0.0)), save("c.json", make_run(variant=2))]

    document = evaluate_files(files, catalog=catalog)

    assert len(document["rows"]) == 2
    assert document["scores"]["OMQ"] == 0.25
    (skipped,) = document["coverage"]["skipped"]
    assert skipped == {"source": str(files[1]), "reason": f"It is the same result as {files[0]}, and counts once."}


def test_of_two_different_results_of_one_episode_neither_is_scored_and_others_are(
    catalog: Catalog, make_run: MakeRun, save: Save
) -> None:
    files = [save("a.json", make_run(0.0)), save("b.json", make_run(3.0)), save("c.json", make_run(0.0, variant=2))]

    document = evaluate_files(files, catalog=catalog)

    assert [row["environment"] for row in document["rows"]] == ["flat:2"]
    (missing,) = document["coverage"]["missing"]
    assert f"{files[0]} and {files[1]} are all of flat:1, seed 0, and differ" in missing["reason"]
    assert document["scores"]["OMQ"] == 0.5


def test_episodes_with_one_seed_are_told_apart_by_what_else_was_selected(
    catalog: Catalog, make_run: MakeRun, save: Save
) -> None:
    episode = {"list": "navigation:flat:1", "sha256": "0" * 64, "number": 7, "id": "b7"}
    changes: list[dict[str, Any]] = [{"repeat": 1}, {"repeat": 2}, {"robot": "other"}, {"episode": episode}]
    files = [save(f"{number}.json", make_run(0.0, 3.0, **change)) for number, change in enumerate(changes)]

    document = evaluate_files(files, catalog=catalog)

    assert [row["repeat"] for row in document["rows"]] == [1, 2, None, None]
    assert [row["episode"] for row in document["rows"]] == [None, None, None, 7]
    assert document["coverage"]["missing"] == []


def test_results_under_other_settings_are_others_and_the_mixture_is_pointed_out(
    catalog: Catalog, make_run: MakeRun, save: Save
) -> None:
    night = {"lighting.time": "21:30"}
    files = [save("day.json", make_run(0.0, 3.0)), save("night.json", make_run(settings=night))]

    document = evaluate_files(files, catalog=catalog)

    assert [row.get("settings") for row in document["rows"]] == [None, night]
    assert document["scores"]["OMQ"] == 0.5
    (warning,) = document["coverage"]["warnings"]
    assert warning == (
        "The results differ in their settings (--set), and are scored together: 1 with none; 1 with lighting.time=21:30"
    )
    schema.check(document, "scores", files[0])


def test_results_that_do_not_say_their_seed_are_repeats_with_a_warning(
    catalog: Catalog, make_result: Make, save: Save
) -> None:
    files = [save("a.json", make_result(0.0, 3.0)), save("b.json", make_result())]

    document = evaluate_files(files, catalog=catalog)

    assert [row["seed"] for row in document["rows"]] == [None, None]
    (warning,) = document["coverage"]["warnings"]
    assert warning == f"2 results of flat:1 do not say their seed, and count as repeats: {files[0]}, {files[1]}"


def test_an_absent_environment_weighs_as_much_as_those_that_are_there(
    catalog: Catalog, make_run: MakeRun, save: Save
) -> None:
    files = [save(f"{seed}.json", make_run(0.0, 3.0, seed=seed)) for seed in (1, 2, 3)]

    document = evaluate_files(files, catalog=catalog, required_envs=["flat:1", "flat:2"])

    assert document["scores"]["OMQ"] == 0.5
    missing = [(item["environment"], item["seed"]) for item in document["coverage"]["missing"]]
    assert missing == [("flat:2", 1), ("flat:2", 2), ("flat:2", 3)]


def test_a_file_that_is_named_and_in_a_folder_counts_once(
    catalog: Catalog, make_run: MakeRun, save: Save, tmp_path: Path
) -> None:
    (tmp_path / "results").mkdir()
    path = save("results/a.json", make_run(0.0, 3.0))

    document = evaluate_files([path, path.parent], catalog=catalog)

    assert document["coverage"]["expected"] == 1


kind = st.tuples(st.integers(1, 2), st.sampled_from([None, 0, 1]), st.integers(0, 2))


@given(st.lists(kind, max_size=8), st.randoms(use_true_random=False))
def test_the_order_in_which_results_come_is_of_no_account(
    kinds: list[tuple[int, int | None, int]], random: Random
) -> None:
    def outcome(submissions: list[ResultDocument]) -> tuple[list[str], int, int]:
        coverage = Coverage()
        kept = [str(submission.document) for submission in distinct(submissions, coverage)]
        return sorted(kept), len(coverage.missing), len(coverage.skipped)

    submissions = [
        ResultDocument(
            str(place),
            {
                "task_details": {},
                "environment_details": [{"name": "flat", "variant": variant}],
                "provenance": {"selection": {} if seed is None else {"seed": seed}},
                "results": content,
            },
        )
        for place, (variant, seed, content) in enumerate(kinds)
    ]
    mixed = random.sample(submissions, len(submissions))

    assert outcome(submissions) == outcome(mixed)
    kept, missing, _ = outcome(submissions)
    assert len(kept) + missing >= len({(variant, seed) for variant, seed, _ in kinds})
    assert len(kept) == len(set(kept))
