import json
import os
import socket
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchbot.core import resources
from benchbot.core.errors import BenchbotError
from benchbot.wire import run_state
from benchbot.wire.run_state import RUN, Connection, RunFolder, RunState


def state_of(
    folder: RunFolder,
    socket: str | None = None,
    started_s: float | None = None,
    owner: str = RUN,
    connection: Connection | None = None,
) -> RunState:
    return RunState(
        connection=connection or Connection("http://127.0.0.1:1", socket, "secret"),
        operator_token="another secret",
        pid=1,
        task="task",
        robot="robot",
        environment="arena:1",
        seed=0,
        folder=str(folder.path),
        platform_log="",
        supervisor_log="",
        result=str(folder.result),
        started_s=time.time() if started_s is None else started_s,
        owner=owner,
    )


def leave_behind(socket: str | None = None) -> Path:
    """Publish a run from a process that is killed."""
    code = (
        "import os, signal\n"
        "from tests.wire.test_run_state import state_of\n"
        "from benchbot.wire.run_state import RunFolder\n"
        "folder = RunFolder()\n"
        f"folder.publish(state_of(folder, {socket!r}))\n"
        "print(folder.path, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return Path(done.stdout.strip())


def test_a_published_run_is_found() -> None:
    folder = RunFolder()
    folder.publish(state_of(folder))
    assert run_state.live() == [RunState.from_dict(state_of(folder, started_s=run_state.live()[0].started_s).as_dict())]
    folder.close(keep=False)
    assert run_state.live() == []
    assert not folder.path.exists()


def test_the_newest_run_is_found() -> None:
    folders = [RunFolder() for _ in range(3)]
    for folder, started_s in zip(folders, (10.0, 30.0, 20.0), strict=True):
        folder.publish(state_of(folder, started_s=started_s))
    assert [state.started_s for state in run_state.live()] == [30.0, 20.0, 10.0]
    for folder in folders:
        folder.close(keep=False)


def test_what_belongs_to_another_user_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = RunFolder()
    folder.publish(state_of(folder))
    monkeypatch.setattr(os, "geteuid", lambda: folder.path.stat().st_uid + 1)
    assert run_state.live() == []
    RunFolder().close(keep=False)
    assert (folder.path / "run.json").exists()
    folder.close(keep=False)


def test_what_a_run_writes_is_private() -> None:
    folder = RunFolder()
    folder.publish(state_of(folder))
    assert stat.S_IMODE(folder.path.stat().st_mode) == 0o700
    assert stat.S_IMODE((folder.path / "run.json").stat().st_mode) == 0o600
    folder.close(keep=False)


def test_a_kept_folder_loses_its_state_file_only() -> None:
    folder = RunFolder()
    folder.publish(state_of(folder))
    folder.result.write_text("{}")
    folder.close(keep=True)
    assert [path.name for path in folder.path.iterdir()] == ["result.json"]


def test_a_killed_run_is_ignored_and_cleaned_up_by_the_next(tmp_path: Path) -> None:
    socket = tmp_path / "socket"
    socket.touch()
    dead = leave_behind(str(socket))
    assert (dead / "run.json").exists()
    assert run_state.live() == []
    RunFolder().close(keep=False)
    assert not (dead / "run.json").exists()
    assert not socket.exists()


def test_runs_that_end_while_others_are_looked_for_are_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    ending, staying = [RunFolder() for _ in range(9)], RunFolder()
    for folder in (*ending, staying):
        folder.publish(state_of(folder))

    def listed(path: Path) -> list[os.DirEntry[str]]:
        patched.undo()
        entries = list(os.scandir(path))
        for folder in ending:
            folder.close(keep=False)
        return entries

    with monkeypatch.context() as patched:
        patched.setattr(os, "scandir", listed)
        assert [state.folder for state in run_state.live()] == [str(staying.path)]


def test_a_damaged_state_file_is_ignored() -> None:
    folder = RunFolder()
    for text in ("", "{", "[]", json.dumps({"connection": 3}), json.dumps({"connection": {}, "pid": 1})):
        (folder.path / "run.json").write_text(text)
        assert run_state.live() == []
    folder.close(keep=False)


def test_old_folders_do_not_pile_up() -> None:
    folders = [RunFolder() for _ in range(run_state.KEPT_FOLDERS + 5)]
    for folder in folders:
        folder.close(keep=True)
    RunFolder().close(keep=False)
    assert len(list((resources.state_dir() / "runs").iterdir())) == run_state.KEPT_FOLDERS


def test_a_state_folder_that_cannot_be_written_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "runs").write_text("in the way")
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path))
    with pytest.raises(BenchbotError, match="cannot write") as caught:
        RunFolder()
    assert "BENCHBOT_STATE_DIR" in caught.value.fix


def test_a_socket_counts_from_its_first_listener_to_its_last(tmp_path: Path) -> None:
    path = tmp_path / "there.sock"
    assert not run_state.is_listening(path)
    with socket.socket(socket.AF_UNIX) as there:
        there.bind(str(path))
        assert not run_state.is_listening(path)
        there.listen()
        assert run_state.is_listening(path)
    assert path.is_socket()
    assert not run_state.is_listening(path)


def test_what_is_no_place_for_a_socket_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="Not a directory"):
        run_state.is_listening(tmp_path / "file" / "there.sock")
