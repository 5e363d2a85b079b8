import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

import benchbot
from benchbot import emergency_stop
from benchbot.core.request import RunRequest
from benchbot.supervisor.backend import Backend
from benchbot.wire.run_state import RunState, live, runs_dir
from tests.command_line import CommandLine, Finished, Here, wait_for
from tests.supervisor.harness import eventually

MOVES = """\
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.step("move_angle", angle=36000)
"""
"""Turns for a minute where every control tick takes as long as it says."""


LIGHT = "import sys; sys.path.insert(0, sys.argv.pop(1)); from benchbot.emergency_stop import main; sys.exit(main())"
"""The program `benchbot-stop`, for an interpreter without anything that is installed."""


def light(cli: CommandLine, *words: str) -> Finished:
    """Run `benchbot-stop` with the standard library alone."""
    command = [sys.executable, "-S", "-E", "-c", LIGHT, str(Path(benchbot.__file__).parents[1]), *words]
    return subprocess.run(command, capture_output=True, text=True, env=cli.variables, timeout=60, check=False)


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
        assert "No run of yours is there to stop." in done.stderr


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
    assert "stopped by its user (benchbot stop)." in failure["why"]
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


def test_the_light_program_stops_what_the_command_does_with_the_standard_library_alone(
    cli: CommandLine, states: Callable[[], list[RunState]]
) -> None:
    nothing = light(cli)
    back_end = start_run(cli, "faulty:halts")
    (state,) = states()
    solution = cli.start("submit", "--native", cli.script("moves.py", MOVES), "-r", "result.json")
    wait_for(solution, "Sending action")
    other, wrong, unknown = light(cli, "--run", "no-such-run"), light(cli, "--hurry"), light(cli, "--run")
    assert [state.pid for state in states()] == [back_end.pid]
    done = light(cli)

    assert (nothing.returncode, other.returncode, wrong.returncode, unknown.returncode) == (2, 2, 2, 2)
    assert "Error: No run of yours is there to stop." in nothing.stderr
    assert f"No run is called 'no-such-run'.\n\n  Alive are: {state.name}." in other.stderr
    assert wrong.stderr == unknown.stderr == f"{emergency_stop.USAGE}\n"
    assert (done.returncode, done.stderr) == (0, f"The run {state.about}, is ending.\n")
    assert back_end.wait(30) == 0
    assert solution.wait(30) == 3
    failure = json.loads((cli.folder / "result.json").read_text("utf-8"))["provenance"]["failure"]
    assert failure["class"] == "platform"
    assert "stopped by its user (benchbot-stop)." in failure["why"]
    assert light(cli, "--help").stdout == f"{emergency_stop.USAGE}\n"


def test_the_light_program_stops_a_run_in_a_socket_and_one_that_the_environment_names(
    cli: CommandLine, states: Callable[[], list[RunState]]
) -> None:
    words = ["--task", "sample:active", "--robot", "sample_robot", "--env", "arena:1"]
    in_socket = cli.start("run", *words, "--unix-socket", str(cli.home / "s"))
    wait_for(in_socket, "Ready.")
    newest = start_run(cli)
    _, older = states()
    cli.variables["BENCHBOT_SOCKET"] = str(cli.home / "s")
    assert light(cli).returncode == 2  # it needs the token
    cli.variables["BENCHBOT_TOKEN"] = older.connection.token

    assert "is ending" in light(cli).stderr
    assert in_socket.wait(30) == 0
    gone = light(cli)
    assert gone.returncode == 2
    assert "does not answer" in gone.stderr
    for name in ("BENCHBOT_SOCKET", "BENCHBOT_TOKEN"):
        del cli.variables[name]
    assert newest.poll() is None
    assert "is ending" in light(cli, "--all").stderr
    assert newest.wait(30) == 0


@pytest.mark.parametrize("variable", ["BENCHBOT_STATE_DIR", "XDG_STATE_HOME", "HOME"])
def test_the_light_program_looks_where_runs_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str) -> None:
    for name in ("BENCHBOT_STATE_DIR", "XDG_STATE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(variable, str(tmp_path))
    assert emergency_stop.runs_dir() == runs_dir()
