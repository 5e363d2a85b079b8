import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.records import Score
from benchbot.plugins.report.bars import Axis
from benchbot.plugins.report.episodes import natural


@pytest.mark.parametrize(
    ("values", "axis"),
    [
        ([], (0.0, 1.0)),
        ([0.2, 0.9], (0.0, 1.0)),
        ([0.0, 3.2], (0.0, 4.0)),
        ([-0.4, 0.4], (-0.4, 0.4)),
        ([120.0, 80.0], (0.0, 200.0)),
    ],
)
def test_an_axis_runs_from_zero_to_round_numbers(values: list[float], axis: tuple[float, float]) -> None:
    found = Axis.of(values)

    assert (found.low, found.high) == pytest.approx(axis)


@pytest.mark.parametrize(
    ("values", "score", "axis"),
    [
        ([0.2], Score(least=0.0, greatest=1.0), (0.0, 1.0)),
        ([2.0], Score(least=1.0, greatest=5.0), (1.0, 5.0)),
        ([0.012, 0.051], Score(lower_is_better=True, least=0.0), (0.0, 0.06)),
        ([0.0, 0.0], Score(lower_is_better=True, least=0.0), (0.0, 1.0)),
    ],
)
def test_an_axis_keeps_to_what_a_score_can_be(values: list[float], score: Score, axis: tuple[float, float]) -> None:
    found = Axis.of(values, score)

    assert (found.low, found.high) == pytest.approx(axis)
    assert [found.percent(axis[0]), found.percent(axis[1])] == [0, 100]


@given(st.lists(st.floats(-1e9, 1e9), max_size=5))
def test_every_value_lies_on_the_axis(values: list[float]) -> None:
    axis = Axis.of(values)

    assert axis.low < axis.high
    assert all(0 <= axis.percent(value) <= 100 for value in [0.0, *values])
    assert axis.low <= min([0.0, *values]) + 1e-6 * (axis.high - axis.low)
    assert [percent for percent, _ in axis.ticks] == pytest.approx([0, 25, 50, 75, 100])


def test_names_are_sorted_as_people_do() -> None:
    assert sorted(["house:10", "house:2", "flat:1", "house:2:10", "house:2:3"], key=natural) == [
        "flat:1", "house:2", "house:2:3", "house:2:10", "house:10",
    ]  # fmt: skip
