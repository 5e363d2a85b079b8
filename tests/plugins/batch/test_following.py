"""Looking on at a batch can be ended at any moment."""

import signal

import pytest

from benchbot.cli.kit.console import interrupting
from benchbot.plugins.batch.following import uninterrupted


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_waits_for_what_would_lose_it(number: signal.Signals) -> None:
    done = []

    def score() -> None:
        with interrupting():
            with uninterrupted():
                signal.raise_signal(number)
                signal.raise_signal(number)
                done.append("imported")
            done.append("went on")

    with pytest.raises(KeyboardInterrupt):
        score()
    assert done == ["imported"]


def test_without_an_interrupt_nothing_changes() -> None:
    before = signal.getsignal(signal.SIGINT)
    with uninterrupted():
        pass
    assert signal.getsignal(signal.SIGINT) is before
