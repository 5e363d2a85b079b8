import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.process import how_it_ended, is_stopped, last_words, processors, start_module, tree
from tests.supervisor.harness import eventually


def test_a_process_that_a_signal_has_stopped_is_found_among_those_that_another_one_has_started() -> None:
    shell = subprocess.Popen(["sh", "-c", "sleep 60 & echo $!; wait"], stdout=subprocess.PIPE, text=True)
    try:
        assert shell.stdout is not None
        sleeper = int(shell.stdout.readline())
        assert list(tree(shell.pid)) == [shell.pid, sleeper]
        assert not any(map(is_stopped, tree(shell.pid)))

        os.kill(sleeper, signal.SIGSTOP)
        assert eventually(lambda: [pid for pid in tree(shell.pid) if is_stopped(pid)] == [sleeper])
    finally:
        for pid in [*tree(shell.pid)]:
            os.kill(pid, signal.SIGKILL)
        shell.communicate()
    assert list(tree(os.getpid())) == []
    assert not is_stopped(shell.pid)


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (0, "ended with exit code 0"),
        (3, "ended with exit code 3"),
        (-6, "was ended by SIGABRT"),
        (-9, "was ended by SIGKILL (somebody killed it, or the machine ran out of memory)"),
        (-50, "was ended by signal 50"),
    ],
)
def test_the_end_of_a_child_is_told_in_words(code: int, told: str) -> None:
    assert how_it_ended(code) == told


def test_the_last_lines_are_quoted(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(b"earlier\n" + b"".join(b"line %d\n" % number for number in range(100)) + b"\xff the end\n")
    with path.open("rb") as log:
        lines = last_words(log).splitlines()
        assert last_words(log, path.stat().st_size) == "It left no last words."
    assert lines[0] == "Its last words:"
    assert lines[-1].endswith(" the end")
    assert len(lines) == 16


def test_a_module_runs_in_a_session_of_its_own_and_is_not_shadowed_by_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "base64.py").write_text("print('shadow')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", "")
    with (tmp_path / "log").open("w+b") as log:
        process = start_module("base64", "-t", output=log)
        session = os.getsid(process.pid)
        assert process.wait(60) == 0
        assert session == process.pid != os.getsid(0)
        assert "Aladdin" in last_words(log)
        assert "shadow" not in last_words(log)


def quota(folder: Path, **files: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(f"{text}\n")


def test_the_tightest_quota_of_the_control_groups_around_a_process_bounds_its_processors(tmp_path: Path) -> None:
    root, membership = tmp_path / "cgroup", tmp_path / "membership"
    here = len(os.sched_getaffinity(0))
    assert processors(root, membership) == here, "no control groups"
    membership.write_text("0::/slurm/job_7/step_0\n")
    assert processors(root, membership) == here
    quota(root / "slurm", cpu__max="190000 100000")
    quota(root / "slurm" / "job_7" / "step_0", cpu__max="max 100000")
    quota(root / "slurm" / "job_8", cpu__max="50000 100000")
    assert processors(root, membership) == 1, "two are not there all the time"
    quota(root / "slurm", cpu__max=f"{(here + 3) * 1000} 1000")
    assert processors(root, membership) == here
    quota(root / "slurm" / "job_7", cpu__max="50000 100000")
    assert processors(root, membership) == 1


def test_quotas_of_the_first_version_of_control_groups_count_too(tmp_path: Path) -> None:
    root, membership = tmp_path / "cgroup", tmp_path / "membership"
    membership.write_text("5:memory:/docker/7\n4:cpu,cpuacct:/docker/7\n")
    quota(root / "cpu,cpuacct", cpu__cfs_quota_us="-1", cpu__cfs_period_us="100000")
    assert processors(root, membership) == len(os.sched_getaffinity(0))
    quota(root / "cpu,cpuacct" / "docker" / "7", cpu__cfs_quota_us="100000", cpu__cfs_period_us="100000")
    assert processors(root, membership) == 1


def test_the_affinity_of_a_process_bounds_its_processors() -> None:
    words = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}); "
    words += "from benchbot.process import processors; print(processors())"
    assert subprocess.run([sys.executable, "-c", words], capture_output=True, check=True).stdout == b"1\n"
