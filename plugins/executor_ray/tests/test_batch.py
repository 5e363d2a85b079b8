"""A batch on a real cluster that loses a node, and its driver, is the batch that this machine computes."""

import json
import subprocess
from pathlib import Path

import pytest

from plugins.executor_ray.tests.cluster import Cluster, cluster
from tests import batches
from tests.machines import PATIENCE_S
from tests.supervisor.harness import eventually

pytestmark = [pytest.mark.xdist_group("ray"), pytest.mark.slow]


def test_a_batch_survives_the_loss_of_a_node_and_of_its_driver(tmp_path: Path) -> None:
    folder, logs = tmp_path / "on ray", tmp_path / "logs"
    logs.mkdir()
    with cluster(logs) as ray, (logs / "driver.log").open("w+") as log:
        command = batches.command(folder, "--executor", "ray", "--jobs", "3", "--json")

        def begin() -> "subprocess.Popen[str]":
            return ray.start(*command, log=log, **batches.environment())

        driver = begin()
        assert eventually(lambda: batches.is_on_the_doomed_machine(folder), PATIENCE_S)
        (inside,) = ray.head.run("pgrep", "-f", "benchbot.cli.app").split()
        ray.head.run("kill", "-9", inside)
        driver.communicate()
        ray.nodes[1].kill()
        again = begin()
        said, _ = again.communicate(timeout=2 * PATIENCE_S)
        log.seek(0)
        assert again.returncode == 0, log.read()
        assert json.loads(said)["status"]["finished"] == batches.EPISODES
        assert {str(event["worker"]).split("-")[0] for event in batches.told(folder, "stole")} == {batches.DOOMED}
    assert batches.results(folder) == batches.compute_here(tmp_path / "here")


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
        assert "benchbot.batch.worker" not in machine.run("ps", "axo", "cmd")
