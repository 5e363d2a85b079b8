"""The whole chain in real processes: `benchbot submit`, its supervisor, driver, guard and solution; and the robot."""

import json
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

from benchbot.wire.run_state import STATE_FILE, RunState
from plugins.robot_ros2.tests.unicycle import PATIENCE_S, Unicycle, declaration, until
from tests.command_line import COMMAND, CommandLine
from tests.plugin_factory import DECLARES
from tests.supervisor.harness import children_of

SELECTION = ("--task", "walk", "--robot", "unicycle", "--env", "hall:1")
PLUGIN = "\n".join(DECLARES.format(kind=kind) for kind in ("robots", "environments", "tasks"))
# By the robot's clock.
STOPS_WITHIN_S, STAYS_S = 0.2, 2.0

WALK = """\
import json, os, sys
from benchbot.api import BenchBot
from benchbot.core.errors import BenchbotError

print("solution:", os.getpid(), flush=True)
benchbot = BenchBot()
told = []
for act in (lambda: benchbot.step("move_distance", distance=4), benchbot.reset):
    try:
        act()
    except BenchbotError as error:
        told.append(error.as_dict())
print("told:", json.dumps(told), flush=True)
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""
"""Walks on; when it is stopped, it tries again. Says what it was told."""

WALK_AND_HANG = """\
import time
from benchbot.api import BenchBot

BenchBot().step("move_distance", distance=0.3)
print("hanging", flush=True)
time.sleep(600)
"""


def plugin_files(**driver: Any) -> dict[str, str]:
    """Return the declarations of the test robot with these settings, of a real hall, and of a task."""
    robot = declaration(**driver) | {"runs_in": ["real"]}
    hall = {"name": "hall", "variant": 1, "type": "real", "start_pose": [1, 0, 0, 0, 0, 0, 0]}
    task = {"name": "walk", "actions": ["move_distance"], "observations": ["poses"]}
    documents = {"robots/unicycle.yaml": robot, "environments/hall_1.yaml": hall, "tasks/walk.yaml": task}
    return {path: yaml.safe_dump(document) for path, document in documents.items()}


@dataclass
class Submission:
    """`benchbot submit`, its output going to a file, with `options` and a solution."""

    cli: CommandLine
    process: "subprocess.Popen[bytes]"
    output: Path

    @property
    def said(self) -> str:
        """What it and its solution have printed."""
        return self.output.read_text()

    @cached_property
    def state(self) -> RunState:
        """The run that it belongs to."""
        (path,) = self.cli.home.rglob(STATE_FILE)
        return RunState.from_dict(json.loads(path.read_text()))

    @property
    def supervisor(self) -> int:
        """The supervisor's process number."""
        return self.state.pid

    @property
    def driver(self) -> int:
        """The process number of the robot's driver."""
        (driver,) = children_of(self.supervisor)
        return driver

    @property
    def guards(self) -> dict[str, int]:
        """The process numbers of the guard (`guards`) and of the one that stands by (`stands-by`)."""
        commands = {pid: Path(f"/proc/{pid}/cmdline").read_text().split("\0") for pid in children_of(self.driver)}
        return {words[-2]: pid for pid, words in commands.items()}

    @property
    def solution(self) -> int:
        """The solution's process number."""
        return int(self.said.partition("solution: ")[2].split()[0])

    @property
    def told(self) -> list[dict[str, Any]]:
        """The errors that the solution was told: of its action, and of its reset."""
        told: list[dict[str, Any]] = json.loads(self.said.partition("told: ")[2].partition("\n")[0])
        return told

    def ended(self) -> tuple[int, dict[str, Any]]:
        """Wait for the end; return the exit code, and the class and reason of failure in the result document."""
        code = self.process.wait(2 * PATIENCE_S)
        result = self.cli.folder / "result.json"
        assert result.exists(), self.said
        document = json.loads(result.read_text())
        return code, document["provenance"]["failure"]


@contextmanager
def submission(
    cli: CommandLine, *options: str, solution: str = WALK, prefix: tuple[str, ...] = ()
) -> Iterator[Submission]:
    """Yield a submission with `options` besides its solution; by default it starts a back end of its own."""
    script = cli.script("solution.py", solution)
    words = ["submit", *(options or SELECTION), "--native", script, "-r", "result.json"]
    output = cli.folder / "output"
    with output.open("wb") as file:
        process = subprocess.Popen(
            [*prefix, *COMMAND, *words], stdout=file, stderr=file, cwd=cli.folder, env=cli.variables, process_group=0
        )
    try:
        yield Submission(cli, process, output)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert cli.no_process_is_left(), cli.processes_left()


def until_under_way(robot: Unicycle, submitted: Submission) -> None:
    """Wait until the robot has come a little of its way."""

    def moves() -> bool:
        assert submitted.process.poll() is None, submitted.said
        return bool(robot.state["x"] > 0.02)

    until(moves, 2 * PATIENCE_S)


def strike(robot: Unicycle, beyond_m: float = 0.1, **blow: Any) -> None:
    """Let the robot strike after a little more of its way, so that its own clock tells when; wait until it has."""
    robot.set(strike={"beyond_m": beyond_m, **blow})
    until(lambda: robot.state["struck_s"] is not None)


def has_passed(robot: Unicycle, seconds: float) -> Callable[[], bool]:
    """Return what says whether so much time has passed since now, by the robot's clock."""
    since_s = robot.state["time_s"]
    return lambda: robot.state["time_s"] - since_s > seconds


def assert_stopped_in_time(robot: Unicycle) -> None:
    """Check, by the robot's clock, that it was told to stop soon after the strike, rests, and stays where it is."""
    until(lambda: robot.state["rested_s"] is not None)
    at_rest = robot.state
    assert at_rest["zeroed_s"] is not None, at_rest
    assert at_rest["zeroed_s"] - at_rest["struck_s"] <= STOPS_WITHIN_S
    assert_stays(robot)


def assert_stays(robot: Unicycle) -> None:
    """Check that a robot at rest is not told to move, and does not, in the next seconds of its time."""
    before = robot.set(pace=1.0, motion_pace=None)
    until(has_passed(robot, STAYS_S))
    after = robot.state
    assert (after["x"], after["moved_s"], after["v"]) == (before["x"], before["moved_s"], 0.0), (before, after)
