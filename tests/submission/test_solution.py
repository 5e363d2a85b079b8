"""A native solution as a process: how it ends, and that nothing outlives it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.submission.init.process import GRACE_S
from benchbot.submission.solution import KILLING_S, MARGIN_S, InitOptions, Solution, describe_exit

MARK = "BENCHBOT_TEST_MARK"
RUNAWAY = """\
import os, signal, subprocess, sys, time
for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN)
reading, writing = os.pipe()
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        print("away", flush=True)
        os.write(writing, b".")
        time.sleep(1000)
    os._exit(0)
os.wait()
os.read(reading, 1)
"""
"""Starts a process in a session of its own whose parent has ended, and which ignores what is polite; waits for it."""

STOPS_ITS_LEADER = f"""\
{RUNAWAY}
os.kill(os.getppid(), signal.SIGSTOP)
print("stopped", flush=True)
time.sleep(1000)
"""
"""The same, with an init process that can do nothing any more."""

OWNER = """\
import os, sys, time
from pathlib import Path
from benchbot.submission.solution import Solution
with Solution([sys.executable, "-c", sys.argv[1]], Path.cwd(), dict(os.environ), lambda chunk: os.write(1, chunk)):
    time.sleep(1000)
"""
"""Runs a solution and waits, like a `submit`."""


def left(mark: str) -> list[str]:
    """Return the numbers of living processes that have the mark in their environment."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if f"{MARK}={mark}".encode() in (entry / "environ").read_bytes():
                found.append(entry.name)
    return found


def in_time(condition: Callable[[], bool]) -> bool:
    deadline_s = time.monotonic() + 60
    while not condition() and time.monotonic() < deadline_s:
        time.sleep(0.02)
    return condition()


def ended(command: list[str], environment: dict[str, str] | None = None) -> tuple[int | None, str]:
    output = bytearray()
    with Solution(command, Path.cwd(), environment or dict(os.environ), output.extend) as solution:
        status = solution.wait(60)
    return status, output.decode()


@pytest.mark.parametrize(
    ("command", "status"),
    [
        (["true"], 0),
        (["sh", "-c", "exit 3"], 3),
        (["sh", "-c", "exit 137"], 137),
        (["sh", "-c", "kill -SEGV $$"], -signal.SIGSEGV),
    ],
)
def test_the_status_is_the_solutions_own(command: list[str], status: int) -> None:
    assert ended(command)[0] == status


def test_a_signal_without_a_name_is_told_by_its_number() -> None:
    assert describe_exit(-signal.SIGSEGV) == "It was ended by SIGSEGV."
    assert describe_exit(-40) == "It was ended by signal 40."


def test_what_has_left_its_group_ends_with_the_solution(tmp_path: Path) -> None:
    mark = str(tmp_path)

    status, output = ended([sys.executable, "-c", RUNAWAY], {**os.environ, MARK: mark})

    assert (status, output) == (0, "away\n")
    assert left(mark) == []


def test_everything_ends_with_a_solution_that_is_ended_early(tmp_path: Path) -> None:
    mark, output = str(tmp_path), bytearray()
    code = f"{RUNAWAY}\ntime.sleep(1000)"

    with Solution([sys.executable, "-c", code], tmp_path, {**os.environ, MARK: mark}, output.extend) as solution:
        assert in_time(lambda: b"away" in output)
        assert solution.wait(0.01) is None

    assert left(mark) == []


def test_everything_ends_with_a_solution_that_has_stopped_its_leader(tmp_path: Path) -> None:
    mark, output = str(tmp_path), bytearray()
    command, environment = [sys.executable, "-c", STOPS_ITS_LEADER], {**os.environ, MARK: mark}

    with Solution(command, tmp_path, environment, output.extend) as solution:
        assert in_time(lambda: b"stopped" in output)
        leader = Path(f"/proc/{solution.process}")

    assert left(mark) == []
    assert not leader.exists()


def test_no_solution_delays_its_end_by_more_than_5_seconds() -> None:
    assert GRACE_S + MARGIN_S + 2 * KILLING_S <= 5


@pytest.mark.parametrize("code", [RUNAWAY, f"{RUNAWAY}\ntime.sleep(1000)"])
def test_everything_ends_when_benchbot_is_killed(code: str, tmp_path: Path) -> None:
    mark = str(tmp_path)
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER, code], stdout=subprocess.PIPE, env={**os.environ, MARK: mark}
    )
    with owner:
        assert owner.stdout is not None
        assert owner.stdout.readline() == b"away\n"
        owner.kill()

    assert in_time(lambda: left(mark) == [])


def test_a_command_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "text").touch(0o644)
    for name, why in (
        ("nothing", "No such file or directory"),
        ("text", "Permission denied"),
        (".", "Permission denied"),
    ):
        command = str(tmp_path / name)
        with pytest.raises(BenchbotError) as caught:
            ended([command])

        assert caught.value.title == f"The solution '{command}' cannot be started."
        assert why in caught.value.why


def test_what_is_killed_before_the_solution_began_is_no_fault_of_it() -> None:
    killed = Solution(["true"], Path.cwd(), {}, len, InitOptions(wrapper=["sh", "-c", "kill -KILL $$"]))

    with pytest.raises(BenchbotError) as caught, killed:
        pass

    assert caught.value.failure is FailureClass.INFRASTRUCTURE
    assert caught.value.why == "What starts it was killed before. It was ended by SIGKILL."


def test_last_words_are_kept_and_output_is_untouched() -> None:
    output = bytearray()
    with Solution(["sh", "-c", "printf 'a\\377b\\n'; seq 9"], Path.cwd(), {}, output.extend) as solution:
        assert solution.wait(60) == 0

    assert output.startswith(b"a\xffb\n1\n")
    assert solution.last_words == "5\n6\n7\n8\n9"
