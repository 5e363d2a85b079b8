from hypothesis import given
from hypothesis import strategies as st

from benchbot_robot_ros2.instant import Stamped, joined, one_instant
from benchbot_robot_ros2.streams import Sample

stamps = st.lists(st.integers(0, 1000), unique=True, max_size=8).map(sorted)


def _samples(stamps_ns: list[int]) -> list[Sample]:
    return [Sample(stamp_ns, stamp_ns, 0.0, None) for stamp_ns in stamps_ns]


def _series(stamps_ns: list[int]) -> list[Stamped]:
    return joined({"": _samples(stamps_ns)})


def test_parts_are_joined_where_their_stamps_are_equal() -> None:
    found = joined({"class": _samples([1, 2, 4]), "instance": _samples([2, 3, 4])})

    assert [stamp for stamp, _ in found] == [2, 4]
    assert all({sample.stamp_ns for sample in parts.values()} == {stamp} for stamp, parts in found)
    assert joined({}) == []


def test_the_earliest_instant_is_chosen() -> None:
    series = {"slow": _series([100, 300]), "fast": _series([40, 80, 130, 290, 310])}

    chosen = one_instant(series, 30)

    assert chosen is not None
    assert {name: stamp for name, (stamp, _) in chosen.items()} == {"slow": 100, "fast": 80}


@given(st.lists(stamps, min_size=1, max_size=4), st.integers(0, 200))
def test_an_instant_is_found_exactly_when_there_is_one(lists: list[list[int]], tolerance: int) -> None:
    chosen = one_instant({number: _series(stamps_ns) for number, stamps_ns in enumerate(lists)}, tolerance)

    windows = (first for stamps_ns in lists for first in stamps_ns)
    possible = any(all(any(first <= s <= first + tolerance for s in other) for other in lists) for first in windows)
    assert (chosen is not None) == possible
    if chosen is not None:
        found = [stamp for stamp, _ in chosen.values()]
        assert max(found) - min(found) <= tolerance


def test_nothing_asked_for_is_there_at_once() -> None:
    assert one_instant({}, 0) == {}
