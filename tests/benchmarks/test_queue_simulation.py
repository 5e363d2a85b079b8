"""How fairness is measured: by the share that each could have had of what it asks for."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.queue_simulation import jain, max_min_shares


def test_who_asks_for_little_gets_it_and_the_others_share_the_rest_alike() -> None:
    assert max_min_shares([1, 10, 4, 10], 15) == [1, 5, 4, 5]
    assert jain([1, 10, 1, 1]) < jain([1, 1, 1, 1]) == 1
    assert jain([5, 0, 0, 0]) == pytest.approx(1 / 4)


@given(st.lists(st.integers(1, 1000), min_size=1), st.integers(0, 5000))
def test_shares_are_max_min_fair(asked: list[int], capacity: int) -> None:
    shares = max_min_shares(asked, capacity)
    assert sum(shares) == pytest.approx(min(capacity, sum(asked)))
    largest = max(shares)
    for share, ask in zip(shares, asked, strict=True):
        assert share == pytest.approx(ask) or share == pytest.approx(largest)  # whoever lacks something has the most
        assert share <= ask + 1e-9
