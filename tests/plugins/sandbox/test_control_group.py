"""Control groups of version 2, whose files a pretended kernel makes; real ones of this machine are in test_sandbox."""

from pathlib import Path

import pytest

from benchbot.plugins.sandbox.control_group import control_group
from benchbot.submission.modes import ProcessLimits

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
        assert group.entering(["run", "me"])[4:] == [str(folder / "cgroup.procs"), "--", "run", "me"]
        assert group.killed_for_memory()
        assert group.refused_processes()
        assert group.cpu_time_s() == 1.5

    assert list(kernel.rglob("benchbot-*")) == []


def test_without_any_there_is_no_group(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.write_text("0::/\n")

    with control_group(LIMITS, tmp_path / "nowhere", own) as group:
        assert group is None
    with control_group(LIMITS, tmp_path, tmp_path / "none") as group:
        assert group is None
