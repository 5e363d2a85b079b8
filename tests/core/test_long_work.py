from hypothesis import given
from hypothesis import strategies as st

from benchbot.core import long_work
from benchbot.core.long_work import counted


@given(st.lists(st.integers(), max_size=5), st.integers(0, 6))
def test_items_are_yielded_and_counted_and_a_loop_that_is_left_is_not_under_way(items: list[int], wanted: int) -> None:
    loop = counted("Scoring results", items)
    taken = [item for item, _ in zip(loop, range(wanted), strict=False)]

    assert taken == items[:wanted]
    loop.close()  # type: ignore[attr-defined]
    assert long_work.under_way == []


def test_it_says_how_far_it_is_and_what_is_left() -> None:
    said = []
    for _ in counted("Scoring results", "abc"):
        (loop,) = long_work.under_way
        said.append(str(loop))
    loop.done, loop.total = 1, 100
    loop.started_s -= 10.0

    assert said[0] == "Scoring results: 0 of 3"
    assert said[2] == "Scoring results: 2 of 3, about 0 s left"
    assert str(loop) == "Scoring results: 1 of 100, about 990 s left"
