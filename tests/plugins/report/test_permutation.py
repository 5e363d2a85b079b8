import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from benchbot.plugins.report.significance import PermutationTest, holm, sign_flip, smallest_p

numbers = st.lists(st.floats(-10, 10, allow_subnormal=False), min_size=1, max_size=9)


def test_three_differences_by_hand() -> None:
    # Of the sums ±1 ±2 ±3, 6 and -6 are as far from zero as 6: 2 of 8.
    assert sign_flip([1, 2, 3]) == PermutationTest(p=0.25, arrangements=8, exact=True)
    # 1 + 2 - 3 = 0: every sum is as far from zero.
    assert sign_flip([1, 2, -3]).p == 1.0
    # The sums ±1 ±2 -(±4): 5 and 7 of {1, 3, 5, 7} are as far as 5, in both directions.
    assert sign_flip([-1, 2, 4]).p == 0.5


@given(numbers)
def test_a_p_value_is_above_zero_and_does_not_depend_on_direction_or_order(values: list[float]) -> None:
    test = sign_flip(values)

    assert 0 < test.p <= 1
    assert sign_flip([-value for value in values]).p == test.p
    assert sign_flip(values[::-1]).p == test.p
    assert test.p >= smallest_p(values)


def test_no_difference_gives_one() -> None:
    assert sign_flip([0.0] * 5).p == 1.0
    assert sign_flip([0.0] * 30).p == 1.0
    assert smallest_p([0.0] * 5) == 1.0


def test_what_agrees_reaches_the_smallest_p_value() -> None:
    assert sign_flip([0.1] * 5).p == 0.0625 == smallest_p([0.1] * 5)
    assert sign_flip([0.1] * 6).p == 0.03125


def test_many_clusters_are_sampled_the_same_each_time_and_never_give_zero() -> None:
    test = sign_flip([1.0] * 40)

    assert (test.arrangements, test.exact) == (100_000, False)
    assert test.p == 1e-5
    mixed = list(np.random.default_rng(0).normal(0.2, 1, 40))
    assert sign_flip(mixed) == sign_flip(mixed)


def test_sampling_agrees_with_trying_all() -> None:
    values = list(np.random.default_rng(3).normal(0.4, 1, 16))
    # A cluster without a difference doubles the arrangements and changes nothing.
    sampled = sign_flip([*values, 0.0])

    assert sign_flip(values).exact
    assert not sampled.exact
    assert sampled.p == pytest.approx(sign_flip(values).p, abs=0.005)


def test_p_values_of_sets_that_are_alike_are_uniform() -> None:
    random = np.random.default_rng(1)
    p_values = [sign_flip(list(random.normal(0, random.uniform(0.5, 2, 11)))).p for _ in range(500)]

    assert stats.kstest(p_values, "uniform").pvalue > 0.05
    assert np.mean(np.array(p_values) < 0.05) < 0.075


def test_holm_by_hand() -> None:
    # Sorted: 0.01 · 4, 0.015 · 3 = 0.045, 0.03 · 2 = 0.06, 0.5 · 1.
    assert holm([0.03, 0.01, 0.5, 0.015]) == pytest.approx([0.06, 0.04, 0.5, 0.045])
    # One that is adjusted to less than one before it is raised to that; none exceeds 1.
    assert holm([0.02, 0.021]) == pytest.approx([0.04, 0.04])
    assert holm([0.8, 0.9]) == [1.0, 1.0]
    assert holm([0.3]) == [0.3]


@given(st.lists(st.floats(1e-6, 1), min_size=1, max_size=8))
def test_holm_keeps_the_order_and_lies_between_no_adjustment_and_bonferroni(p_values: list[float]) -> None:
    adjusted = holm(p_values)

    for p, q in zip(p_values, adjusted, strict=True):
        assert p <= q <= min(1.0, len(p_values) * p) or q == pytest.approx(max(adjusted))
    ranked = sorted(range(len(p_values)), key=lambda index: p_values[index])
    assert [adjusted[index] for index in ranked] == sorted(adjusted)
