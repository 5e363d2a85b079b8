"""A batch on a real cluster that loses a node, and its driver, is the batch that this machine computes."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import IO

import pytest

from benchbot.core.errors import BenchbotError
from plugins.executor_ray.tests.cluster import Cluster, cluster
from plugins.executor_ray.tests.conftest import Driver
from tests import batches
from tests.machines import PATIENCE_S
from tests.supervisor.harness import eventually

pytestmark = [pytest.mark.xdist_group("ray"), pytest.mark.slow]

ON_RAY = ("--executor", "ray", "--jobs", "3")


def test_a_batch_survives_the_loss_of_a_node_and_of_its_driver_but_not_of_the_head(
    tmp_path: Path, folder: Path
) -> None:
    on_ray, logs = tmp_path / "on ray", tmp_path / "logs"
    logs.mkdir()
    with cluster(logs) as ray:

        def start(words: Sequence[str], log: IO[str]) -> "subprocess.Popen[str]":
            return ray.start(*words, log=log, on=ray.head, **batches.environment())

        batches.survive(on_ray, ON_RAY, start, ray.head, ray.nodes[1])

        driver = Driver(ray, on=ray.nodes[0])
        reference = driver.launch(folder, [sys.executable, "-c", "import time; time.sleep(600)"])
        assert driver.alive(reference) == 1
        ray.head.kill()
        with pytest.raises(BenchbotError, match="The Ray cluster was lost") as caught:
            eventually(lambda: driver.alive(reference) != 1, PATIENCE_S)
        assert "results that were written stay" in caught.value.why
        assert "run the same command again" in caught.value.fix
        driver.end()
    assert batches.results(on_ray) == batches.compute_here(tmp_path / "here")


def test_a_batch_that_is_cancelled_leaves_nothing_on_the_cluster(ray_cluster: Cluster, tmp_path: Path) -> None:
    folder = tmp_path / "batch"
    command = batches.command(folder, "--executor", "ray", "--jobs", "4", "--detach")
    begun = ray_cluster.run(*command, **batches.environment())
    assert begun.stdout == f"{folder}\n", begun.stderr
    assert eventually(lambda: batches.is_on_the_doomed_machine(folder), PATIENCE_S)
    ended = ray_cluster.run(*batches.BENCHBOT, "batch", "cancel", str(folder))
    assert ended.returncode == 0, ended.stderr
    assert not batches.working(folder)
    for machine in (ray_cluster.head, *ray_cluster.nodes):
        assert "benchbot.plugins.batch.worker" not in machine.run("ps", "axo", "cmd")


def test_a_dry_run_asks_the_cluster_and_begins_nothing(ray_cluster: Cluster, tmp_path: Path) -> None:
    command = batches.command(tmp_path / "batch", "--executor", "ray", "--dry-run")
    fits = ray_cluster.run(*command, **batches.environment())
    never = ray_cluster.run(*command, "--gpus", "64", **batches.environment())

    assert fits.returncode == 0, fits.stderr
    assert "Ray: the cluster at" in fits.stderr
    assert never.returncode == 2
    assert "No node of the Ray cluster can run a worker." in never.stderr
    assert not (tmp_path / "batch").exists()
