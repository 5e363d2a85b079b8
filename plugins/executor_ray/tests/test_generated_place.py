"""Episodes in a place that is made when it is first used, on nodes with caches of their own."""

import sys
from pathlib import Path

import pytest

from plugins.envs_thousand.tests.short_runs import WHAT, prepare
from plugins.executor_ray.tests.cluster import Cluster

pytestmark = [pytest.mark.xdist_group("ray"), pytest.mark.slow]

MEETS = """\
import socket, sys, time
from pathlib import Path

hosts = Path(sys.argv[1])
(hosts / socket.gethostname()).touch()
while len(list(hosts.iterdir())) < 2:
    time.sleep(0.05)
"""
"""Goes on when there is an episode on two machines: one of them is not the head, where the batch was planned."""


def test_a_place_is_made_on_the_nodes_that_its_episodes_are_computed_on(
    ray_cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache, hosts, folder = tmp_path / "cache", tmp_path / "hosts", prepare(tmp_path / "home")
    cache.mkdir()
    hosts.mkdir()
    for machine in (ray_cluster.head, *ray_cluster.nodes):
        machine.run("mount", "-t", "tmpfs", "none", str(cache))
    solution = folder / "solution" / "look.py"
    solution.write_text(MEETS + solution.read_text("utf-8"), "utf-8")
    monkeypatch.chdir(folder)
    done = ray_cluster.run(
        *(sys.executable, "-m", "benchbot", "batch", *WHAT, "--envs", "thousand_3:1", "--seeds", "0..1"),
        *("--native", f"{sys.executable} solution/look.py {hosts}", "--output-location", "batch", "--no-canary"),
        *("--executor", "ray", "--jobs", "2"),
        BENCHBOT_CACHE_DIR=str(cache),
        BENCHBOT_STATE_DIR=str(tmp_path / "state"),
    )

    assert done.returncode == 0, done.stderr
    made = {
        machine.name
        for machine in (ray_cluster.head, *ray_cluster.nodes)
        if machine.run("find", str(cache), "-name", "thousand_3_1.json")
    }
    assert made == {"head", *(path.name for path in hosts.iterdir())}
