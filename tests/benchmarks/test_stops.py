"""The table of how fast a robot stops: what its cells say."""

from hypothesis import given
from hypothesis import strategies as st

from benchmarks.bench_stops import BARS, EVENTS, NEVER_S, Measured, histogram, row, share


@given(st.lists(st.floats(0.1, 1e4), min_size=1, max_size=50))
def test_ninety_five_percent_of_all_values_are_at_most_so_large(values: list[float]) -> None:
    largest = share(values, 0.95)
    assert largest in values
    assert sum(value <= largest for value in values) >= 0.95 * len(values)
    assert sum(value < largest for value in values) < 0.95 * len(values)


def test_bars_show_each_tenth_of_the_longest_time() -> None:
    assert histogram([1.0]) == "·········█"
    assert histogram([0.5, 0.6, 5.0, 10.0]) == "█····" + BARS[4] + "···" + BARS[4]


def test_a_robot_that_drove_on_is_named() -> None:
    well, on = Measured(0.05, 0.25, 0.06), Measured(NEVER_S, NEVER_S, 1.6)
    assert row(EVENTS[0], [well]) == "| the driver is killed | 200 | 50 | 50 | 50 | ·········█ | 250, 250 | 60, 60 |"
    assert "**(1 drove on)**" in row(EVENTS[0], [well, on])
