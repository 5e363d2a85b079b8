"""A challenge whose submissions are computed on a cluster."""

from pathlib import Path

import pytest

from plugins.executor_slurm.tests.cluster import Cluster
from tests import batches
from tests.plugins.challenge.clusters import computed_on

pytestmark = [pytest.mark.xdist_group("slurm"), pytest.mark.slow]


def test_a_submission_is_computed_by_slurm(running: Cluster, tmp_path: Path) -> None:
    executor = {"executor": "slurm", "memory_gb": 1, "executor_options": {"partition": "main"}}
    row, log = computed_on(running.head, tmp_path, executor, batches.environment(**running.environment))
    assert (row.state, row.attempt) == ("scored", 1), log
    assert running.ask("squeue", "--noheader") == ""
