import json
import os
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from benchbot.core.request import RunRequest
from benchbot.supervisor.backend import Backend
from benchbot.wire.run_state import RunState, live
from tests.command_line import CommandLine, Here, wait_for
from tests.supervisor.harness import eventually

MOVES = """\
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.step("move_angle", angle=36000)
"""
"""Turns for a minute where every control tick takes as long as it says."""


def start_run(cli: CommandLine, environment: str = "arena:1") -> "subprocess.Popen[str]":
    words = ["--task", "sample:active", "--robot", "sample_robot", "--env", environment, "--port", "0"]
    process = cli.start("run", *words)
    wait_for(process, "Ready.")
    return process


@pytest.fixture
def states(cli: CommandLine, monkeypatch: pytest.MonkeyPatch) -> Callable[[], list[RunState]]:
    """Tells the runs that are alive, newest first."""
    monkeypatch.setenv("BENCHBOT_STATE_DIR", cli.variables["BENCHBOT_STATE_DIR"])
    return live


def test_there_is_nothing_to_stop(here: Here) -> None:
    for words in (["stop"], ["stop", "--all"]):
        done = here(*words)

        assert done.returncode == 2
        assert "No BenchBot run is there" in done.stderr


def test_a_robot_in_the_middle_of_an_action_is_stopped(cli: CommandLine) -> None:
    back_end = start_run(cli, "faulty:halts")
    solution = cli.start("submit", "--native", cli.script("moves.py", MOVES), "-r", "result.json")
    wait_for(solution, "Sending action")

    done = cli("stop")

    assert done.returncode == 0
    assert "is ending" in done.stderr
    assert back_end.wait(30) == 0
    assert solution.wait(30) == 3
    failure = json.loads((cli.folder / "result.json").read_text("utf-8"))["provenance"]["failure"]
    assert failure["class"] == "platform"
    assert "stopped by its user" in failure["why"]
    assert cli.nothing_is_left()


def test_the_newest_run_is_stopped_or_all_of_them(cli: CommandLine, states: Callable[[], list[RunState]]) -> None:
    runs = [start_run(cli) for _ in range(3)]
    newest, *older = states()

    assert cli("stop").returncode == 0
    assert runs[2].wait(30) == 0
    assert [state.pid for state in states()] == [state.pid for state in older]
    assert newest.pid == runs[2].pid
    done = cli("stop", "--all")

    assert done.returncode == 0
    assert done.stderr.count("is ending") == 2
    assert [run.wait(30) for run in runs] == [0, 0, 0]
    assert cli.nothing_is_left()


def test_a_run_that_does_not_answer_is_ended_by_force_and_holds_up_no_other(cli: CommandLine) -> None:
    hanging, well = start_run(cli), start_run(cli)
    os.kill(hanging.pid, signal.SIGSTOP)

    done = cli("stop", "--all")

    assert done.returncode == 0
    assert "did not answer, and was killed." in done.stderr
    assert hanging.wait(30) == -signal.SIGKILL
    assert well.wait(30) == 0
    assert cli.no_process_is_left()


def test_a_run_whose_terminal_takes_no_more_output_still_stops_its_robot(cli: CommandLine) -> None:
    back_end = start_run(cli, "faulty:halts")
    assert back_end.stderr is not None
    pipe = os.open(f"/proc/{back_end.pid}/fd/2", os.O_WRONLY | os.O_NONBLOCK)
    with suppress(BlockingIOError):
        while True:
            os.write(pipe, bytes(4096))
    os.close(pipe)
    solution = cli.start("submit", "--native", cli.script("moves.py", MOVES), "-r", "result.json")
    wait_for(solution, "Sending action")
    # It wants to say where the episode stands, and hangs in that; some kernels do not tell.
    waits_for = Path(f"/proc/{back_end.pid}/wchan")
    eventually(lambda: "pipe_write" in waits_for.read_text(), patience_s=3.0)

    assert cli("stop").returncode == 0
    assert solution.wait(30) == 3


def test_what_a_batch_has_started_is_stopped_only_by_its_name_or_with_all(
    cli: CommandLine, states: Callable[[], list[RunState]]
) -> None:
    ours = start_run(cli)
    wanted = RunRequest("sample:passive", "sample_robot", "arena:2")
    owner = "benchbot batch /a/batch"
    with Backend.start(wanted, owner=owner) as first, Backend.start(wanted, owner=owner) as second:
        plain = cli("stop")
        assert ours.wait(30) == 0
        again, named = cli("stop"), cli("stop", "--run", first.state.name)
        assert eventually(lambda: [state.name for state in states()] == [second.state.name])
        every = cli("stop", "--all")

        assert (plain.returncode, named.returncode, every.returncode) == (0, 0, 0)
        assert plain.stderr.endswith(f"It goes on: {owner}\n")
        assert again.returncode == 2
        assert "No run of yours is there to stop." in again.stderr
        assert f"benchbot stop --run {second.state.name}" in again.stderr
        for done, state in ((named, first.state), (every, second.state)):
            assert f"The run {state.about}, is ending." in done.stderr
        assert eventually(lambda: states() == [])
