"""Which run a submission joins, and who else may act in it meanwhile."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack

import httpx
import pytest

from benchbot.core.request import RunRequest
from benchbot.supervisor.backend import Backend
from benchbot.wire import joining, run_state
from benchbot.wire.run_state import RunState
from tests.cli.solutions import PASSIVE
from tests.cli.submitted import SELECTION, read
from tests.command_line import CommandLine, ended, wait_for

BATCH = "benchbot batch /a/batch"
HELD = f"""\
import pathlib, time
pathlib.Path("begun").touch()
while not pathlib.Path("go").exists():
    time.sleep(0.05)
{PASSIVE}"""
"""Does not go on before there is a file `go`."""
DYING = """\
import os
from benchbot.api import BenchBot
BenchBot().step("move_next")
os.kill(0, 9)
"""


@pytest.fixture(autouse=True)
def _of_the_same_user(cli: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR"):
        monkeypatch.setenv(name, cli.variables[name])


@pytest.fixture
def theirs() -> Iterator[RunState]:
    """A back end that a batch has started."""
    with ExitStack() as stack:
        start = Backend.start(RunRequest("sample:passive", "sample_robot", "arena:2"), owner=BATCH)
        yield stack.enter_context(start).state


def start_run(cli: CommandLine) -> "subprocess.Popen[str]":
    process = cli.start("run", *SELECTION, "--port", "0")
    wait_for(process, "Ready.")
    return process


def by_hand(cli: CommandLine, script: str, **variables: str) -> "subprocess.CompletedProcess[str]":
    """Run a solution as `python solution.py`."""
    return subprocess.run(
        [sys.executable, script.split()[1]],
        cwd=cli.folder,
        env={**cli.variables, **variables},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


def test_a_submission_joins_a_run_says_which_and_never_what_a_batch_has_started(
    cli: CommandLine, theirs: RunState
) -> None:
    solution = cli.script("solution.py", PASSIVE)

    alone = cli("submit", "--native", solution, "-r", "alone.json"), by_hand(cli, solution)
    back_end = start_run(cli)
    dry = cli("submit", "--native", solution, "--dry-run")
    joined = cli("submit", "--native", solution, "-r", "joined.json")
    named = cli("submit", "--native", solution, "--run", theirs.name)

    for refused in alone:
        assert refused.returncode != 0
        assert "No BenchBot run is there to connect to." in refused.stderr
        assert f"of {BATCH}: sample:passive on sample_robot in arena:2" in refused.stderr
    assert not (cli.folder / "alone.json").exists()
    (ours,) = (state for state in run_state.live() if state.owner == run_state.RUN)
    said = f"Joins {ours.name} of benchbot run: sample:passive on sample_robot in arena:1, {ours.connection.url}"
    assert f"{said}, process {back_end.pid}, since 20" in dry.stderr
    assert said in joined.stderr
    assert (dry.returncode, joined.returncode) == (0, 0), joined.stderr
    assert read(cli.folder / "joined.json")["provenance"]["selection"]["environment"] == "arena:1"
    assert named.returncode == 2
    assert f"{theirs.about} lets in its own solutions only." in named.stderr


def test_a_guessed_address_without_its_token_moves_no_robot(cli: CommandLine, theirs: RunState) -> None:
    url = theirs.connection.url
    assert url is not None

    guessed = by_hand(cli, cli.script("solution.py", PASSIVE), BENCHBOT_URL=url)

    assert "The supervisor does not know you." in guessed.stderr
    answers = {httpx.post(f"{url}/api/v1/{route}").status_code for route in ("reset", "step", "stop", "result")}
    answers |= {httpx.get(f"{url}/connections/robot/reset").status_code}
    assert answers <= {401, 404, 405}
    headers = {"Authorization": f"Bearer {theirs.connection.token}", "Accept": "application/json"}
    with httpx.Client(headers=headers) as its_own:
        assert its_own.get(f"{url}/api/v1/session").json()["progress"]["steps"] == 0


def test_of_two_runs_one_is_named(cli: CommandLine) -> None:
    solution = cli.script("solution.py", PASSIVE)
    first, second = start_run(cli), start_run(cli)
    states = {state.pid: state for state in run_state.live()}

    unclear = cli("submit", "--native", solution), by_hand(cli, solution)
    chosen = cli("submit", "--native", solution, "--run", states[first.pid].name, "-r", "result.json")
    addressed = by_hand(cli, solution, BENCHBOT_RUN=states[second.pid].name)
    stopped = cli("stop", "--run", states[first.pid].name)

    for refused in unclear:
        assert "It is not clear which run is meant: 2 are there." in refused.stderr
        assert all(state.name in refused.stderr for state in states.values())
        assert f"--run {states[second.pid].name}" in refused.stderr
        assert f"BENCHBOT_RUN={states[second.pid].name}" in refused.stderr
    assert chosen.returncode == 0, chosen.stderr
    assert f"Joins {states[first.pid].name} " in chosen.stderr
    assert addressed.returncode == 0, addressed.stderr
    assert f"It goes on: {states[second.pid].about}\n" in stopped.stderr
    assert ended(first) == 0
    assert second.poll() is None


def test_who_comes_to_a_robot_that_is_taken_is_refused_and_the_solution_there_does_not_notice(
    cli: CommandLine,
) -> None:
    start_run(cli)
    (state,) = run_state.live()
    solution = cli.script("solution.py", HELD)
    under_way = cli.start("submit", "--native", solution, "-r", "first.json")
    wait_for(under_way, "nothing observed yet")

    refused = [
        cli("submit", "--native", solution, "-r", "second.json"),
        cli("submit", "--native", solution, "-r", "second.json", **state.connection.environment()),
        cli("submit", "--native", solution, "--dry-run"),
        by_hand(cli, cli.script("other.py", PASSIVE)),
    ]
    headers = {"Authorization": f"Bearer {state.connection.token}", "Content-Type": "application/json"}
    with httpx.Client(base_url=f"{state.connection.url}/api/v1/", headers=headers) as http:
        moves = [http.post(route, json={}) for route in ("reset", "step", "next_scene", "stop")]
        failure = {"failure": {"class": "agent", "why": "The robot is busy."}}
        moves.append(http.post("result", json=failure))
        looked = http.get("session")
    (cli.folder / "go").touch()
    assert ended(under_way) == 0
    again = cli("submit", "--native", solution, "-r", "again.json")

    for done in refused:
        assert done.returncode != 0
        assert "The robot is taken: a solution is connected to this run." in done.stderr
        assert f"Process {under_way.pid}, since" in done.stderr
        assert "benchbot run --port 0" in done.stderr
    assert {done.returncode for done in refused[:3]} == {2}
    assert not (cli.folder / "second.json").exists()
    assert [answer.status_code for answer in moves] == [409] * 5
    assert {answer.json()["title"] for answer in moves} == {"The robot is taken: a solution is connected to this run."}
    assert looked.status_code == 200
    first = read(cli.folder / "first.json")["provenance"]
    assert (first["failure"], first["restarts"], first["steps"]) == (None, 0, 3)
    assert again.returncode == 0, again.stderr
    assert (cli.folder / "again.json").read_bytes() == (cli.folder / "first.json").read_bytes()


def test_a_solution_that_is_killed_leaves_the_robot_to_the_next(cli: CommandLine) -> None:
    start_run(cli)
    solution = cli.script("solution.py", HELD)
    under_way = cli.start("submit", "--native", solution)
    wait_for(under_way, "nothing observed yet")
    os.killpg(under_way.pid, 9)
    under_way.wait()
    (cli.folder / "go").touch()

    done = cli("submit", "--native", solution, "-r", "result.json", "--json")

    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["provenance"]["failure"] is None


def test_a_run_and_a_back_end_of_ones_own_exclude_each_other(cli: CommandLine) -> None:
    done = cli("submit", "--native", "true", "--run", "1", *SELECTION)
    assert done.returncode == 2
    assert "--run and --task exclude each other." in done.stderr


def test_what_a_solution_has_spent_is_not_for_the_next_one_to_pay(cli: CommandLine) -> None:
    dying = cli.script(
        "dying.py", 'import os\nfrom benchbot.api import BenchBot\nBenchBot().step("move_next")\nos.kill(0, 9)'
    )
    process = cli.start("run", *SELECTION, "--port", "0", "--max-steps", "3", "--max-restarts", "0")
    wait_for(process, "Ready.")

    killed = subprocess.run(
        [sys.executable, dying.split()[1]], cwd=cli.folder, env=cli.variables, check=False, start_new_session=True
    )
    joined = cli("submit", "--native", cli.script("agent.py", PASSIVE), "-r", "result.json")
    cli("stop")
    ended(process)

    assert killed.returncode == -9
    assert joined.returncode == 0, joined.stderr
    provenance = read(cli.folder / "result.json")["provenance"]
    assert (provenance["failure"], provenance["restarts"], "spent" in provenance) == (None, 0, False)


def test_a_solution_that_fails_before_it_begins_has_done_nothing_that_the_one_before_did(cli: CommandLine) -> None:
    start_run(cli)
    wrong = 'from benchbot.api import BenchBot\nBenchBot().step("fly")'
    for name, code in {"good": PASSIVE, "wrong": wrong, "broken": "import sys; sys.exit(7)"}.items():
        cli("submit", "--native", cli.script(f"{name}.py", code), "-r", f"{name}.json")

    good, wrong_one, broken = (read(cli.folder / f"{name}.json")["provenance"] for name in ("good", "wrong", "broken"))

    assert (good["failure"], wrong_one["failure"]["class"]) == (None, "agent")
    assert good["steps"] > 0
    assert wrong_one["steps"] == 0
    assert "exit status 7" in broken["failure"]["why"]
    assert (broken["steps"], broken["restarts"]) == (0, 0)


def test_a_submission_waits_while_a_run_starts_and_no_longer(cli: CommandLine) -> None:
    with joining.starting(), joining.starting():  # two at once
        waiting = cli.start("submit", "--example", "hello_passive", "--display", "plain")
        told = wait_for(waiting, "A run is starting.")
        assert joining.is_starting()

    assert not joining.is_starting()
    assert "Waiting for it: 180 s at most" in told
    assert ended(waiting) == 2
    assert waiting.stderr is not None
    assert "No BenchBot run is there to connect to." in waiting.stderr.read()


def test_waiting_for_a_run_ends_at_ctrl_c(cli: CommandLine) -> None:
    with joining.starting():
        waiting = cli.start("submit", "--example", "hello_passive", "--display", "plain")
        wait_for(waiting, "A run is starting.")
        waiting.send_signal(signal.SIGINT)
        assert ended(waiting) == 130


def test_a_run_that_is_there_is_joined_though_another_one_starts(cli: CommandLine) -> None:
    solution = cli.script("solution.py", PASSIVE)
    start_run(cli)

    with joining.starting():
        assert cli("submit", "--native", solution).returncode == 0
