import json
from collections.abc import Callable
from pathlib import Path

import pytest

from benchbot.wire.run_state import RunState, live
from tests.command_line import CommandLine, Here, wait_for

SELECTION = ["--task", "sample:passive", "--robot", "sample_robot", "--env", "faulty:asks"]

NOSY = """\
import json, os
from benchbot.api import BenchBot
print("variables:", json.dumps(dict(os.environ)), flush=True)
benchbot = BenchBot()
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""


@pytest.fixture
def states(cli: CommandLine, monkeypatch: pytest.MonkeyPatch) -> Callable[[], list[RunState]]:
    """Tells the runs that are alive."""
    monkeypatch.setenv("BENCHBOT_STATE_DIR", cli.variables["BENCHBOT_STATE_DIR"])
    return live


def test_a_robot_waits_for_its_operator_and_goes_on_when_they_are_ready(
    cli: CommandLine, states: Callable[[], list[RunState]]
) -> None:
    solution = cli.script("nosy.py", NOSY)
    process = cli.start("submit", "--native", solution, *SELECTION, "--timeout", "30", "-r", "result.json")
    variables = json.loads(wait_for(process, "variables:").partition(":")[2])
    asked = wait_for(process, "WAITING FOR YOU")
    (state,) = states()

    done = cli("ready")

    assert "Carry the robot to its start. When it is done, type elsewhere: benchbot ready" in asked
    assert (done.returncode, done.stderr) == (0, "Done: Carry the robot to its start.\n")
    assert process.wait(60) == 0
    assert state.connection.token in variables.values()
    assert state.operator_token not in variables.values()
    assert json.loads(Path(cli.folder / "result.json").read_text())["provenance"]["failure"] is None
    assert cli.nothing_is_left()


def test_the_terminal_of_the_run_says_what_is_to_be_done(cli: CommandLine) -> None:
    back_end = cli.start("run", *SELECTION, "--port", "0")
    wait_for(back_end, "Ready.")
    assert cli("ready").returncode == 2
    solution = cli.start("submit", "--native", cli.script("nosy.py", NOSY), "-r", "result.json")
    wait_for(back_end, "WAITING FOR YOU: Carry the robot to its start.")

    assert cli("ready").returncode == 0
    assert solution.wait(60) == 0
    assert cli("stop").returncode == 0
    assert back_end.wait(30) == 0


def test_a_run_that_waits_for_its_operator_can_be_stopped(cli: CommandLine) -> None:
    process = cli.start("submit", "--native", cli.script("nosy.py", NOSY), *SELECTION, "-r", "result.json")
    wait_for(process, "WAITING FOR YOU")

    assert cli("stop").returncode == 0
    assert process.wait(60) == 3
    assert cli.nothing_is_left()


def test_nobody_waits(here: Here) -> None:
    done = here("ready")

    assert done.returncode == 2
    assert "Error: No run waits for you." in done.stderr


def test_of_two_that_wait_one_is_named(cli: CommandLine, states: Callable[[], list[RunState]]) -> None:
    solution = cli.script("nosy.py", NOSY)
    waiting = [cli.start("submit", "--native", solution, *SELECTION, "-r", f"{number}.json") for number in (0, 1)]
    for process in waiting:
        wait_for(process, "WAITING FOR YOU")
    newest, oldest = states()

    unclear = cli("ready")
    done = cli("ready", "--run", oldest.name), cli("ready")

    assert unclear.returncode == 2
    assert "Error: 2 runs wait for you." in unclear.stderr
    assert newest.about in unclear.stderr
    assert oldest.about in unclear.stderr
    assert [each.returncode for each in done] == [0, 0]
    assert [process.wait(60) for process in waiting] == [0, 0]
