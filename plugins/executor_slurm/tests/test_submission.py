"""Workers on a real cluster. What they run here is short; whole batches are in `test_batch.py`."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from benchbot.cli.kit.preflight import Intent
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Level
from benchbot.core.records import Resources, WorkOrder
from benchbot.plugin import Catalog, load_plugins
from benchbot.testing import check_executor
from benchbot_executor_slurm.array_job import ArrayJob
from benchbot_executor_slurm.commands import ask
from benchbot_executor_slurm.plugin import benchbot_executors
from benchbot_executor_slurm.submission import check, launch
from plugins.executor_slurm.tests.cluster import Cluster
from tests.machines import PATIENCE_S
from tests.supervisor.harness import eventually

pytestmark = pytest.mark.xdist_group("slurm")

SAYS_WHO_IT_IS = "import os, sys; print(sys.argv[1:], os.getcwd(), os.environ.get('CUDA_VISIBLE_DEVICES'))"
WAITS = """\
import signal, sys, time
def end(*_):
    print("ends in order", flush=True)
    sys.exit(0)
signal.signal(signal.SIGTERM, end)
print("waits", flush=True)
time.sleep(600)
"""


def order(
    folder: Path,
    source: str,
    count: int = 1,
    resources: Resources | None = None,
    options: Mapping[str, str] | None = None,
) -> WorkOrder:
    command = (sys.executable, "-c", source)
    return WorkOrder(folder, command, count, resources or Resources(memory_bytes=10**9), options or {})


def logs(folder: Path) -> dict[str, str]:
    """Return what each worker has printed, by its name."""
    return {path.stem: path.read_text("utf-8") for path in (folder / "workers").glob("node*.log")}


def ended(job: ArrayJob) -> bool:
    return eventually(lambda: job.alive() == 0, PATIENCE_S)


@pytest.mark.usefixtures("slurm")
def test_every_worker_has_a_name_and_a_log_of_its_own(folder: Path) -> None:
    job = launch(order(folder, SAYS_WHO_IT_IS, count=3))
    assert ended(job)
    names = [name.split("-") for name in logs(folder)]
    assert sorted(rest for _, *rest in names) == [[job.job, str(task), "0"] for task in range(3)]
    assert {node for node, *_ in names} <= {"node1", "node2"}
    assert all(text == f"['--name', '{name}'] {Path.cwd()} None\n" for name, text in logs(folder).items())


@pytest.mark.usefixtures("slurm")
def test_before_anything_is_submitted_slurm_says_whether_it_would_run_the_workers(folder: Path) -> None:
    fits, never = order(folder, "pass", count=2), order(folder, "pass", options={"partition": "nowhere"})

    (finding,) = check(Catalog(load_plugins()), Intent(executor="slurm", order=fits))
    with pytest.raises(BenchbotError, match="Slurm does not take the batch") as refused:
        list(check(Catalog(load_plugins()), Intent(executor="slurm", order=never)))

    assert (finding.level, finding.subject) == (Level.OK, "Slurm")
    assert "--executor-option partition=NAME" in refused.value.fix
    assert ask("squeue", "--noheader", "--name", f"benchbot-{folder.name}").said == ""
    assert not list(folder.iterdir())


@pytest.mark.usefixtures("slurm")
def test_a_worker_is_lent_the_gpus_that_it_asks_for(folder: Path) -> None:
    assert ended(launch(order(folder, SAYS_WHO_IT_IS, resources=Resources(gpus=1))))
    ((name, text),) = logs(folder).items()
    assert name.startswith("node1-")
    assert text.endswith(" 0\n")


@pytest.mark.usefixtures("slurm")
def test_workers_that_are_stopped_end_in_order_wherever_they_are(folder: Path) -> None:
    job = launch(order(folder, WAITS, count=4))
    assert eventually(lambda: list(logs(folder).values()) == ["waits\n"] * 2, PATIENCE_S)
    # Two run, two wait for a core.
    assert job.alive() == 4
    found = ArrayJob.attach(job.reference)
    found.stop()
    assert ended(found)
    assert ended(job)
    assert list(logs(folder).values()) == ["waits\nends in order\n"] * 2
    found.stop()


@pytest.mark.usefixtures("slurm")
def test_it_keeps_the_promises_of_an_executor(tmp_path: Path) -> None:
    (executor,) = benchbot_executors()
    findings = check_executor(executor, shared_folder=tmp_path, patience_s=PATIENCE_S)
    assert [finding for finding in findings if finding.level is not Level.OK] == []


def test_the_warning_before_the_time_is_over_reaches_the_worker(slurm: Cluster, folder: Path) -> None:
    job = launch(order(folder, WAITS, resources=Resources(time_s=600)))
    assert eventually(lambda: list(logs(folder).values()) == ["waits\n"], PATIENCE_S)
    assert "TimeLimit=00:10:00" in slurm.ask("scontrol", "show", "job", job.job)
    # What --signal=B:TERM@60 does a minute before the end.
    slurm.ask("scancel", "--signal=TERM", "--batch", job.job)
    assert ended(job)
    assert list(logs(folder).values()) == ["waits\nends in order\n"]


@pytest.mark.usefixtures("slurm")
def test_a_file_that_was_named_is_read_before_the_worker_starts(folder: Path, tmp_path: Path) -> None:
    setup = tmp_path / "my modules.sh"
    setup.write_text("export CUDA_VISIBLE_DEVICES=from-the-file\n", "utf-8")
    assert ended(launch(order(folder, SAYS_WHO_IT_IS, options={"setup": str(setup)})))
    assert next(iter(logs(folder).values())).endswith("from-the-file\n")


@pytest.mark.usefixtures("slurm")
def test_a_job_that_slurm_has_forgotten_is_over() -> None:
    job = ArrayJob.attach(json.dumps({"job": "987654", "count": 4}))
    assert job.alive() == 0
    job.stop()


def test_a_controller_that_does_not_answer_changes_nothing(
    slurm: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    configuration = (slurm.commands.parent / "slurm.conf").read_text("utf-8")
    (tmp_path / "slurm.conf").write_text(configuration + "SlurmctldPort=1\nMessageTimeout=1\n", "utf-8")
    monkeypatch.setenv("SLURM_CONF", str(tmp_path / "slurm.conf"))
    assert ArrayJob("1", 4).alive() == 4
    with pytest.raises(BenchbotError, match="could not be cancelled"):
        ArrayJob("1", 4).stop()


@pytest.mark.usefixtures("slurm")
@pytest.mark.parametrize(
    ("options", "resources", "title", "fix"),
    [
        ({"partition": "graphic"}, Resources(), "does not take", "Did you mean 'graphics'?"),
        ({"qos": "gold", "licenses": "none@here"}, Resources(), "does not take", "--licenses=none@here"),
        ({}, Resources(gpus=2), "does not take", "main* (1 x 1 cores, 4000 MB, GPUs: gpu:1"),
        ({"partitoin": "main"}, Resources(), "no option partitoin", "benchbot batch --help"),
        ({"setup": "no-such.sh"}, Resources(), "is not there", "setup=FILE"),
    ],
)
def test_what_cannot_run_is_refused_with_what_to_do(
    folder: Path, options: dict[str, str], resources: Resources, title: str, fix: str
) -> None:
    with pytest.raises(BenchbotError, match=title) as caught:
        launch(order(folder, SAYS_WHO_IT_IS, resources=resources, options=options))
    assert fix in caught.value.fix
    assert not list(folder.glob("workers/*"))


@pytest.mark.usefixtures("slurm")
def test_what_slurm_queues_although_it_can_never_run_is_cancelled_and_said(folder: Path) -> None:
    job = launch(order(folder, SAYS_WHO_IT_IS, count=2, resources=Resources(cpus=64)))
    with pytest.raises(BenchbotError, match="will never run") as caught:
        ended(job)
    assert "PartitionConfig" in caught.value.why
    assert "1 cores" in caught.value.fix
    assert job.alive() == 0


def test_a_machine_without_slurm_says_so(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BenchbotError, match="no Slurm here") as caught:
        launch(order(folder, SAYS_WHO_IT_IS))
    assert "login node" in caught.value.fix
    # Elsewhere they may well go on.
    assert ArrayJob("1", 4).alive() == 4
