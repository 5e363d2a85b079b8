import os
import signal
import subprocess
from pathlib import Path

import pytest

from benchbot.process import how_it_ended, is_stopped, last_words, start_module, tree
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
