"""A real robot is diagnosed before it moves, whatever driver it has, and one that is broken is not moved."""

import signal
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest

from tests.cli.submitted import SELECTION, read
from tests.command_line import CommandLine, ended, wait_for

DRIVER = """\
import time
from importlib.resources import files
from pathlib import Path
from benchbot.plugin import Finding, Level, RobotDriver, hookimpl

JOURNAL = Path(r"{journal}")

def note(what):
    with JOURNAL.open("a") as file:
        file.write(what + "\\n")

def diagnose(spec):
    note("diagnosed")
    time.sleep({takes_s})
    yield Finding(Level.OK, "graph", "3 other nodes")
    yield Finding(Level.WARNING, "e-stop", "none is declared", "Declare one.")
    if {broken}:
        yield Finding(Level.BROKEN, "depth /depth", "half of it is beyond 1800 m", "Correct the encoding.")

def create(spec):
    from benchbot_sample.simulator import SampleSimulator

    class Driver(SampleSimulator):
        def load(self, scene, seed):
            note("moved")
            super().load(scene, seed)

        def provenance(self):
            return {{"middleware": "rmw_sample"}}

    return Driver(spec)

@hookimpl
def benchbot_robot_drivers():
    yield RobotDriver("seen", create, diagnose)

@hookimpl
def benchbot_robots():
    yield files(__name__) / "robots"
"""
SOLUTION = """
import json, os
from benchbot.api import BenchBot
benchbot = BenchBot()
for _ in range(2):
    benchbot.reset()
    benchbot.step("move_next")
with open(os.environ["BENCHBOT_RESULT"], "w") as file:
    json.dump(benchbot.empty_results(), file)
"""
SEEN = ["--task", "sample:passive", "--robot", "seen_robot", "--env", "arena:1"]
Robot = Callable[..., Callable[[], list[str]]]


@pytest.fixture
def robot(cli: CommandLine, make_plugin: Callable[..., Path]) -> Robot:
    """Makes a robot and its driver; what that was asked to do is returned by a function."""

    def make(*, broken: bool, takes_s: float = 0.0) -> Callable[[], list[str]]:
        journal = cli.folder / "journal"
        declared = (files("benchbot_sample") / "robots" / "sample_real_robot.yaml").read_text()
        declared = declared.replace("sample_real_robot", "seen_robot").replace("real_sample", "seen")
        make_plugin(
            "seen", DRIVER.format(journal=journal, broken=broken, takes_s=takes_s), {"robots/seen.yaml": declared}
        )
        return lambda: journal.read_text().splitlines() if journal.exists() else []

    return make


def test_a_broken_robot_is_refused_before_it_moves(cli: CommandLine, robot: Robot) -> None:
    done_by_driver = robot(broken=True)

    done = cli("submit", "--native", cli.script("s.py", SOLUTION), *SEEN, "-r", "result.json")

    assert done.returncode == 2
    assert "The robot 'seen_robot' is not fit to be driven." in done.stderr
    assert "depth /depth: half of it is beyond 1800 m" in done.stderr
    assert "Correct the encoding." in done.stderr
    assert "--despite 'depth /depth'" in done.stderr
    assert done_by_driver() == ["diagnosed"]
    assert not (cli.folder / "result.json").exists()
    assert cli.nothing_is_left()


def test_a_finding_that_is_overridden_is_in_the_result(cli: CommandLine, robot: Robot) -> None:
    done_by_driver = robot(broken=True)

    done = cli(
        "submit",
        *("--native", cli.script("s.py", SOLUTION), *SEEN, "-r", "result.json", "--display", "plain"),
        *("--despite", "depth /depth", "--record", "steps"),
    )

    assert done.returncode == 0, done.stderr
    assert "broken       depth /depth: half of it is beyond 1800 m" in done.stderr
    assert "warning      e-stop: none is declared" in done.stderr
    assert "3 other nodes" not in done.stderr
    provenance = read(cli.folder / "result.json")["provenance"]
    assert provenance["robot_time_s"] > 0
    assert provenance["spent"]["robot_time_s"] > provenance["robot_time_s"]
    assert not {"simulated_time_s"} & {*provenance, *provenance["spent"]}
    assert "simulated" not in done.stderr
    assert provenance["robot"] == {
        "despite": ["depth /depth"],
        "findings": [
            {"level": "ok", "name": "graph", "text": "3 other nodes"},
            {"level": "warning", "name": "e-stop", "text": "none is declared"},
            {"level": "broken", "name": "depth /depth", "text": "half of it is beyond 1800 m"},
        ],
        "driver": {"middleware": "rmw_sample"},
    }
    assert done_by_driver() == ["diagnosed", "moved", "moved"]
    (recorded,) = (cli.folder / "result-recordings" / "steps").glob("*.jsonl")
    assert '"robot_time_s"' in recorded.read_text()
    assert "simulated" not in recorded.read_text()


def test_a_run_is_diagnosed_once_and_tells_whoever_joins_it(cli: CommandLine, robot: Robot) -> None:
    done_by_driver = robot(broken=False)
    back_end = cli.start("run", *SEEN, "--port", "0")
    wait_for(back_end, "e-stop: none is declared")
    wait_for(back_end, "Ready.")

    runs = [cli("submit", "--native", cli.script("s.py", SOLUTION), "-r", f"{name}.json") for name in ("one", "two")]

    for finished in runs:
        assert finished.returncode == 0, finished.stderr
        assert "warning      e-stop: none is declared" in finished.stderr
    assert read(cli.folder / "two.json")["provenance"]["robot"]["despite"] == []
    assert done_by_driver().count("diagnosed") == 1
    assert cli("stop").returncode == 0


def test_run_refuses_a_broken_robot_too(cli: CommandLine, robot: Robot) -> None:
    done_by_driver = robot(broken=True)

    done = cli("run", *SEEN, "--port", "0")

    assert done.returncode == 2
    assert "The robot 'seen_robot' is not fit to be driven." in done.stderr
    assert done_by_driver() == ["diagnosed"]


@pytest.mark.parametrize("command", ["run", "submit"])
def test_a_diagnosis_is_cut_off_by_ctrl_c(cli: CommandLine, robot: Robot, command: str) -> None:
    done_by_driver = robot(broken=False, takes_s=100.0)
    words = ["--port", "0"] if command == "run" else ["--native", cli.script("s.py", SOLUTION)]
    process = cli.start(command, *SEEN, *words)
    while not done_by_driver():
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)

    assert ended(process) == 130
    assert done_by_driver() == ["diagnosed"]
    assert cli.nothing_is_left()


def test_an_unknown_finding_is_refused(cli: CommandLine, robot: Robot) -> None:
    done_by_driver = robot(broken=False)

    done = cli("submit", "--native", cli.script("s.py", SOLUTION), *SEEN, "--despite", "e-stap")

    assert done.returncode == 2
    assert "has no finding 'e-stap'" in done.stderr
    assert "Did you mean 'e-stop'?" in done.stderr
    assert done_by_driver() == ["diagnosed"]


def test_a_simulated_robot_has_no_diagnosis(cli: CommandLine) -> None:
    solution = cli.script("s.py", SOLUTION)
    refused = cli("submit", "--native", solution, *SELECTION, "--despite", "e-stop")
    done = cli("submit", "--native", solution, *SELECTION, "-r", "result.json")

    assert refused.returncode == 2
    assert "The robot 'sample_robot' is simulated: it has no diagnosis." in refused.stderr
    assert done.returncode == 0, done.stderr
    assert "Diagnosis" not in done.stderr
    assert "robot" not in read(cli.folder / "result.json")["provenance"]


def test_a_submission_typed_during_the_diagnosis_waits_for_the_run_and_joins_it(cli: CommandLine, robot: Robot) -> None:
    journal = robot(broken=False, takes_s=8.0)
    solution = cli.script("solution.py", SOLUTION)
    back_end = cli.start("run", *SEEN, "--port", "0")
    while "diagnosed" not in journal():
        assert back_end.poll() is None
        time.sleep(0.02)

    done = cli("submit", "--native", solution, "--display", "plain")

    assert done.returncode == 0, done.stderr
    assert done.stderr.index("A run is starting. Waiting for it:") < done.stderr.index("Joins ")


def test_a_submission_that_waits_for_a_run_learns_that_it_does_not_start(cli: CommandLine, robot: Robot) -> None:
    journal = robot(broken=True, takes_s=8.0)
    back_end = cli.start("run", *SEEN, "--port", "0")
    while "diagnosed" not in journal():
        assert back_end.poll() is None
        time.sleep(0.02)

    done = cli("submit", "--example", "hello_passive", "--display", "plain")

    assert done.returncode == 2
    assert "A run is starting." in done.stderr
    assert "No BenchBot run is there to connect to." in done.stderr
