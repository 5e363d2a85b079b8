import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.records import Resources, WorkOrder
from benchbot.plugins.batch import machine
from benchbot.plugins.local_executor import workers
from tests.supervisor.harness import eventually

SLEEPS = (sys.executable, "-c", "import sys, time; print(sys.argv[1:], flush=True); time.sleep(600)")
DEAF = (
    sys.executable,
    "-c",
    "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('deaf', flush=True); time.sleep(600)",
)


def logs(folder: Path) -> str:
    return "".join(path.read_text() for path in (folder / "workers").glob("*.log"))


def test_workers_have_names_of_their_own_and_end_when_told(tmp_path: Path) -> None:
    fleet = workers.launch(WorkOrder(tmp_path, SLEEPS, 3))
    assert fleet.alive() == 3
    assert eventually(lambda: logs(tmp_path).count("--name") == 3)
    assert len(list((tmp_path / "workers").glob("local-*.log"))) == 3
    fleet.stop()
    fleet.stop()
    assert fleet.alive() == 0


def test_workers_are_found_again_by_their_reference(tmp_path: Path) -> None:
    fleet = workers.launch(WorkOrder(tmp_path, SLEEPS, 2))
    attached = workers.attach(fleet.reference)
    assert attached.alive() == 2
    os.kill(json.loads(fleet.reference)[0]["pid"], signal.SIGKILL)
    assert eventually(lambda: attached.alive() == 1)
    attached.stop()
    assert eventually(lambda: fleet.alive() == 0)


def test_a_deaf_worker_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "GRACE_S", 0.2)
    fleet = workers.launch(WorkOrder(tmp_path, DEAF, 1))
    assert eventually(lambda: "deaf" in logs(tmp_path))
    fleet.stop()
    assert fleet.alive() == 0


def test_each_worker_gets_gpus_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "0,2,5")
    shows = (sys.executable, "-c", "import os; print(os.environ['CUDA_VISIBLE_DEVICES'])")
    fleet = workers.launch(WorkOrder(tmp_path, shows, 3, Resources(gpus=1)))
    assert eventually(lambda: fleet.alive() == 0)
    assert sorted(logs(tmp_path).split()) == ["0", "2", "5"]
    with pytest.raises(BenchbotError, match="not enough GPUs"):
        workers.launch(WorkOrder(tmp_path, shows, 2, Resources(gpus=2)))


def test_a_program_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="cannot be started"):
        workers.launch(WorkOrder(tmp_path, ("/no/such/program",), 1))


@pytest.mark.parametrize(
    ("here", "memory_bytes", "jobs"),
    [
        (machine.Capacity(8, 64 * 2**30), 2**30, 8),
        (machine.Capacity(8, 3 * 2**30), 2**30, 3),
        (machine.Capacity(8, 2**20), 2**30, 1),
        (machine.Capacity(4, None), 2**30, 4),
    ],
)
def test_there_are_no_more_workers_than_memory_and_cores_allow(
    here: machine.Capacity, memory_bytes: int, jobs: int
) -> None:
    assert here.jobs(memory_bytes) == jobs


def test_this_machine_has_room_for_one_worker_at_least() -> None:
    assert machine.free_capacity().jobs() >= 1


def test_a_worker_that_has_no_batch_says_so(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchbot.plugins.batch.worker", str(tmp_path), "--name", "one"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3
    assert "There is no batch in" in done.stderr
