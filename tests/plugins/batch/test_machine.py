"""An episode waits for the memory that those before it took."""

import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.plugins.batch import machine
from benchbot.plugins.batch.machine import MemoryWatch

SIZE = 150_000_000
HOLDER = f"import sys; held = b'x' * {SIZE}; print('holds', flush=True); sys.stdin.read()"
BETWEEN = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {HOLDER!r}])"


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> MemoryWatch:
    """A watch that has seen one episode, whose grandchild took `SIZE` bytes and has ended."""
    monkeypatch.setattr(machine, "SAMPLE_PERIOD_S", 0.0)
    monkeypatch.setattr(machine, "POLL_S", 0.0)
    with subprocess.Popen([sys.executable, "-c", BETWEEN], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        made = MemoryWatch(child.pid)
        made.begin()
        assert child.stdout is not None
        child.stdout.readline()
        made.sample()
    return made


def test_what_the_last_episodes_took_is_waited_for_and_it_is_said_once(
    watch: MemoryWatch, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = iter([10_000_000, 20_000_000, 10**12])
    told: list[tuple[int, int]] = []
    monkeypatch.setattr(machine, "free_memory_bytes", lambda: next(looks))
    watch.wait_for_room(lambda: True, lambda *said: told.append(said))
    assert next(looks, None) is None
    ((free, needed),) = told
    assert free == 10_000_000
    assert SIZE < needed < SIZE * 1.3


def test_only_the_last_few_episodes_count(watch: MemoryWatch) -> None:
    for _ in range(machine.REMEMBERED_EPISODES):
        assert watch.needed_bytes > SIZE
        watch.begin()
    assert watch.needed_bytes == 0


def test_nobody_waits_for_memory_for_ever_or_when_nobody_waits_for_the_result(
    watch: MemoryWatch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine, "free_memory_bytes", lambda: 0)
    watch.wait_for_room(lambda: False, lambda *_: None)
    monkeypatch.setattr(machine, "MEMORY_TIMEOUT_S", 0.1)
    watch.wait_for_room(lambda: True, lambda *_: None)


def group(folder: Path, limit: str, used: int, cached: int) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("max", limit), ("current", str(used)), ("stat", f"anon 5\ninactive_file {cached}")):
        (folder / f"memory.{name}").write_text(f"{text}\n")


def test_the_tightest_of_the_control_groups_around_a_process_counts(tmp_path: Path) -> None:
    root, membership = tmp_path / "cgroup", tmp_path / "membership"
    membership.write_text("0::/slurm/job_7/step_0\n")
    group(root / "slurm", "9000", 1000, 0)
    group(root / "slurm" / "job_7", "4000", 3000, 500)
    group(root / "slurm" / "job_7" / "step_0", "max", 3000, 0)
    group(root / "slurm" / "job_8", "10", 10, 0)
    assert machine.group_bytes(root, membership) == 1500
    (root / "slurm" / "job_7" / "memory.max").write_text("max\n")
    assert machine.group_bytes(root, membership) == 8000
    membership.write_text("4:memory:/job_7\n0::/\n")
    assert machine.group_bytes(root, membership) is None
    old = root / "memory"
    old.mkdir()
    for name, text in (("limit_in_bytes", "700"), ("usage_in_bytes", "300"), ("stat", "total_inactive_file 50")):
        (old / f"memory.{name}").write_text(f"{text}\n")
    assert machine.group_bytes(root, membership) == 450
