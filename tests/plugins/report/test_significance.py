from dataclasses import replace

import pytest

from benchbot.evaluation.intervals import Over
from benchbot.plugins.report.significance import Finding, Verdict

FOUND = Finding(
    a="new",
    b="old",
    score="OMQ",
    over=Over.PLACES,
    pairs=25,
    clusters=10,
    equal=False,
    difference=0.0512,
    interval=(0.0123, 0.0901),
    p=0.0117,
    reachable_p=2**-9,
    detectable=0.044,
)


def test_a_difference_that_the_test_finds_can_be_quoted() -> None:
    assert FOUND.verdict is Verdict.HIGHER
    assert FOUND.sentence == (
        "new scores higher than old by 0.051 OMQ (95 % interval 0.012 to 0.090, "
        "paired permutation test over 25 pairs of results in 10 places, p = 0.0117)."
    )


def test_the_set_that_scores_higher_comes_first_and_the_interval_is_seen_from_there() -> None:
    turned = replace(FOUND, a="old", b="new", difference=-0.0512, interval=(-0.0901, -0.0123))

    assert turned.verdict is Verdict.LOWER
    assert turned.sentence == FOUND.sentence


def test_what_the_test_does_not_find_is_not_claimed_and_what_it_could_have_found_is_said() -> None:
    unsure = replace(FOUND, p=0.21, interval=(-0.0301, 0.1202), difference=0.0451, detectable=0.093)

    assert unsure.verdict is Verdict.UNDECIDED
    assert unsure.sentence == (
        "new and old are not told apart: new minus old is 0.045 OMQ (95 % interval −0.030 to 0.120, "
        "paired permutation test over 25 pairs of results in 10 places, p = 0.21). "
        "A difference of 0.093 would have been found four times out of five."
    )


def test_what_could_have_been_found_is_left_out_where_it_is_not_known() -> None:
    unsure = replace(FOUND, p=0.21, interval=None, detectable=None)

    assert unsure.sentence == (
        "new and old are not told apart: new minus old is 0.051 OMQ "
        "(paired permutation test over 25 pairs of results in 10 places, p = 0.21)."
    )


def test_an_interval_above_zero_is_no_verdict() -> None:
    assert replace(FOUND, p=0.06).verdict is Verdict.UNDECIDED


def test_a_p_value_at_the_level_itself_is_not_below_it() -> None:
    assert replace(FOUND, p=0.05).verdict is Verdict.UNDECIDED
    assert replace(FOUND, p=0.0499).verdict is Verdict.HIGHER
    assert replace(FOUND, reachable_p=0.05).verdict is Verdict.TOO_FEW


def test_too_few_clusters_are_said_to_be_too_few() -> None:
    few = replace(FOUND, clusters=5, pairs=5, over=Over.ENVIRONMENTS, p=0.0625, reachable_p=0.0625, interval=None)

    assert few.verdict is Verdict.TOO_FEW
    assert few.sentence == (
        "5 pairs of results in 5 environments cannot tell new and old apart: new minus old is 0.051 OMQ "
        "(paired permutation test over 5 pairs of results in 5 environments, p = 0.0625). "
        "So few give no p below 0.0625; 6 environments or more can."
    )


@pytest.mark.parametrize(("comparisons", "needed"), [(1, 6), (2, 7), (3, 7), (6, 8)])
def test_several_comparisons_need_more_clusters(comparisons: int, needed: int) -> None:
    few = replace(FOUND, reachable_p=0.06, comparisons=comparisons)

    assert f"; {needed} places or more can." in few.sentence
    assert comparisons * 2.0 ** (1 - needed) < 0.05 <= comparisons * 2.0 ** (2 - needed)


def test_equal_results_are_called_equal() -> None:
    equal = replace(FOUND, equal=True, difference=0.0, interval=None, p=1.0, reachable_p=1.0, pairs=1, clusters=1)

    assert equal.verdict is Verdict.EQUAL
    assert equal.sentence == "new and old have the same OMQ in each of 1 pair of results in 1 place."


def test_adjusted_p_values_say_so() -> None:
    assert "p < 0.0001, adjusted for 2 comparisons by Holm's method)" in replace(FOUND, p=3e-5, comparisons=2).sentence


def test_of_an_error_the_lower_set_is_the_better_one_and_comes_first() -> None:
    error = replace(FOUND, score="ATE_RMSE_m", lower_is_better=True)

    assert (error.verdict, error.better) == (Verdict.HIGHER, "old")
    assert error.sentence == (
        "old is better than new: its ATE_RMSE_m is lower by 0.051 (95 % interval 0.012 to 0.090, "
        "paired permutation test over 25 pairs of results in 10 places, p = 0.0117)."
    )
    turned = replace(error, a="old", b="new", difference=-0.0512, interval=(-0.0901, -0.0123))
    assert (turned.verdict, turned.better, turned.sentence) == (Verdict.LOWER, "old", error.sentence)


def test_none_is_better_where_that_is_not_known_or_not_found() -> None:
    assert FOUND.better is None
    assert replace(FOUND, lower_is_better=False).better == "new"
    assert replace(FOUND, lower_is_better=False, p=0.21).better is None
