"""A batch on a real cluster that loses a node, and its driver, is the batch that this machine computes."""

import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import IO

import pytest

from plugins.executor_slurm.tests.cluster import Cluster, cluster
from tests import batches
from tests.machines import PATIENCE_S
from tests.supervisor.harness import eventually

pytestmark = [pytest.mark.xdist_group("slurm"), pytest.mark.slow]

ON_SLURM = ("--executor", "slurm", "--jobs", "2", "--memory-gb", "1", "--executor-option", "partition=main")


def test_a_batch_survives_the_loss_of_a_node_and_of_its_driver(tmp_path: Path) -> None:
    folder, logs = tmp_path / "on slurm", tmp_path / "logs"
    logs.mkdir()
    with cluster(logs) as slurm:

        def start(words: Sequence[str], log: IO[str]) -> "subprocess.Popen[str]":
            environment = batches.environment(**slurm.environment)
            command = [*slurm.head.prefix, *words]
            return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, env=environment, text=True)

        batches.survive(folder, ON_SLURM, start, slurm.head, slurm.nodes[1])
    assert batches.results(folder) == batches.compute_here(tmp_path / "here")


def test_a_batch_that_is_interrupted_leaves_nothing_on_the_cluster(running: Cluster, tmp_path: Path) -> None:
    folder = tmp_path / "batch"
    command = [*running.head.prefix, *batches.command(folder, *ON_SLURM)]
    environment = batches.environment(**running.environment)
    with subprocess.Popen(command, stderr=subprocess.PIPE, env=environment, text=True) as driver:
        assert eventually(lambda: batches.is_on_the_doomed_machine(folder), PATIENCE_S)
        (inside,) = running.head.run("pgrep", "-f", "--", "-m benchbot batch").split()
        running.head.run("kill", f"-{signal.SIGINT.value}", inside)
        _, said = driver.communicate(timeout=PATIENCE_S)
    assert driver.returncode == 130
    assert "Go on with: benchbot batch attach" in said
    assert eventually(lambda: running.ask("squeue", "--noheader") == "", PATIENCE_S)
    assert not batches.working(folder)
