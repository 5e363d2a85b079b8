"""One solution over a simulated robot, one behind ROS 2, recordings of both, and a bag of ROS 2: scores and seconds.

The solution is the example `segmentation_mapper`, the same bytes each time, in miniroom:1.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from benchbot_record_mcap.bag import TYPES

TASK = "semantic_slam:passive:ground_truth:segmentation"
PLACE = ("--task", TASK, "--env", "miniroom:1")
BENCHBOT = (sys.executable, "-m", "benchbot")
SIMULATED, REAL = "carter_lowres", "carter_ros2"


def main() -> None:
    """Print a row for each robot."""
    with tempfile.TemporaryDirectory() as folder:
        runs = Path(folder)
        measure = Measure(runs)
        measure("simulated", "submit", *PLACE, "--robot", SIMULATED, "--record", "mcap")
        with bridge():
            measure("behind ROS 2", "submit", *PLACE, "--robot", REAL, "--record", "mcap")
        for name in ("simulated", "behind ROS 2"):
            recording = runs / f"{name}-recordings" / "mcap"
            measure(f"replay of {name}", "replay", str(recording))
            size = sum(file.stat().st_size for file in recording.glob("*.mcap")) / 2**20
            print(f"  the recording: {size:.1f} MiB", flush=True)
        bag = as_bag(runs / "behind ROS 2-recordings" / "mcap", runs / "bag")
        measure("replay of a bag", "replay", str(bag), "--robot", REAL, *PLACE)


class Measure:
    """Submits the solution, and prints what it scored and how long that took."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __call__(self, name: str, *words: str) -> None:
        result, scores = self._folder / f"{name}.json", self._folder / f"{name}.scores"
        ways = ["--example", "segmentation_mapper", "-r", str(result), "-e", "omq", "-o", str(scores)]
        began_s = time.monotonic()
        command = [*BENCHBOT, *words, *ways, "--display", "none"]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        took_s = time.monotonic() - began_s
        if done.returncode != 0:
            raise RuntimeError(done.stderr[-2000:])
        provenance: dict[str, Any] = json.loads(result.read_text())["provenance"]
        omq = json.loads(scores.read_text())["scores"]["OMQ"]
        seen = provenance["observation_digest"][:8]
        print(f"{name:24} OMQ {omq:.4f}  {provenance['steps']} steps  seen {seen}  {took_s:5.1f} s", flush=True)


@contextmanager
def bridge() -> Iterator[None]:
    """Run the simulated robot as one of ROS 2, on a domain of its own."""
    os.environ |= {"ROS_DOMAIN_ID": str(os.getpid() % 100), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    words = ["bridge", "ros2", "--robot", SIMULATED, "--env", "miniroom:1"]
    process = subprocess.Popen([*BENCHBOT, *words], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    if not any("is a ROS 2 robot now" in line for line in process.stderr):
        raise RuntimeError("the bridge did not start")
    try:
        yield
    finally:
        process.terminate()
        process.wait(30)


def as_bag(recording: Path, target: Path) -> Path:
    """Write what the robot has published of a recording as a bag of ROS 2."""
    with Reader(recording) as reader, Writer(target, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections: dict[str, Any] = {}
        for connection, time_ns, data in reader.messages():
            topic = connection.topic
            if topic.startswith("/benchbot"):
                continue
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, connection.msgtype, typestore=TYPES)
            writer.write(connections[topic], time_ns, data)
    return target


if __name__ == "__main__":
    main()
