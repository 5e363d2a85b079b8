"""An episode in a place that is made when it is first used, on a node with a cache of its own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from plugins.envs_thousand.tests.short_runs import WHAT, prepare
from plugins.executor_slurm.tests.cluster import Cluster
from tests.machines import PATIENCE_S

pytestmark = [pytest.mark.xdist_group("slurm"), pytest.mark.slow]


def test_a_place_is_made_on_the_node_that_its_episode_is_computed_on(
    running: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    for node in running.nodes:
        node.run("mount", "-t", "tmpfs", "none", str(cache))
    monkeypatch.chdir(prepare(tmp_path / "home"))
    command = [
        *(*running.head.prefix, sys.executable, "-m", "benchbot", "batch", *WHAT, "--envs", "thousand_3:1"),
        *("--native", f"{sys.executable} solution/look.py", "--output-location", "batch"),
        *("--executor", "slurm", "--jobs", "1", "--memory-gb", "2", "--executor-option", "partition=main"),
    ]
    variables = {"BENCHBOT_CACHE_DIR": str(cache), "BENCHBOT_STATE_DIR": str(tmp_path / "state")}
    done = subprocess.run(
        command,
        env={**os.environ, **running.environment, **variables},
        capture_output=True,
        text=True,
        check=False,
        timeout=2 * PATIENCE_S,
    )

    assert done.returncode == 0, done.stderr
    made = [node.run("find", str(cache), "-name", "thousand_3_1.json").splitlines() for node in running.nodes]
    assert sorted(map(len, made)) == [0, 1]
