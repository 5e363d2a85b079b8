import os
import time
from multiprocessing import get_context
from pathlib import Path

import psutil
import pytest

from benchbot.plugins.batch.claims import Claim, HeldClaim, Observer
from benchbot.plugins.batch.machine import ProcessId

KEY = "ab" * 32


def held(folder: Path, worker: str = "one") -> HeldClaim:
    claim = HeldClaim.take(folder / KEY, worker)
    assert claim is not None
    return claim


def put_elsewhere(path: Path) -> None:
    """Make a claim that of a process which is not of this machine, so that only its silence tells."""
    machine = ProcessId.of(os.getpid()).machine
    path.write_text(path.read_text().replace(machine, "x" * len(machine)))


def test_one_of_two_gets_a_claim_and_it_says_who(tmp_path: Path) -> None:
    claim = held(tmp_path)
    assert HeldClaim.take(tmp_path / KEY, "two") is None
    said = Claim.read(tmp_path / KEY)
    assert said is not None
    assert (said.worker, said.process.pid, said.count) == ("one", os.getpid(), 1)
    claim.beat()
    claim.beat()
    assert Claim.read(tmp_path / KEY) == Claim("one", claim.token, said.process, 3)
    claim.release()
    assert list(tmp_path.iterdir()) == []


def _take(folder: Path, names: list[str], wins: Path) -> None:
    for name in names:
        if HeldClaim.take(folder / name, str(os.getpid())) is not None:
            with wins.open("a") as file:
                file.write(f"{name}\n")


def test_of_many_processes_one_gets_each_claim(tmp_path: Path) -> None:
    folder, wins = tmp_path / "claims", tmp_path / "wins"
    folder.mkdir()
    names = [f"{number:064x}" for number in range(50)]
    spawn = get_context("spawn")
    processes = [spawn.Process(target=_take, args=(folder, names, wins)) for _ in range(4)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert sorted(wins.read_text().split()) == names


def test_a_worker_that_counts_is_not_stale_however_clocks_jump(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    claim = held(tmp_path)
    put_elsewhere(tmp_path / KEY)
    observer = Observer(tmp_path, stale_s=10.0)
    now_s = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    monkeypatch.setattr(time, "time", lambda: 4e9)
    os.utime(tmp_path / KEY, (0, 0))
    for _ in range(5):
        assert not observer.is_stale(KEY)
        now_s[0] += 9.0
        claim.beat()


def test_silence_makes_a_claim_stale_and_one_observer_gets_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    claim = held(tmp_path)
    put_elsewhere(tmp_path / KEY)
    one, other = Observer(tmp_path, stale_s=10.0), Observer(tmp_path, stale_s=10.0)
    now_s = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    assert not one.is_stale(KEY)
    assert not other.is_stale(KEY)
    now_s[0] += 11.0
    assert one.is_stale(KEY)
    assert other.is_stale(KEY)
    stolen = one.steal(KEY)
    assert stolen is not None
    assert stolen.worker == "one"
    assert other.steal(KEY) is None
    assert one.keys() == set()
    assert not claim.is_mine


def test_a_robbed_worker_does_not_take_away_the_claim_of_the_next(tmp_path: Path) -> None:
    robbed = held(tmp_path)
    assert Observer(tmp_path, 1.0).steal(KEY) is not None
    following = held(tmp_path, "two")
    assert not robbed.is_mine
    robbed.beat()
    robbed.release()
    assert following.is_mine


def _hold(folder: Path) -> None:
    HeldClaim.take(folder / KEY, "gone")


def test_a_dead_process_of_this_machine_is_known_at_once(tmp_path: Path) -> None:
    process = get_context("spawn").Process(target=_hold, args=(tmp_path,))
    process.start()
    process.join()
    assert Observer(tmp_path, stale_s=1e9).is_stale(KEY)


def test_a_claim_that_was_never_written_goes_stale_by_silence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / KEY).touch()
    observer = Observer(tmp_path, stale_s=10.0)
    now_s = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    assert not observer.is_stale(KEY)
    now_s[0] += 11.0
    assert observer.is_stale(KEY)
    observer.steal(KEY)
    assert HeldClaim.take(tmp_path / KEY, "next") is not None


def test_a_process_number_that_is_used_again_is_another_process() -> None:
    me = ProcessId.of(os.getpid())
    assert not me.is_dead
    assert ProcessId(me.machine, me.pid, me.started - 1).is_dead
    assert not ProcessId("another machine", me.pid, me.started - 1).is_dead
    assert not ProcessId("", me.pid, me.started - 1).is_dead


def test_a_clock_that_is_set_makes_no_process_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    me = ProcessId.of(os.getpid())
    boot_s, started_s = psutil.boot_time(), psutil.Process().create_time()
    # The kernel tells the time of the boot by the clock of now, and psutil counts starts from there.
    monkeypatch.setattr("psutil._psplatform.boot_time", lambda: boot_s + 3600.0)
    assert psutil.boot_time() == boot_s + 3600.0
    assert psutil.Process().create_time() == pytest.approx(started_s + 3600.0, abs=1.0)
    assert ProcessId.of(os.getpid()) == me
    assert not me.is_dead
