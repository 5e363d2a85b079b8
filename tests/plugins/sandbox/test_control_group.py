"""Control groups of version 2, whose files a pretended kernel makes; real ones of this machine are in test_sandbox."""

import os
import subprocess
from pathlib import Path

import pytest

from benchbot.plugins.sandbox.control_group import control_group
from benchbot.submission.modes import ProcessLimits
from tests.supervisor.harness import eventually

LIMITS = ProcessLimits(memory_bytes=1000, processes=7)


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A mounted cgroup2 whose every folder but the innermost has controllers; making a group makes its files."""
    mounted = tmp_path / "cgroup"
    (mounted / "user" / "scope").mkdir(parents=True)
    (mounted / "cgroup.controllers").write_text("cpu memory pids")
    make, remove = Path.mkdir, Path.rmdir

    def mkdir(path: Path) -> None:
        make(path)
        if path.parent != mounted / "user" / "scope":
            for name in ("memory.max", "memory.swap.max", "pids.max", "cgroup.procs"):
                (path / name).write_text("max")
            (path / "memory.events").write_text("low 0\noom_kill 1\n")
            (path / "pids.events").write_text("max 2\n")
            (path / "cpu.stat").write_text("usage_usec 1500000\nuser_usec 0\n")

    def rmdir(path: Path) -> None:
        for file in path.glob("*"):
            file.unlink()
        remove(path)

    monkeypatch.setattr(Path, "mkdir", mkdir)
    monkeypatch.setattr(Path, "rmdir", rmdir)
    return mounted


def test_a_group_is_made_where_controllers_are_and_goes_again(kernel: Path, tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.write_text("0::/user/scope\n")

    with control_group(LIMITS, kernel, own) as group:
        assert group is not None
        folder = group.folders["memory"]
        assert folder.parent == kernel / "user"
        assert (folder / "memory.max").read_text() == "1000"
        assert (folder / "memory.swap.max").read_text() == "0"
        assert (folder / "pids.max").read_text() == "7"
        assert group.entering[4:] == [str(folder / "cgroup.procs"), "--"]
        assert group.killed_for_memory()
        assert group.refused_processes()
        assert group.cpu_time_s() == 1.5

    assert list(kernel.rglob("benchbot-*")) == []


SYSTEMD_RUN = """\
#!/bin/sh
while [ "$1" != -- ]; do
  case "$1" in --unit=*) unit=${1#--unit=};; *=*) echo "${1#*=}" > "$GROUPS_AT/${1%%=*}";; esac
  shift
done
folder=$GROUPS_AT/app.slice/$unit.scope
mkdir -p "$folder"
mv "$GROUPS_AT/MemoryMax" "$folder/memory.max"; mv "$GROUPS_AT/TasksMax" "$folder/pids.max"
echo "0::/app.slice/$unit.scope" > "$GROUPS_AT/own"
echo "usage_usec 2500000" > "$folder/cpu.stat"
shift; exec "$@"
"""
"""A systemd that only writes down what it is asked for; a real one is looked at in virtual machines, by hand."""


@pytest.mark.parametrize("kept", [True, False])
def test_who_may_make_none_gets_one_of_systemd_if_that_keeps_what_it_promises(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: bool
) -> None:
    (tmp_path / "own").write_text("0::/nowhere/of/this/user\n")
    (tmp_path / "cgroup.controllers").write_text("cpu memory pids" if kept else "")
    program = tmp_path / "systemd-run"
    program.write_text(SYSTEMD_RUN if kept else SYSTEMD_RUN.replace("TasksMax", "MemoryMax"))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    monkeypatch.setenv("GROUPS_AT", str(tmp_path))

    with control_group(LIMITS, tmp_path, tmp_path / "own") as group:
        if not kept:
            assert group is None
            return
        assert group is not None
        folder = group.folders["memory"]
        done = subprocess.run([*group.entering, "/usr/bin/env"], capture_output=True, text=True, check=True)
        assert "XDG_RUNTIME_DIR" not in done.stdout
        assert (folder / "memory.max").read_text() == "1000\n"
        assert (folder / "pids.max").read_text() == "7\n"
        assert group.cpu_time_s() == 2.5
        stays = ["pgrep", "-f", f" {os.getpid()} /usr/bin/env$"]
        held = subprocess.run(stays, capture_output=True, text=True, check=True)
        (folder / "cgroup.procs").write_text(held.stdout)
        assert len(held.stdout.split()) == 1
    assert eventually(lambda: not living(held.stdout.strip()))


def living(process: str) -> bool:
    stat = Path("/proc", process, "stat")
    return stat.exists() and " Z " not in stat.read_text()


def test_without_any_there_is_no_group(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.write_text("0::/\n")

    with control_group(LIMITS, tmp_path / "nowhere", own) as group:
        assert group is None
    with control_group(LIMITS, tmp_path, tmp_path / "none") as group:
        assert group is None
