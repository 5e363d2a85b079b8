from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from benchbot.supervisor.recording.messages import Ring
from benchbot.wire.arena import ALIGNMENT_BYTES, aligned

SIZE = 40 * ALIGNMENT_BYTES


@given(st.lists(st.one_of(st.none(), st.integers(0, SIZE + 1)), max_size=60))
def test_regions_never_overlap_and_an_empty_ring_holds_whatever_fits(orders: list[int | None]) -> None:
    """A number takes so many bytes, None gives the oldest region back."""
    ring, taken = Ring(SIZE), deque[tuple[int, int]]()
    for order in orders:
        if order is None:
            if taken:
                ring.give_back()
                taken.popleft()
            continue
        offset = ring.take(order)
        if offset is None:
            assert taken or aligned(order) > SIZE
            continue
        end = offset + max(aligned(order), ALIGNMENT_BYTES)
        assert 0 <= offset < end <= SIZE
        assert all(end <= start or offset >= stop for start, stop in taken)
        taken.append((offset, end))
    assert len(ring) == len(taken)


def test_a_ring_that_runs_empty_begins_again_and_so_touches_little_memory() -> None:
    ring = Ring(SIZE)
    for _ in range(100):
        assert ring.take(300) == 0
        ring.give_back()


def test_what_was_taken_last_can_be_let_go() -> None:
    ring = Ring(SIZE)
    first, second = ring.take(64), ring.take(64)
    ring.untake()
    assert (first, second, ring.take(SIZE)) == (0, 64, None)
    assert ring.take(64) == 64
