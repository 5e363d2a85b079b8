"""The guard, with real processes and no Ray."""

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_executor_ray import guard
from tests.machines import PATIENCE_S
from tests.supervisor.harness import alive, eventually

POLITE = """\
import os, signal, sys, time
signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))
print(os.getpid(), flush=True)
time.sleep(600)
"""
STUBBORN = """\
import os, signal, subprocess, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
print(os.getpid(), child.pid, flush=True)
time.sleep(600)
"""


def guarded(patience_s: float, source: str) -> "tuple[subprocess.Popen[str], list[int]]":
    """Return the guard, and the numbers of the processes that it guards."""
    words = [sys.executable, "-m", "benchbot_executor_ray.guard", str(patience_s), sys.executable, "-c", source]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, [int(word) for word in process.stdout.readline().split()]


def gone(numbers: list[int]) -> bool:
    return eventually(lambda: not any(map(alive, numbers)), PATIENCE_S)


def test_the_command_is_told_to_end_when_nobody_holds_the_guard_any_more() -> None:
    with guarded(PATIENCE_S, POLITE)[0] as process:
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(PATIENCE_S) == 7


def test_who_does_not_end_is_killed_with_its_children() -> None:
    process, numbers = guarded(0.2, STUBBORN)
    with process:
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(PATIENCE_S) == 128 + 9
    assert gone(numbers)


def test_the_command_ends_when_the_guard_is_killed() -> None:
    process, numbers = guarded(PATIENCE_S, POLITE)
    with process:
        process.kill()
    assert gone(numbers)


@given(code=st.integers(0, 255))
def test_the_exit_code_is_the_commands(code: int) -> None:
    assert guard.ended(code) == code
    if code:
        assert guard.ended(-code) == 128 + code


@pytest.mark.parametrize("name", ["a file", "with\ttabs"])
def test_the_command_gets_its_words_as_they_are(tmp_path: Path, name: str) -> None:
    words = [sys.executable, "-m", "benchbot_executor_ray.guard", "1", "touch", str(tmp_path / name)]
    with subprocess.Popen(words, stdin=subprocess.PIPE) as process:
        assert process.wait(PATIENCE_S) == 0
    assert (tmp_path / name).exists()
