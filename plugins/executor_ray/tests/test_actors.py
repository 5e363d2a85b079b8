"""Workers on a real cluster. What they run here is short; whole batches are in `test_batch.py`."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from plugins.executor_ray.tests.cluster import Cluster
from plugins.executor_ray.tests.conftest import Driver
from tests.machines import PATIENCE_S
from tests.supervisor.harness import eventually

pytestmark = [pytest.mark.xdist_group("ray"), pytest.mark.slow]

SAYS_WHO_IT_IS = """\
import os, socket, sys
print(sys.argv[1:], socket.gethostname(), os.environ.get("CUDA_VISIBLE_DEVICES"), os.environ.get("BENCHBOT_TEST"))
"""
WAITS = """\
import os, signal, sys, time
def end(*_):
    print("ends in order", flush=True)
    sys.exit(0)
signal.signal(signal.SIGTERM, end)
print("waits", os.getppid(), flush=True)
time.sleep(600)
"""
PROMISES = f"""\
import sys
from pathlib import Path
from benchbot.core.findings import Level
from benchbot.testing import check_executor
from benchbot_executor_ray.plugin import benchbot_executors
(executor,) = benchbot_executors()
for finding in check_executor(executor, shared_folder=Path(sys.argv[1]), patience_s={PATIENCE_S}):
    if finding.level is not Level.OK:
        print(finding)
"""


def python(source: str) -> list[str]:
    return [sys.executable, "-c", source]


def logs(folder: Path) -> dict[str, str]:
    """Return what each worker has printed, by its name."""
    return {path.stem: path.read_text("utf-8") for path in (folder / "workers").glob("*.log")}


def all_say(folder: Path, word: str, count: int) -> bool:
    return eventually(lambda: sum(word in text for text in logs(folder).values()) == count, PATIENCE_S)


def ended(driver: Driver, reference: str) -> bool:
    return eventually(lambda: driver.alive(reference) == 0, PATIENCE_S)


def test_every_worker_has_a_name_and_a_log_of_its_own(driver: Driver, folder: Path) -> None:
    assert ended(driver, driver.launch(folder, python(SAYS_WHO_IT_IS), count=2))
    assert len(logs(folder)) == 2
    for name, text in logs(folder).items():
        assert text.startswith(f"['--name', '{name}'] {name.rpartition('-')[0]} ")


def test_it_keeps_the_promises_of_an_executor(ray_cluster: Cluster, tmp_path: Path) -> None:
    said = ray_cluster.run(*python(PROMISES), str(tmp_path))
    assert said.returncode == 0, said.stderr
    assert said.stdout == ""


def test_a_worker_is_lent_a_part_of_a_gpu(driver: Driver, folder: Path) -> None:
    assert ended(driver, driver.launch(folder, python(SAYS_WHO_IT_IS), options={"num_gpus": "0.5"}))
    ((name, text),) = logs(folder).items()
    assert name.startswith("head-")
    assert " head 0 " in text


def test_workers_outlive_whoever_launched_them_and_end_in_order_when_stopped(
    driver: Driver, ray_cluster: Cluster, folder: Path
) -> None:
    first = Driver(ray_cluster)
    reference = first.launch(folder, python(WAITS), count=4)
    assert all_say(folder, "waits", 3)
    (talks_with_ray,) = ray_cluster.head.run("pgrep", "-n", "-f", "benchbot_executor_ray.helper").split()
    ray_cluster.head.run("kill", "-9", talks_with_ray)
    # Three run, one waits for a core.
    assert first.alive(reference) == 4
    first.process.kill()
    first.process.wait()
    assert driver.alive(reference) == 4
    driver.stop(reference)
    assert ended(driver, reference)
    assert all_say(folder, "ends in order", 3)
    driver.stop(reference)


def test_a_worker_whose_time_is_over_ends_in_order(driver: Driver, folder: Path) -> None:
    reference = driver.launch(folder, python(WAITS), resources={"time_s": 3})
    assert ended(driver, reference)
    assert all_say(folder, "ends in order", 1)


def test_a_worker_ends_with_its_actor_and_begins_anew(driver: Driver, ray_cluster: Cluster, folder: Path) -> None:
    reference = driver.launch(folder, python(WAITS), options={"num_gpus": "1"})
    assert all_say(folder, "waits", 1)
    # The guard's parent is the actor, which Ray kills as it likes when memory runs out.
    guard = int(next(iter(logs(folder).values())).split()[1])
    actor = ray_cluster.head.run("ps", "-o", "ppid=", "-p", str(guard)).strip()
    ray_cluster.head.run("kill", "-9", actor)
    assert all_say(folder, "ends in order", 1)
    assert all_say(folder, "waits", 2)
    driver.stop(reference)
    assert all_say(folder, "ends in order", 2)


@pytest.mark.parametrize(
    ("order", "title", "fix"),
    [
        ({"resources": {"cpus": 64}}, "No node", "Ask for less"),
        ({"resources": {"gpus": 2}}, "No node", "num_gpus"),
        ({"resources": {"memory_bytes": 10**15}}, "No node", "--memory-gb"),
        ({"options": {"resources": '{"lidar": 1}'}}, "No node", "add a node"),
        ({"options": {"resources": "lidar"}}, "cannot be understood", "Correct"),
        ({"options": {"num_gpus": "half"}}, "cannot be understood", "Correct"),
        ({"options": {"num_cpus": "-1"}}, "cannot need -1 of CPU", "Correct"),
        ({"options": {"adress": "somewhere"}}, "no option adress", "Correct"),
    ],
)
def test_what_could_never_run_is_refused(
    driver: Driver, folder: Path, order: dict[str, Any], title: str, fix: str
) -> None:
    with pytest.raises(BenchbotError, match=title) as caught:
        driver.launch(folder, python(SAYS_WHO_IT_IS), **order)
    assert fix in caught.value.fix
    assert not logs(folder)


def test_a_folder_that_a_node_does_not_have_is_said(driver: Driver, tmp_path: Path) -> None:
    reference = driver.launch(tmp_path / "elsewhere", python(SAYS_WHO_IT_IS))
    with pytest.raises(BenchbotError, match="cannot run on its node") as caught:
        ended(driver, reference)
    assert f"has no {tmp_path / 'elsewhere' / 'plan.json'}" in caught.value.why
    assert "NFS" in caught.value.fix
    assert ended(driver, reference)


def test_a_cluster_that_is_gone_has_taken_its_workers_along(driver: Driver, folder: Path) -> None:
    gone = json.dumps({"address": "10.78.0.1:1", "namespace": "benchbot-of-old", "asked": {"CPU": 1}})
    assert driver.alive(gone) == 0
    driver.stop(gone)
    assert ended(driver, driver.launch(folder, python(SAYS_WHO_IT_IS)))


def test_where_there_is_no_cluster_it_is_said() -> None:
    program = """\
from pathlib import Path
from typing import Any
from benchbot.plugin import WorkOrder
from benchbot.core.errors import BenchbotError
from benchbot_executor_ray.workers import launch
try:
    launch(WorkOrder(Path(), ("true",), 1, options={"address": "127.0.0.1:1"}))
except BenchbotError as error:
    print(error)
"""
    said = subprocess.run(python(program), check=True, stdout=subprocess.PIPE, text=True).stdout
    assert said.startswith("There is no Ray cluster at 127.0.0.1:1 that can be used.\n")
    assert "ray start --head" in said
