from collections.abc import Mapping
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.progress import Progress, State, Step
from benchbot.core.session import Session
from tests.core.test_session import RailHost, selection

PUSHED = "move_distance {'distance': 1.0}"


class Tape:
    """A recording that runs out after a number of steps, and tells what happened to it."""

    def __init__(self, steps: int = 99, *, tears: bool = False) -> None:
        self.left = steps
        self.tears = tears
        self.told: list[str] = []

    def reset(self) -> None:
        self.told.append("reset")

    def step(self, action: str | None, arguments: Mapping[str, Any], step: Step, progress: Progress) -> None:
        self.left -= 1
        if self.left < 0:
            raise BenchbotError("The tape is full.", "It was short.", "Buy.", failure=FailureClass.INFRASTRUCTURE)
        self.told.append(f"{action} {dict(arguments)}" if arguments else str(action))

    def close(self) -> None:
        self.told.append("close")
        if self.tears:
            raise BenchbotError("The tape is torn.", "It was old.", "Buy.", failure=FailureClass.INFRASTRUCTURE)


def test_a_recording_is_told_of_everything_in_order() -> None:
    tape = Tape()
    ride = Session(selection("move_distance"), RailHost, [tape])
    ride.reset()
    ride.step("move_distance", {"distance": 1.0})
    ride.step(None)
    ride.close()
    assert tape.told == ["reset", "None", PUSHED, "None", "close"]


def test_a_recording_that_fails_ends_and_the_episode_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    short, long = Tape(steps=1), Tape()
    ride = Session(selection("move_distance"), RailHost, [short, long])
    ride.reset()
    ride.step("move_distance", {"distance": 1.0})
    ride.step(None)
    assert (ride.progress.state, ride.progress.failure) == (State.DIRTY, None)
    assert short.told == ["reset", "None", "close"]
    assert long.told == ["reset", "None", PUSHED, "None"]
    assert "The tape is full. It was short." in caplog.text.replace("\n", " ")


def test_a_recording_joins_a_session_and_leaves_it() -> None:
    first, second = Tape(), Tape()
    ride = Session(selection("move_distance"), RailHost, [first])
    ride.reset()
    ride.join(second)
    ride.step(None)
    ride.leave(first)
    ride.step("move_distance", {"distance": 1.0})
    ride.close()
    assert first.told == ["reset", "None", "None"]
    assert second.told == ["None", PUSHED, "close"]


def test_a_recording_that_cannot_be_finished_keeps_no_other_from_it_nor_the_host(
    caplog: pytest.LogCaptureFixture,
) -> None:
    host, tapes = RailHost(), [Tape(), Tape(tears=True), Tape()]
    ride = Session(selection("move_distance"), lambda: host, tapes)
    ride.reset()
    ride.close()
    assert "torn" in caplog.text
    assert host.closed
    assert all(tape.told[-1] == "close" for tape in tapes)
