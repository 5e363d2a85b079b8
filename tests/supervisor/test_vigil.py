import os
import signal
import subprocess
import threading
import time
from collections.abc import Iterator

import pytest

from benchbot.core.errors import FailureClass
from benchbot.supervisor import vigil
from benchbot.wire.joining import Lease
from tests.supervisor.harness import children_of, eventually


@pytest.fixture
def command() -> Iterator[int]:
    """A command that has started a solution."""
    process = subprocess.Popen(["sh", "-c", "sleep 60; true"], start_new_session=True)
    assert eventually(lambda: len(children_of(process.pid)) == 1)
    yield process.pid
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def test_something_is_done_again_and_again_as_long_as_the_context_lasts() -> None:
    calls: list[float] = []
    enough = threading.Event()

    def call() -> None:
        calls.append(time.monotonic())
        if len(calls) == 3:
            enough.set()

    with vigil.repeated(call):
        assert enough.wait(30)
    there = len(calls)
    time.sleep(3 * vigil.PERIOD_S)
    assert len(calls) == there


@pytest.mark.parametrize("way", ["starter", "lease"])
def test_a_frozen_command_is_no_fault_of_the_solution(command: int, way: str) -> None:
    lease = Lease(command, 0.0, "", by_command=True) if way == "lease" else None
    starter = command if way == "starter" else None
    assert vigil.frozen(starter, lease, None) is None

    os.kill(command, signal.SIGSTOP)
    assert eventually(lambda: vigil.frozen(starter, lease, None) is not None)
    found = vigil.frozen(starter, lease, None)

    assert found is not None
    assert found.failure is FailureClass.PLATFORM
    assert f"process {command})" in found.why


@pytest.mark.parametrize("way", ["starter", "lease", "lease of the solution", "asks"])
def test_a_frozen_solution_is_found_by_who_has_started_it_and_by_what_it_asks(command: int, way: str) -> None:
    (solution,) = children_of(command)
    leases = {
        "lease": Lease(command, 0.0, "", by_command=True),
        "lease of the solution": Lease(solution, 0.0, ""),
    }
    who = command if way == "starter" else None, leases.get(way), solution if way == "asks" else None
    assert vigil.frozen(*who) is None

    os.kill(solution, signal.SIGSTOP)
    assert eventually(lambda: vigil.frozen(*who) is not None)
    found = vigil.frozen(*who)

    assert found is not None
    assert found.failure is FailureClass.AGENT
    assert f"The solution (process {solution}) was frozen" in found.why


def test_who_is_not_known_or_gone_is_not_frozen() -> None:
    assert vigil.frozen(None, Lease(0, 0.0, ""), None) is None
    gone = subprocess.Popen(["true"])
    gone.wait()
    assert vigil.frozen(gone.pid, None, None) is None
