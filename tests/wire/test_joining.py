import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.wire import joining, run_state
from benchbot.wire.run_state import RUN, SUBMIT, Connection, RunFolder, RunState
from tests.wire.test_run_state import state_of

BATCH = "benchbot batch /somewhere"
Publish = Callable[..., RunState]

JOINS = "from benchbot.wire import joining; print(joining.find().token, flush=True); input()"


@pytest.fixture
def publish() -> Iterator[Publish]:
    """Publishes runs that are alive until the end of the test."""
    with ExitStack() as stack:

        def publish(owner: str = RUN, url: str | None = None, socket: str | None = None) -> RunState:
            folder = RunFolder()
            stack.callback(folder.close, keep=False)
            state = state_of(folder, owner=owner, connection=Connection(url, socket, f"token of {folder.path.name}"))
            folder.publish(state)
            return state

        yield publish


def joined(state: RunState, connection: Connection) -> bool:
    """Say whether a connection has the lease of a run: its address, and a token of its own."""
    lease = joining.lease_of(Path(state.folder))
    same_place = (connection.url, connection.socket) == (state.connection.url, state.connection.socket)
    return lease is not None and same_place and connection.token == lease.token != state.connection.token


def joins() -> "subprocess.Popen[str]":
    """Start a program that joins a run, and ends with its input."""
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", JOINS], text=True, stdin=pipe, stdout=pipe, stderr=pipe)


def test_the_only_run_is_found_and_no_back_end_that_something_else_has_started(publish: Publish) -> None:
    for owner in (BATCH, SUBMIT, "benchbot reproduce", "a program"):
        publish(owner)
    with pytest.raises(BenchbotError, match="No BenchBot run is there") as caught:
        joining.find()
    assert BATCH in caught.value.why
    assert "benchbot run --task" in caught.value.fix

    state = publish(url="http://127.0.0.1:1")
    assert joined(state, joining.find())


def test_without_a_run_one_is_told_how_to_start_it() -> None:
    with pytest.raises(BenchbotError) as caught:
        joining.find()
    assert "its own solutions only" not in caught.value.why
    assert "benchbot run" in caught.value.fix


def test_a_run_that_was_not_published_is_not_found() -> None:
    folder = RunFolder()
    with pytest.raises(BenchbotError, match="No BenchBot run"):
        joining.find()
    folder.close(keep=False)


def test_of_two_runs_none_is_guessed_and_both_are_named(publish: Publish, monkeypatch: pytest.MonkeyPatch) -> None:
    states = [publish(url="http://127.0.0.1:1"), publish(socket="/run/s")]
    with pytest.raises(BenchbotError, match="not clear which run is meant") as caught:
        joining.find()
    for state in states:
        assert state.name in caught.value.why
    assert f"--run {states[1].name};" in caught.value.fix
    assert f"BENCHBOT_RUN={states[1].name}" in caught.value.fix
    assert [joining.chosen(state.name[-8:]) for state in states] == states
    monkeypatch.setenv("BENCHBOT_RUN", states[0].name)
    assert joined(states[0], joining.find())


def test_a_name_must_be_that_of_one_run_to_join(publish: Publish) -> None:
    theirs, _ = publish(BATCH), publish()
    with pytest.raises(BenchbotError, match="No BenchBot run is there") as caught:
        joining.chosen(theirs.name)
    assert BATCH in caught.value.why
    with pytest.raises(BenchbotError, match="No run is called 'atlantis'"):
        joining.chosen("atlantis")
    with pytest.raises(BenchbotError, match="Several runs are called '-'"):
        joining.chosen("-")


def test_the_environment_comes_first(publish: Publish, monkeypatch: pytest.MonkeyPatch) -> None:
    publish()
    there = Connection("http://127.0.0.1:9", "/run/socket", "token")
    for name, value in there.environment().items():
        monkeypatch.setenv(name, value)
    assert joining.find() == there


def test_an_address_without_a_token_is_not_that_of_whoever_is_alive(
    publish: Publish, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish(BATCH, url="http://127.0.0.1:1")
    publish(url="http://127.0.0.1:2")
    monkeypatch.setenv("BENCHBOT_URL", "http://127.0.0.1:1")
    assert joining.find() == Connection("http://127.0.0.1:1", None, "")


def test_a_run_is_joined_at_another_address_too(publish: Publish, monkeypatch: pytest.MonkeyPatch) -> None:
    state = publish(url="http://127.0.0.1:1")
    there = joining.find("http://localhost:1")
    lease = joining.lease_of(Path(state.folder))
    assert lease is not None
    assert there == Connection("http://localhost:1", None, lease.token)
    monkeypatch.setenv("BENCHBOT_TOKEN", "given")
    assert joining.find("http://localhost:1").token == "given"


def test_one_solution_at_a_time_has_the_robot_until_its_process_ends(publish: Publish) -> None:
    state = publish(url="http://127.0.0.1:1")
    first = joins()
    assert first.stdout is not None
    token = first.stdout.readline().strip()
    lease = joining.lease_of(Path(state.folder))
    assert lease is not None
    assert (lease.pid, lease.token) == (first.pid, token)
    with pytest.raises(BenchbotError, match="The robot is taken") as caught:
        joining.find()
    assert f"Process {first.pid}, since" in caught.value.why
    assert "benchbot run --port 0" in caught.value.fix

    first.kill()
    first.communicate()
    assert joining.lease_of(Path(state.folder)) is None
    again = joining.find()
    assert joined(state, again)
    assert joining.find() == again, "the same process again"


def test_those_who_look_whether_it_is_taken_keep_nobody_out(publish: Publish) -> None:
    state = publish()
    looking = subprocess.Popen(
        [sys.executable, "-c", f"from benchbot.wire.joining import *\nwhile True: lease_of(Path({state.folder!r}))"]
    )
    try:
        for _ in range(5):
            done = joins().communicate("\n")
            assert done[0].strip(), done[1]
    finally:
        looking.kill()
        looking.wait()


def test_a_lease_that_is_just_being_written_is_one(publish: Publish) -> None:
    state = publish()
    joining.join(state)
    (Path(state.folder) / run_state.LEASE_FILE).write_text("{")
    lease = joining.lease_of(Path(state.folder))
    assert lease is not None
    assert lease.token


def test_a_run_that_ends_just_then_is_told() -> None:
    folder = RunFolder()
    state = state_of(folder)
    folder.publish(state)
    folder.close(keep=False)
    with pytest.raises(BenchbotError, match="The run has ended") as caught:
        joining.join(state)
    assert state.name in caught.value.why
