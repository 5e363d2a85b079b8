"""Episodes of several attempts, and scores that are means of fewer results than expected."""

from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.evaluation import evaluate_files
from benchbot.evaluation.coverage import means_in_words, means_of
from tests.made_results import Make, MakeRun, Save

SPENT: dict[str, Any] = {
    "steps": 198, "looks": 0, "restarts": 4, "collisions": 3, "path_length_m": 80.0, "simulated_time_s": 400.0,
}  # fmt: skip


def put_back(document: dict[str, Any], **limits: int) -> dict[str, Any]:
    """The result, of an episode in which the robot was put back four times."""
    document["provenance"] |= {"restarts": 4, "spent": SPENT}
    document["provenance"]["selection"]["limits"] = limits
    return document


def test_what_the_attempts_before_have_taken_is_said(catalog: Catalog, make_run: MakeRun, save: Save) -> None:
    files = [save("a.json", put_back(make_run(0.0, 3.0))), save("b.json", make_run(0.0, variant=2))]

    coverage = evaluate_files(files, catalog=catalog)["coverage"]

    (warning,) = coverage["warnings"]
    assert warning == (
        "The robot was put back (restarts) in 1 of 2 episodes: flat:1, seed 0: "
        "5 attempts, 198 steps and 3 collisions in all"
    )


@pytest.mark.parametrize(
    ("limits", "why"),
    [({"steps": 100}, "taken 198 steps, and its limit is 100"), ({"restarts": 0}, "4 restarts, and its limit is 0")],
)
def test_a_result_beyond_its_limits_counts_as_zero(
    catalog: Catalog, make_run: MakeRun, save: Save, limits: dict[str, int], why: str
) -> None:
    files = [save("a.json", put_back(make_run(0.0, 3.0), **limits)), save("b.json", make_run(0.0, variant=2))]

    document = evaluate_files(files, catalog=catalog)

    assert document["scores"]["OMQ"] == 0.5
    (missing,) = document["coverage"]["missing"]
    assert why in missing["reason"]


def test_what_is_left_out_shows_in_what_a_score_is_a_mean_of(catalog: Catalog, make_result: Make, save: Save) -> None:
    files = [save("a.json", make_result(0.0, 3.0)), save("b.json", "not JSON")]

    left_out = evaluate_files(files, catalog=catalog, missing="leave-out")
    as_zero = evaluate_files(files, catalog=catalog)

    assert left_out["coverage"]["means_of"] == dict.fromkeys(left_out["scores"], 1)
    assert "means_of" not in as_zero["coverage"]


def test_errors_are_a_mean_of_those_that_have_them() -> None:
    rows = [{"scores": {"ATE": 0.1, "RPE": 0.1, "success": 1.0}}, {"scores": {"ATE": 0.2, "success": 0.0}}]
    rows += [{"scores": {}}] * 3

    found = means_of(("ATE", "RPE", "success"), rows, 5, ("success",))

    assert found == {"ATE": 2, "RPE": 1}
    assert means_in_words({"means_of": found, "expected": 5}, ("success", "ATE", "RPE")) == [
        "ATE: mean of 2 of 5",
        "RPE: mean of 1 of 5",
    ]
