"""Faults while a solution runs: their class, the message, and what is left."""

import os
import resource
import signal
from contextlib import suppress
from pathlib import Path

import pytest

from benchbot.core import randomness
from tests.cli.solutions import CRASHING, HANGING, PASSIVE, RECKLESS, WRITES, WRITES_LATE
from tests.cli.submitted import SELECTION, read
from tests.command_line import CommandLine, wait_for


def process_of(cli: CommandLine, module: str) -> int:
    """Return the number of the back end's process that runs a module."""
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            words = (entry / "cmdline").read_bytes().split(b"\0")
            if module.encode() in words and str(cli.home).encode() in (entry / "environ").read_bytes():
                return int(entry.name)
    raise AssertionError(f"{module} does not run")


def kill(cli: CommandLine, module: str) -> None:
    """Kill a process of the back end, as the kernel does when memory runs out."""
    os.kill(process_of(cli, module), signal.SIGKILL)


def write_no_more(process: int) -> None:
    """Let a process's files not grow any more, as on a full disk."""
    resource.prlimit(process, resource.RLIMIT_FSIZE, (100, 100))


def test_a_solution_that_crashes_fails_with_its_last_words_and_a_result_that_says_so(cli: CommandLine) -> None:
    done = cli("submit", "--native", cli.script("solution.py", CRASHING), *SELECTION, "-r", "result.json")

    assert done.returncode == 1
    assert done.stdout == ""
    assert "Error: The solution failed." in done.stderr
    assert "It ended with exit status 1." in done.stderr
    document = read(cli.folder / "result.json")
    assert "results" not in document
    assert document["provenance"]["failure"]["class"] == "agent"
    assert "RuntimeError: no idea what a chair is" in document["provenance"]["failure"]["why"]
    assert document["provenance"]["steps"] == 1
    assert cli.nothing_is_left()


def test_a_solution_that_hangs_is_ended_with_all_its_children(cli: CommandLine) -> None:
    done = cli("submit", "--native", cli.script("solution.py", HANGING), *SELECTION, "--timeout", "0.5", "-r", "r.json")

    assert done.returncode == 1
    assert "Error: The solution did not end in time." in done.stderr
    assert "still running after 0.5 seconds" in done.stderr
    assert read(cli.folder / "r.json")["provenance"]["failure"]["class"] == "timeout"
    assert cli.nothing_is_left()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_submission_leaves_nothing_behind(number: signal.Signals, cli: CommandLine) -> None:
    process = cli.start("submit", "--native", cli.script("solution.py", HANGING), *SELECTION, "-r", "result.json")
    wait_for(process, "hanging")

    os.killpg(process.pid, number)
    stdout, stderr = process.communicate(timeout=60)

    assert process.returncode == 130
    assert stdout == ""
    assert "Interrupted" in stderr
    assert "Traceback" not in stderr
    assert not (cli.folder / "result.json").exists()
    assert cli.nothing_is_left()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "The solution saved no result."),
        ("{", "The solution's result cannot be read."),
        ("[1]", "The solution's result cannot be read."),
        ('{"objects": []}', "The result has no key 'results'."),
        ('{"results": {"class_list": ["cup"], "objects": [{"label_probs": [1, 0]}]}}', "objects[0]"),
    ],
)
def test_a_result_that_is_missing_or_broken_fails_the_submission(
    text: str | None, message: str, cli: CommandLine
) -> None:
    solution = "true" if text is None else cli.script("solution.py", WRITES.format(text=text))

    done = cli("submit", "--native", solution, *SELECTION, "-r", "result.json")

    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    document = read(cli.folder / "result.json")
    assert "results" not in document
    assert document["provenance"]["failure"]["class"] == "agent"


def test_a_simulator_that_is_killed_is_the_platforms_fault(cli: CommandLine) -> None:
    process = cli.start("submit", "--native", f"{cli.script('s.py', PASSIVE)} 1", *SELECTION, "-r", "result.json")
    wait_for(process, "Sending action")

    kill(cli, "benchbot.supervisor.platform.process")
    _, stderr = process.communicate(timeout=60)

    assert process.returncode == 3
    assert "Error: The simulator or robot failed" in stderr
    assert "SIGKILL" in stderr
    assert "platform.log" in stderr
    assert read(cli.folder / "result.json")["provenance"]["failure"]["class"] == "platform"
    assert cli.nothing_is_left()


STUBBORN = """\
import json
from benchbot.api import BenchBot
from benchbot.core.errors import BenchbotError
benchbot = BenchBot()
results = benchbot.empty_results()
for call in (lambda: benchbot.step(None), lambda: benchbot.step("move_next"), benchbot.reset):
    try:
        call()
    except BenchbotError as error:
        print("told:", error.title, error.ends_run, flush=True)
with open(benchbot.result_filename, "w") as file:
    json.dump(results, file)
"""
"""Goes on after a safety stop as if nothing had happened, and saves a valid result."""


@pytest.mark.parametrize("solution", [PASSIVE, STUBBORN])
def test_a_safety_stop_ends_the_run_whatever_the_solution_makes_of_it(solution: str, cli: CommandLine) -> None:
    selection = [*SELECTION[:-1], "faulty:stop"]

    done = cli("submit", "--native", cli.script("s.py", solution), *selection, "-r", "result.json")

    assert done.returncode == 3
    error = done.stderr.rpartition("\nError: ")[2]
    assert error.startswith("The robot was stopped for safety, and the run is over.")
    assert "Something came too close." in error
    assert "platform.log" in error
    assert "again" not in error
    assert read(cli.folder / "result.json")["provenance"]["failure"]["class"] == "platform"
    if solution == STUBBORN:
        assert done.stderr.count("told: The robot was stopped for safety. True") == 2
    assert cli.nothing_is_left()


def test_a_solution_that_is_ended_while_a_real_robot_moves_stops_it_for_good(cli: CommandLine) -> None:
    selection = ["--task", "sample:active", *SELECTION[2:-1], "faulty:halts"]
    code = "from benchbot.api import BenchBot\nBenchBot().step('move_angle', angle=36000)\n"
    back_end = cli.start("run", *selection, "--port", "0")
    wait_for(back_end, "Ready.")

    done = cli("submit", "--native", cli.script("s.py", code), "--timeout", "3", "-r", "result.json")
    wait_for(back_end, "STOPPED FOR SAFETY")
    second = cli("submit", "--native", cli.script("s.py", code), "-r", "second.json")

    assert (done.returncode, second.returncode) == (3, 3)
    for finished in (done, second):
        assert "Error: The robot was stopped for safety, and the run is over." in finished.stderr
        assert "hung up while the robot was moving" in finished.stderr
    assert read(cli.folder / "result.json")["provenance"]["failure"]["class"] == "platform"
    assert cli("stop").returncode == 0


def test_a_supervisor_that_is_killed_is_the_infrastructures_fault(cli: CommandLine) -> None:
    selection = [*SELECTION, "--seed", "5", "--secret", "random"]
    process = cli.start("submit", "--native", f"{cli.script('s.py', PASSIVE)} 60", *selection, "-r", "result.json")
    wait_for(process, "Connected!")

    kill(cli, "benchbot.supervisor")
    _, stderr = process.communicate(timeout=60)

    assert process.returncode == 3
    assert "Error: The supervisor died." in stderr
    assert "SIGKILL" in stderr
    provenance = read(cli.folder / "result.json")["provenance"]
    assert provenance["failure"]["class"] == "infrastructure"
    chosen = provenance["selection"]
    assert randomness.commitment(chosen["secret"], chosen["seed"]) == chosen["commitment"]
    assert cli.no_process_is_left()


def test_a_run_that_is_killed_in_the_other_terminal_is_noticed(cli: CommandLine) -> None:
    back_end = cli.start("run", *SELECTION, "--seed", "5", "--port", "0")
    wait_for(back_end, "Ready.")
    process = cli.start("submit", "--native", f"{cli.script('s.py', PASSIVE)} 60", "-r", "result.json")
    wait_for(process, "Connected!")

    back_end.kill()
    _, stderr = process.communicate(timeout=60)

    assert process.returncode == 3
    assert "Error: The BenchBot supervisor is gone." in stderr
    provenance = read(cli.folder / "result.json")["provenance"]
    assert (provenance["failure"]["class"], provenance["selection"]["seed"]) == ("infrastructure", 5)
    back_end.wait()
    assert cli.no_process_is_left()
    assert cli("submit", "--native", "true").returncode == 2


def test_a_collision_with_a_valid_result_is_a_result(cli: CommandLine) -> None:
    selection = ["--task", "sample:active", *SELECTION[2:]]

    done = cli("submit", "--native", cli.script("s.py", RECKLESS), *selection, "-r", "result.json")

    assert done.returncode == 0, done.stderr
    assert "The episode ended early (collision): The robot hit something" in done.stderr
    assert read(cli.folder / "result.json")["provenance"]["failure"]["class"] == "collision"


def test_a_limit_that_is_reached_is_a_timeout(cli: CommandLine) -> None:
    solution = cli.script("solution.py", PASSIVE)

    done = cli("submit", "--native", solution, *SELECTION, "--max-steps", "2", "-r", "result.json")

    assert done.returncode == 1
    assert "limit of 2 steps" in done.stderr
    assert read(cli.folder / "result.json")["provenance"]["failure"]["class"] == "timeout"


def test_a_full_disk_is_said_and_leaves_no_half_written_file(cli: CommandLine) -> None:
    process = cli.start("submit", "--native", f"{cli.script('s.py', PASSIVE)} 0.5", *SELECTION, "-r", "result.json")
    wait_for(process, "Connected!")
    write_no_more(process.pid)

    _, stderr = process.communicate(timeout=60)

    assert process.returncode == 3
    assert "Error: Cannot write result.json." in stderr
    assert "File too large" in stderr
    safe = stderr.partition("The result itself is safe: ")[2].splitlines()[0]
    assert read(Path(safe))["results"]["objects"] == []
    assert sorted(path.name for path in cli.folder.iterdir()) == ["s.py"]
    assert cli.nothing_is_left()


def test_a_full_disk_behind_the_supervisor_is_the_infrastructures_fault(cli: CommandLine) -> None:
    process = cli.start("submit", "--native", f"{cli.script('s.py', WRITES_LATE)}", *SELECTION, "-r", "result.json")
    wait_for(process, "thinking")
    write_no_more(process_of(cli, "benchbot.supervisor"))

    _, stderr = process.communicate(timeout=60)

    assert process.returncode == 3
    assert "File too large" in stderr
    document = read(cli.folder / "result.json")
    assert document["provenance"]["failure"]["class"] == "infrastructure"
    assert list(cli.home.rglob("*result.json*")) == []
    assert cli.nothing_is_left()


def test_a_result_that_cannot_be_kept_where_it_was_asked_for_is_safe_elsewhere(cli: CommandLine) -> None:
    solution = cli.script("solution.py", "open('taken', 'w').close()\n" + PASSIVE)

    never = cli("submit", "--native", solution, *SELECTION, "-r", "/proc/nowhere/result.json")
    done = cli("submit", "--native", solution, *SELECTION, "-r", "taken/result.json")

    assert never.returncode == 2
    assert "Nothing can be written into /proc/nowhere." in never.stderr
    assert done.returncode == 3
    assert "Error: Cannot write taken/result.json." in done.stderr
    safe = done.stderr.strip().rpartition("The result itself is safe: ")[2]
    assert read(Path(safe))["results"]["objects"] == []
