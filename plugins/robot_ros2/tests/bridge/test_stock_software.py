"""Nav2, slam_toolbox, RTAB-Map, robot_localization and RViz would hear a bridged robot, and not stumble.

Nav2 is not on PyPI: a node that imports nothing of BenchBot subscribes as their public sources do, and looks at every
message as they would.
"""

import json
import subprocess
import sys
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import pytest

from plugins.robot_ros2.tests.bridge.bridged import bridge
from plugins.robot_ros2.tests.bridge.stock_software import SUBSCRIPTIONS, table

NODE = Path(__file__).with_name("stock_node.py")
LISTEN_S = 8


@pytest.mark.slow
@pytest.mark.xdist_group("renderer")
def test_every_node_hears_what_it_subscribes_to_and_can_use_it(
    domain: int, kernel_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    subscriptions = json.dumps([asdict(item) for item in SUBSCRIPTIONS])
    with bridge("--robot", "carter_lidar", "--env", "miniroom:1", "--map"):
        done = subprocess.run(
            [sys.executable, "-P", str(NODE), str(LISTEN_S)],
            input=subscriptions,
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert {name: found for name, found in report["complaints"].items() if found} == {}
    assert len(report["complaints"]) == len(SUBSCRIPTIONS)
    assert report["clocks"] == 1


def test_the_node_imports_nothing_of_benchbot() -> None:
    assert "benchbot" not in NODE.read_text().replace("BenchBot", "").lower().replace("imports nothing of benchbot", "")


def test_no_subscription_is_listed_twice() -> None:
    assert Counter((item.software, item.topic) for item in SUBSCRIPTIONS).most_common(1)[0][1] == 1


def test_the_documentation_shows_this_table() -> None:
    assert table() in Path("docs/ros2.md").read_text()
