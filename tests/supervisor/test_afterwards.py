"""What an answer does not wait for: done once, in order, whoever does it."""

import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.supervisor.afterwards import Afterwards


@given(st.lists(st.booleans(), max_size=20))
def test_it_is_done_in_the_order_in_which_it_was_noted(settled: list[bool]) -> None:
    done: list[int] = []
    afterwards = Afterwards()
    for number, settle_now in enumerate(settled):
        afterwards.note(partial(done.append, number))
        if settle_now:
            afterwards.settle()
            assert done == list(range(number + 1))
    afterwards.settle()
    afterwards.settle()
    assert done == list(range(len(settled)))


def test_who_settles_waits_for_what_another_thread_does() -> None:
    afterwards, begun, go_on, done = Afterwards(), threading.Event(), threading.Event(), list[str]()

    def first() -> None:
        begun.set()
        go_on.wait(60)
        done.append("first")

    afterwards.note(first)
    afterwards.note(partial(done.append, "second"))
    with ThreadPoolExecutor() as executor:
        settling = executor.submit(afterwards.settle)
        begun.wait(60)
        other = executor.submit(afterwards.settle)
        assert not other.done()
        go_on.set()
        other.result()
        assert done == ["first", "second"]
        settling.result()


def test_what_fails_is_told_to_who_settles_and_keeps_nothing_else_from_being_done() -> None:
    done: list[str] = []
    afterwards = Afterwards()
    afterwards.note(partial(int, "no number"))
    afterwards.note(partial(done.append, "the rest"))
    with pytest.raises(ValueError, match="no number"):
        afterwards.settle()
    afterwards.settle()
    assert done == ["the rest"]
