"""How fast something goes, from counts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.watching.rates import Rates


@given(st.floats(0.0, 1e4), st.lists(st.floats(0.01, 1.0), min_size=2, max_size=200))
def test_a_steady_pace_is_told_whatever_the_moments(per_s: float, pauses_s: list[float]) -> None:
    rates, now_s = Rates(), 100.0
    assert rates.note(now_s, 0.0) == (0.0,)
    for pause_s in pauses_s:
        now_s += pause_s
        (found,) = rates.note(now_s, per_s * (now_s - 100.0))
    assert found == pytest.approx(per_s, rel=1e-6, abs=1e-6)


def test_what_stands_still_slows_to_nothing_and_what_begins_anew_is_not_negative() -> None:
    rates = Rates(window_s=3.0)
    rates.note(0.0, 0.0)
    assert rates.note(1.0, 10.0) == (10.0,)
    for now_s in range(2, 10):
        (found,) = rates.note(float(now_s), 10.0)
    assert found == 0.0
    assert rates.note(10.0, 1.0) == (0.0,)
    assert rates.note(11.0, 3.0) == (2.0,)
    # The same moment twice, as of something that is sampled once a second.
    assert rates.note(11.0, 3.0) == (2.0,)
