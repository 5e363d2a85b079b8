"""Wherever a worker is killed while it publishes, the next one ends with one whole result; and what is watched."""

import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import FailureClass
from benchbot.plugins.batch.attempts import Attempt, Attempts, AttemptWatcher
from benchbot.plugins.batch.machine import MemoryWatch
from benchbot.plugins.batch.plan import Policy

PROGRESS = {"state": "dirty", "frames": 1, "steps": 1, "waiting_for": None, "paused": False}


class KilledError(Exception):
    """Stands for the end of a process."""


@pytest.fixture
def attempts(tmp_path: Path) -> Attempts:
    return Attempts(tmp_path / "episode")


def computed(attempts: Attempts, text: str = "{}") -> Attempt:
    attempt = attempts.begin("worker")
    (attempt.folder / "log.txt").write_text("hello")
    (attempt.folder / "frames").mkdir()
    (attempt.folder / "frames" / "0.jpg").write_bytes(b"jpeg")
    (attempt.folder / "process.json").write_text("{}")
    (attempt.folder / "result.json").write_text(text)
    return attempt


def files(attempts: Attempts) -> list[str]:
    found = (path.relative_to(attempts.folder).as_posix() for path in attempts.folder.rglob("*") if path.is_file())
    return sorted(found)


def test_a_result_is_published_with_what_lies_beside_it(attempts: Attempts) -> None:
    assert attempts.finished() is None
    attempts.publish(computed(attempts), FailureClass.COLLISION)
    finished = attempts.finished()
    assert finished is not None
    assert (finished.failure, finished.worker) == (FailureClass.COLLISION, "worker")
    assert files(attempts) == ["attempts.jsonl", "frames/0.jpg", "log.txt", "result.json"]


def test_what_failed_is_kept_and_counted(attempts: Attempts) -> None:
    attempts.fail(computed(attempts), FailureClass.PLATFORM)
    attempts.fail(computed(attempts), FailureClass.INFRASTRUCTURE)
    assert attempts.failures() == [FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE]
    attempts.publish(computed(attempts), None)
    assert {"attempt-1/log.txt", "attempt-2/log.txt", "log.txt"} <= set(files(attempts))


@pytest.mark.parametrize("survived", range(6))
def test_a_publication_that_was_torn_is_finished_or_begun_anew(
    survived: int, attempts: Attempts, monkeypatch: pytest.MonkeyPatch
) -> None:
    attempt = computed(attempts)
    steps = [0]

    def dying(act: Any) -> Any:
        def acting(*arguments: Any, **options: Any) -> Any:
            if steps[0] == survived:
                raise KilledError
            steps[0] += 1
            return act(*arguments, **options)

        return acting

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", dying(Path.replace))
        patch.setattr(Path, "unlink", dying(Path.unlink))
        patch.setattr(Path, "rmdir", dying(Path.rmdir))
        with suppress(KilledError):
            attempts.publish(attempt, None)

    assert attempts.recover(), "the result had been computed: nobody computes it again"
    assert attempts.finished() is not None
    assert (attempts.folder / "frames" / "0.jpg").is_file()
    assert (attempts.folder / "log.txt").read_text() == "hello"


def test_an_attempt_that_vanished_is_counted_and_swept_aside(attempts: Attempts) -> None:
    computed(attempts)
    assert attempts.lost() == 1
    assert not attempts.recover()
    assert computed(attempts).number == 2


@pytest.mark.parametrize("damage", [b"", b"{", b"\0" * 64, b'{"another": "result"}'])
def test_a_damaged_result_is_none_and_is_kept_aside(damage: bytes, attempts: Attempts) -> None:
    attempts.publish(computed(attempts), None)
    attempts.result.write_bytes(damage)
    assert attempts.finished() is None
    assert not attempts.recover()
    attempts.publish(computed(attempts, "[]"), None)
    assert attempts.finished() is not None
    (kept,) = attempts.folder.glob("attempt-*/result.json")
    assert kept.read_bytes() == damage
    assert (kept.parent / "frames" / "0.jpg").is_file()


def test_beginning_anew_forgets_failures_and_keeps_everything(attempts: Attempts) -> None:
    attempts.fail(computed(attempts), FailureClass.PLATFORM)
    attempts.publish(computed(attempts, '{"number": 2}'), FailureClass.PLATFORM)
    attempts.begin_anew()
    assert attempts.finished() is None
    assert not attempts.recover()
    assert attempts.failures() == []
    attempts.publish(computed(attempts, '{"number": 3}'), None)
    texts = [path.read_text() for path in attempts.folder.glob("attempt-*/result.json")]
    assert '{"number": 2}' in texts


def test_a_solution_that_stands_still_is_stuck_unless_somebody_holds_it(tmp_path: Path) -> None:
    memory = MemoryWatch(os.getpid())
    memory.begin()
    with AttemptWatcher(tmp_path, Policy(stall_s=1e-9), lambda: True, memory) as watcher:
        assert watcher.look(PROGRESS, 1) is None
        assert all(watcher.look({**PROGRESS, "paused": True}, 1) is None for _ in range(3))
        assert all(watcher.look({**PROGRESS, "preparing": "the tree is built"}, 1) is None for _ in range(3))
        stuck = watcher.look(PROGRESS, 1)
    assert stuck is not None
    assert stuck.failure is FailureClass.TIMEOUT


def test_a_long_log_is_capped(tmp_path: Path) -> None:
    with AttemptWatcher(tmp_path, Policy(log_limit_bytes=1000), lambda: True, MemoryWatch(os.getpid())) as watcher:
        for number in range(1000):
            watcher.write(f"line {number}\n".encode())

    log = (tmp_path / "log.txt").read_text("utf-8")
    assert len(log) < 1100
    assert log.startswith("line 0\n")
    assert log.endswith("line 999\n")
    assert "bytes are left out here" in log
