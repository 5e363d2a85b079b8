"""The sandbox as it is: real ones, made by root and by an ordinary user, with bubblewrap and with Landlock."""

import errno
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.sandbox.mode import Sandbox, bubblewrap_problem
from benchbot.submission.init import landlock
from tests.plugins.sandbox.solutions import (
    BURNS,
    BURNS_TOGETHER,
    EATS_MEMORY,
    EATS_MEMORY_TOGETHER,
    ENDS_ITS_INIT_PROCESS,
    FORKS,
    KILLS_ALL,
    LINKS,
    LOOKS_AROUND,
    PIPES,
    STOPS_ITS_LEADER,
    TOO_MUCH,
    WRITES_MUCH,
)
from tests.submission.ordinary import delegated, ordinarily

ROOT = Path(__file__).parents[3]
TRUTH = ROOT / "plugins" / "envs_bear" / "src" / "benchbot_envs_bear"
Cases = list[dict[str, Any]]
Drive = Callable[[Cases], Cases]


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder that other users can reach, unlike pytest's own."""
    with tempfile.TemporaryDirectory(prefix="benchbot-test-") as name:
        yield Path(name)


@pytest.fixture(params=["ordinary", "delegated", "root"] if os.geteuid() == 0 else ["ordinary"])
def drive(request: pytest.FixtureRequest, folder: Path) -> Iterator[Drive]:
    """Runs solutions in sandboxes: as an ordinary user, as one who may make control groups, and as root."""
    with ExitStack() as stack:
        entering = stack.enter_context(delegated()) if request.param == "delegated" else []
        yield partial(driven, entering, folder, ordinary=request.param != "root")


def driven(entering: list[str], folder: Path, cases: Cases, *, ordinary: bool) -> Cases:
    command = [sys.executable, "-m", "tests.plugins.sandbox.driver"]
    command = [*entering, *(ordinarily(command, folder) if ordinary else command)]
    folders = {f"BENCHBOT_{kind}_DIR": str(folder / kind) for kind in ("STATE", "CACHE", "DATA")}
    home = {"HOME": str(folder), "TMPDIR": str(folder)}
    done = subprocess.run(
        command,
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        cwd=ROOT,
        env={**os.environ, **home, **folders, "SECRET": "of the user", "OMP_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert isinstance(found, list)
    return found


def looking_around(folder: Path) -> dict[str, Any]:
    named = folder / "weights.bin"
    named.touch()
    put_in = {"TRUTH": str(TRUTH), "READABLE": str(named), "OUTER": os.getpid()}
    code = "\n".join(f"{name} = {value!r}" for name, value in put_in.items())
    return {"code": f"{code}\n{LOOKS_AROUND}", "readable": [str(named)]}


def test_a_solution_sees_what_it_needs_and_reaches_nothing_else(drive: Drive, folder: Path) -> None:
    (ended,) = drive([looking_around(folder)])

    assert (ended["status"], ended["explained"], ended["mode"]) == (0, None, "sandbox"), ended["output"]
    seen = json.loads(ended["result"])
    assert seen["user"] != 0
    assert seen["processes"] == "[1, 2, 3]"
    assert seen["shadow"] == "FileNotFoundError"
    assert seen["ground_truth"] == "FileNotFoundError"
    assert "weights.bin" in seen["readable"]
    assert seen["sockets"] == ["PermissionError"] * 3
    assert set(seen["written"].values()) == {"OSError"}
    assert "TextIOWrapper" in seen["temporary"]
    assert seen["outer"] == "ProcessLookupError"
    assert seen["namespace"] == [-1, errno.EPERM]
    assert seen["parent"] == "PermissionError"
    variables = seen["variables"]
    assert seen["raised"] == "ValueError"
    assert "SECRET" not in variables
    assert "BENCHBOT_URL" not in variables
    assert not any(name.endswith("_DIR") for name in variables)
    assert variables["OMP_NUM_THREADS"] == "1"
    assert variables["BENCHBOT_TOKEN"] == "token"
    assert seen["capabilities"] == str(["0" * 16] * 5)
    assert "benchbot.submission.init" in seen["command_lines"]
    for line in (ended["command_line"], seen["command_lines"]):
        assert str(TRUTH) not in line
        assert str(folder) not in line
    assert ended["groups"] == []


def test_what_goes_beyond_a_limit_is_ended_and_told(drive: Drive) -> None:
    memory, many, time, size = drive(
        [
            {"code": EATS_MEMORY, "limits": {"memory_bytes": 200 * 2**20}, "weak_limits": True},
            {"code": FORKS, "limits": {"processes": 30}},
            {"code": BURNS, "limits": {"cpu_time_s": 1}, "weak_limits": True},
            {"code": WRITES_MUCH, "limits": {"file_size_bytes": 2**20}},
        ]
    )

    assert "more memory than it may: 200 MiB" in memory["explained"]
    assert "--memory" in memory["explained"]
    assert "more processes and threads than it may: 30" in (many["explained"] or ""), many
    assert "used up its CPU time. It had 1 seconds" in time["explained"]
    assert "a file larger than it may: 1 MiB" in size["explained"]
    assert {ended["status"] == 0 for ended in (memory, many, time, size)} == {False}


@pytest.mark.parametrize("drive", ["delegated", "root"], indirect=True)
def test_limits_hold_for_all_processes_together(drive: Drive) -> None:
    memory, time = drive(
        [
            {"code": EATS_MEMORY_TOGETHER, "limits": {"memory_bytes": 400 * 2**20}},
            {"code": BURNS_TOGETHER, "limits": {"cpu_time_s": 1}},
        ]
    )

    assert memory["status"] != 0
    assert "more memory than it may: 400 MiB" in memory["explained"]
    assert "used up its CPU time. It had 1 seconds" in time["explained"]
    assert (memory["weak_limits"], memory["groups"]) == ([], [])


@pytest.mark.parametrize("drive", ["ordinary"], indirect=True)
def test_where_they_would_not_what_was_asked_for_is_refused_and_a_default_is_weak(drive: Drive) -> None:
    asked = {"code": EATS_MEMORY_TOGETHER, "limits": {"memory_bytes": 400 * 2**20}}

    refused, timed, trusted, unasked = drive(
        [asked, {"code": BURNS, "limits": {"cpu_time_s": 1}}, {**asked, "weak_limits": True}, {"code": "print(7)"}]
    )

    assert "The solution's limits would not hold: memory." in refused["explained"]
    assert "--weak-limits" in refused["explained"]
    assert "would not hold: CPU time." in timed["explained"]
    assert (refused["output"], timed["output"]) == ("", "")
    assert (trusted["status"], trusted["weak_limits"]) == (0, ["memory"])
    assert (unasked["status"], unasked["weak_limits"]) == (0, ["memory"])


def test_a_result_that_is_none_is_refused_and_a_solution_that_ends_its_sandbox_has_failed(drive: Drive) -> None:
    link, pipe, much, *killers = drive(
        [{"code": code} for code in (LINKS, PIPES, TOO_MUCH, KILLS_ALL, ENDS_ITS_INIT_PROCESS)]
    )

    assert "It is a link" in link["explained"]
    assert "It is no regular file" in pipe["explained"]
    assert "It has 67108865 bytes" in much["explained"]
    assert [ended["result"] for ended in (link, pipe, much)] == [None] * 3
    assert all(ended["status"] != 0 for ended in killers)


def test_a_solution_that_has_stopped_all_it_can_ends_with_its_sandbox(drive: Drive) -> None:
    (ended,) = drive([{"code": STOPS_ITS_LEADER, "wait_s": 3}])

    assert ended["status"] is None
    assert "stopped" in ended["output"]
    assert ended["ending_s"] < 15, "it was waited for"


@pytest.mark.parametrize("drive", ["ordinary"], indirect=True)
def test_without_bubblewrap_landlock_holds_it(drive: Drive, folder: Path) -> None:
    (ended,) = drive([{**looking_around(folder), "bubblewrap": False}])

    assert (ended["status"], ended["mode"]) == (0, "sandbox-landlock"), ended
    assert ended["weak_limits"] == ["memory", "disk"]
    seen = json.loads(ended["result"])
    assert seen["processes"] == seen["shadow"] == "PermissionError"
    assert seen["sockets"] == ["PermissionError"] * 3
    assert set(seen["written"].values()) == {"PermissionError"}
    assert "TextIOWrapper" in seen["temporary"]
    assert seen["outer"] == "PermissionError"
    assert seen["namespace"] == [-1, errno.EPERM]
    assert "SECRET" not in seen["variables"]


def test_where_neither_works_nothing_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(landlock, "NEEDED_VERSION", 99)
    bubblewrap_problem.cache_clear()
    try:
        with pytest.raises(BenchbotError) as caught:
            Sandbox().check()
    finally:
        bubblewrap_problem.cache_clear()

    assert caught.value.title == "There is no sandbox on this machine, so the solution is not run."
    assert "Bubblewrap is not installed." in caught.value.why
    assert "99 is needed" in caught.value.why or "no Landlock" in caught.value.why
