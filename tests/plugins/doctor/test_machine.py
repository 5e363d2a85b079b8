import os
import socket
import time
from pathlib import Path

import pytest

from benchbot.core.findings import Level
from benchbot.plugins.doctor import children, installation, isolation, machine


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path))
    return tmp_path


def test_the_cache_is_told_with_its_size_and_a_lock_that_a_killed_process_left(cache: Path) -> None:
    assert [finding.detail for finding in machine.caches()] == ["empty: the first run compiles"]
    (cache / "kernels").mkdir()
    (cache / "kernels" / "a.tic").write_bytes(bytes(3 * 2**20))
    lock = cache / "kernels" / "ticache.lock"
    lock.touch()
    assert [finding.detail for finding in machine.caches()] == ["kernels 3 MiB"]
    os.utime(lock, (time.time() - 600, time.time() - 600))

    _, stale = machine.caches()

    assert stale.detail.startswith(f"{lock} is 10 min old")


def test_shared_memory_is_looked_at_where_there_is_some(tmp_path: Path) -> None:
    assert next(machine.shared_memory(tmp_path)).detail.startswith(f"{tmp_path}, ")
    assert list(machine.shared_memory(tmp_path / "nowhere")) == []
    readonly = next(machine.shared_memory(Path("/proc")))
    assert (readonly.level, readonly.subject) == (Level.BROKEN, "shared memory")


def test_whoever_listens_on_a_port_is_named() -> None:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()

        assert (machine._holder(listening.getsockname()[1]) or "").startswith(f"process {os.getpid()} (")


def test_this_machine_has_processors_memory_and_a_time() -> None:
    assert [finding.subject for finding in (*machine.processors(), *machine.clock())] == ["machine", "clock"]


def test_the_sandbox_is_told_with_all_that_holds_it() -> None:
    told = {finding.subject: finding for finding in isolation.sandbox()}

    assert told["sandbox"].detail
    assert (told["sandbox"].level is Level.OK) == (told["sandbox"].fix == "")


def test_versions_are_told_and_requirements_that_are_not_met(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = tmp_path / "needy-1.0.dist-info"
    info.mkdir()
    (info / "entry_points.txt").write_text("[benchbot]\nneedy = needy\n")
    needs = ["no-such-thing>=2", "numpy<1", "pyyaml", "never>=1; python_version < '3'", "more; extra == 'all'"]
    requirements = "".join(f"Requires-Dist: {need}\n" for need in needs)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: needy\nVersion: 1.0\n{requirements}")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("BENCHBOT_PLUGINS", "needy")

    told, *unmet = installation.versions()

    assert "numpy " in told.detail
    assert [finding.subject for finding in unmet] == ["requirements of needy"] * 2
    assert [finding.fix for finding in unmet] == ["pip install 'no-such-thing>=2'", "pip install 'numpy<1'"]
    assert unmet[0].detail == "no-such-thing>=2 is not installed"


def test_a_command_of_another_environment_is_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other, own = tmp_path / "other", tmp_path / "own" / "bin"
    for folder in (other, own):
        folder.mkdir(parents=True)
        (folder / "benchbot").write_text("#!/bin/sh\n")
        (folder / "benchbot").chmod(0o755)
    monkeypatch.setattr("sys.prefix", str(own.parent))
    monkeypatch.setenv("PATH", str(own))
    assert [finding.level for finding in installation.commands()] == [Level.OK]
    monkeypatch.setenv("PATH", str(other))

    (warning,) = installation.commands()

    assert warning.fix == f"Activate this environment: source {own}/activate"


@pytest.mark.parametrize(
    ("code", "problem"),
    [
        ("import os; os.abort()", "signal 6"),
        ("raise OSError('no such driver')", "OSError: no such driver"),
        ("import sys; sys.exit(3)", "exit code 3"),
        ("import time; time.sleep(600)", "no answer within 1 s"),
        ("print('well')", ""),
    ],
)
def test_a_child_that_crashes_or_hangs_is_an_answer(code: str, problem: str) -> None:
    timeout_s = 1.0 if "sleep" in code else 120.0

    assert children.ask_python(code, bare=True, timeout_s=timeout_s).problem == problem


def test_a_program_that_is_not_there_is_an_answer() -> None:
    assert children.ask(["/no/such/program"]).problem == "No such file or directory"
