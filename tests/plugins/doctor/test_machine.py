import os
import socket
import time
from pathlib import Path

import pytest

from benchbot.core.findings import Level
from benchbot.plugins.doctor import machine

TWO = {"library": True, "cuda": 12080, "devices": [["NVIDIA H200", 139 * 2**30], ["NVIDIA T4", 15 * 2**30]]}


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

        assert (machine._listener(listening.getsockname()[1]) or "").startswith(f"process {os.getpid()} (")


def test_this_machine_has_processors_memory_and_a_time() -> None:
    assert [finding.subject for finding in (machine.processors(), machine.clock())] == ["machine", "clock"]


@pytest.mark.parametrize(
    ("answer", "driver", "level", "detail"),
    [
        ({"library": False}, False, Level.OK, "none, and none is needed: the ray tracer runs on the processor"),
        (
            {"library": False},
            True,
            Level.WARNING,
            "NVIDIA's driver is loaded, and CUDA's library (libcuda.so.1) is mis",
        ),
        ({"library": True, "error": "CUDA_ERROR_NO_DEVICE"}, False, Level.OK, "none, and none is needed"),
        (
            {"library": True, "error": "CUDA_ERROR_UNKNOWN"},
            True,
            Level.WARNING,
            "CUDA's library is there and does not st",
        ),
        ({"library": True, "cuda": 12080, "devices": []}, True, Level.OK, "none, and none is needed"),
        (TWO, True, Level.OK, "NVIDIA H200 (139 GiB), NVIDIA T4 (15 GiB), CUDA 12.8, which the ray tracer uses when"),
    ],
)
def test_what_cuda_says_is_told(
    answer: dict[str, object], driver: bool, level: Level, detail: str, tmp_path: Path
) -> None:
    if driver:
        (tmp_path / "version").touch()

    finding = machine.gpu(tmp_path / "version", f"import json; print(json.dumps({answer!r}))")

    assert (finding.level, finding.subject) == (level, "GPU")
    assert finding.detail.startswith(detail)
    assert bool(finding.fix) == (level is not Level.OK)


def test_gpus_that_are_hidden_are_told_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")

    finding = machine.gpu(tmp_path, 'print(\'{"library": true, "error": "CUDA_ERROR_NO_DEVICE"}\')')

    assert finding.detail.startswith("none to be seen, since CUDA_VISIBLE_DEVICES is ''.")


def test_a_driver_that_crashes_takes_nothing_with_it(tmp_path: Path) -> None:
    finding = machine.gpu(tmp_path, "import os; os.abort()")

    assert (finding.level, finding.detail) == (Level.WARNING, "CUDA does not start: signal 6")


def test_this_machine_answers() -> None:
    finding = machine.gpu()

    assert finding.detail
