"""A disk that is full is waited for: by workers, by the driver, and by what is made at the end."""

import errno
import json
import os
import resource
import shutil
import signal
from contextlib import suppress
from pathlib import Path

import pytest

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import journal, machine, plan
from benchbot.plugins.batch.claims import HeldClaim
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.status import Monitor
from tests.command_line import wait_for
from tests.plugins.batch.conftest import Batches, wait_until

pytestmark = pytest.mark.xdist_group("batch chaos")
FULL = OSError(errno.ENOSPC, "No space left on device")


def test_the_driver_outlives_a_full_disk_on_which_all_workers_are_lost(batches: Batches) -> None:
    words = ["--args", "0.3", "--jobs", "1"]
    batches.run("undisturbed", *words, envs="arena:1")
    process = batches.cli.start(*batches.words("full", *words, envs="arena:1"))
    wait_until(lambda: batches.told("full", "began"))
    driver, worker = (only(batches, words) for words in ("-m benchbot batch", "benchbot.plugins.batch.worker"))
    _, hard = resource.prlimit(driver, resource.RLIMIT_FSIZE)

    # What the driver writes, and workers that it starts inherit, fails as it does on a full disk.
    resource.prlimit(driver, resource.RLIMIT_FSIZE, (0, hard))
    os.kill(worker, signal.SIGKILL)
    wait_until(lambda: len(list(batches.path("full").glob("workers/*.log"))) > 5 or process.poll() is not None)
    assert process.poll() is None, process.communicate()
    resource.prlimit(driver, resource.RLIMIT_FSIZE, (hard, hard))
    # A worker that was launched a moment before has inherited the limit, which no disk would have.
    wait_until(lambda: process.poll() is not None or not free_workers(batches, hard))
    _, said = process.communicate(timeout=300)

    assert process.returncode == 0, said
    assert batches.results("full") == batches.results("undisturbed")


def only(batches: Batches, words: str) -> int:
    """Return the one process of a command; a program that it starts is called alike until it begins."""
    wait_until(lambda: len(batches.processes(words)) == 1)
    return batches.processes(words)[0]


def free_workers(batches: Batches, hard: int) -> bool:
    """Lift the limit of all workers; return True, to be called again and again."""
    for worker in batches.processes("benchbot.plugins.batch.worker"):
        with suppress(ProcessLookupError):
            resource.prlimit(worker, resource.RLIMIT_FSIZE, (hard, hard))
    return True


def test_nothing_is_launched_below_the_room_that_an_episode_needs(batches: Batches) -> None:
    assert batches.run("b", seeds="0", envs="arena:1").returncode == 0
    folder = Folder(batches.path("b"))
    document = json.loads(folder.plan.read_text())
    document["policy"]["minimum_free_bytes"] = 2 * shutil.disk_usage(folder.path).total
    shutil.rmtree(folder.episodes)
    folder.plan.write_text(json.dumps(document))

    process = batches.cli.start("batch", "attach", "b", "--display", "plain")
    said = wait_for(process, "PAUSED")
    assert "MiB are needed" in said
    assert not batches.told("b", "began") > 1
    assert paused(folder)
    document["policy"]["minimum_free_bytes"] = 0
    folder.plan.write_text(json.dumps(document))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)

    assert not paused(folder), "there is room again"
    assert batches.cli("batch", "attach", "b").returncode == 0


def paused(folder: Folder) -> str | None:
    return Monitor(folder, plan.read(folder.plan)).look().paused


def test_a_pause_of_a_worker_that_is_gone_is_told_no_more(batches: Batches) -> None:
    process = batches.cli.start(*batches.words("b", "--jobs", "1", "--args", "5", seeds="0"))
    wait_until(lambda: batches.told("b", "began"))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    folder = Folder(batches.path("b"))
    (episode, *_) = plan.read(folder.plan).episodes
    said = {"time_s": 9e12, "who": "w", "what": "paused", "why": "/: No space left on device", "key": episode.key}
    journal.append(folder.events / "w.jsonl", said)

    assert paused(folder) is None
    claim = HeldClaim.take(folder.claims / episode.key, "w")
    assert claim is not None
    assert paused(folder) == "/: No space left on device"
    claim.release()
    assert paused(folder) is None


def test_what_writes_is_tried_again_until_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "POLL_S", 0.0)
    tries: list[int] = []
    told: list[Exception] = []

    def write() -> str:
        tries.append(1)
        if len(tries) == 2:
            raise FULL
        if len(tries) < 4:
            raise atomic.cannot_write(Path("x"), FULL) from FULL
        return "written"

    tries.append(1)
    assert machine.when_there_is_room(write, lambda: True, told.append) == "written"
    assert (len(tries), told) == (4, [FULL])


def test_what_is_wanted_no_more_or_fails_for_another_reason_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "POLL_S", 0.0)

    def full() -> None:
        raise FULL

    def denied() -> None:
        raise atomic.cannot_write(Path("x"), PermissionError(13, "Permission denied"))

    with pytest.raises(OSError, match="No space left"):
        machine.when_there_is_room(full, lambda: False, lambda _: None)
    with pytest.raises(BenchbotError, match="Cannot write x"):
        machine.when_there_is_room(denied, lambda: True, lambda _: None)
