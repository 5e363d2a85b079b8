"""What it costs to be watched: a run alone and the same run watched at 10 Hz, in turns, until both have had the same.

Two runs: ray-traced pictures of `miniroom:1` by `carter_lowres`, and a simulator that does nothing and shows 640x480
pictures, so that all there is to slow down is BenchBot itself. The watcher is a process of its own that keeps up with
colour, depth and segmentation, 320 pixels wide; it is stopped (SIGSTOP) while the run is alone.

A ratio of 1.00 is a run that does not notice; 1.03 is asked for. On a machine that is busy, look at the ratio of the
processor time a step takes, and not at that of the wall time. The last columns are the processor time of the watcher,
and what it adds to that of the supervisor, in seconds a minute.
"""

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from benchbot.api.client import Client
from benchbot.core.request import RunRequest
from benchbot.supervisor.backend import Backend
from benchbot.supervisor.observation_tap import ATTENTION_S
from benchbot.wire.run_state import Connection, RunState
from benchmarks import bench_step
from tests.supervisor.harness import children_of

WIDTH = 320
CHANNELS = ("image_rgb", "image_depth", "image_segment")
TASK, ROBOT, ENVIRONMENT = "semantic_slam:active:ground_truth:segmentation", "carter_lowres", "miniroom:1"
Step = tuple[str, dict[str, float]]


@dataclass(frozen=True)
class Block:
    """Some seconds of a run: steps, wall time, and the processor time of the run, its supervisor and the watcher."""

    steps: int
    wall_s: float
    run_cpu_s: float
    supervisor_cpu_s: float
    watcher_cpu_s: float


@dataclass(frozen=True)
class Row:
    """What came of one run."""

    run: str
    steps_per_s: float
    wall_ratio: float
    cpu_ratio: float
    watcher_cpu_s_per_min: float
    supervisor_cpu_s_per_min: float


def watch(state: RunState) -> None:
    """Keep up with a run until this process is ended."""
    from benchbot.plugins.watching.run_feed import RunFeed

    RunFeed(state, channels=CHANNELS, width=WIDTH)
    print("watching", flush=True)
    signal.pause()


def measure(name: str, state: RunState, step: Step, rounds: int, block_s: float) -> Row:
    """Let a solution drive, alone and watched in turns."""
    client = Client(state.connection)
    client.reset()
    client.step(*step)
    blocks: dict[bool, list[Block]] = {False: [], True: []}
    with watcher(state) as watching:
        for number in range(2 * rounds):
            # ABBA: what drifts with time falls on both alike.
            watched = number % 4 in (1, 2)
            os.kill(watching, signal.SIGCONT if watched else signal.SIGSTOP)
            time.sleep(ATTENTION_S + 0.2)
            blocks[watched].append(drive(client, step, state.pid, watching, block_s))
        os.kill(watching, signal.SIGCONT)
    alone, seen = (per_step(blocks[watched]) for watched in (False, True))
    watched_s = sum(block.wall_s for block in blocks[True])
    alone_supervisor, seen_supervisor = (
        sum(block.supervisor_cpu_s for block in blocks[watched]) / sum(block.steps for block in blocks[watched])
        for watched in (False, True)
    )
    steps_per_s = sum(block.steps for block in blocks[True]) / watched_s
    return Row(
        name,
        steps_per_s,
        seen[0] / alone[0],
        seen[1] / alone[1],
        60 * sum(block.watcher_cpu_s for block in blocks[True]) / watched_s,
        60 * (seen_supervisor - alone_supervisor) * steps_per_s,
    )


def per_step(blocks: list[Block]) -> tuple[float, float]:
    """Return the median of the seconds that a step takes: of wall time, and of the run's processor time."""
    return (
        statistics.median(block.wall_s / block.steps for block in blocks),
        statistics.median(block.run_cpu_s / block.steps for block in blocks),
    )


def drive(client: Client, step: Step, supervisor: int, watching: int, block_s: float) -> Block:
    """Take steps for some seconds."""
    run = [supervisor, *children_of(supervisor)]
    before, began_s = [cpu_s(run), cpu_s([supervisor]), cpu_s([watching])], time.perf_counter()
    steps = 0
    while time.perf_counter() - began_s < block_s or not steps:
        client.step(*step)
        steps += 1
    wall_s = time.perf_counter() - began_s
    spent = [cpu_s(run), cpu_s([supervisor]), cpu_s([watching])]
    return Block(steps, wall_s, *(now - then for now, then in zip(spent, before, strict=True)))


def cpu_s(pids: list[int]) -> float:
    """Return the processor time of processes so far: proc_pid_stat(5), fields 14 and 15."""
    ticks = 0
    for pid in pids:
        fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


@contextmanager
def watcher(state: RunState) -> Iterator[int]:
    """Yield the number of a process that watches."""
    words = [sys.executable, "-m", "benchmarks.bench_watching", "--watch", json.dumps(state.as_dict())]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            yield process.pid
        finally:
            process.kill()


@contextmanager
def still(folder: Path) -> Iterator[RunState]:
    """Yield a run on the simulator that does nothing."""
    bench_step.install(folder)
    words = [sys.executable, "-m", "benchmarks.bench_step", "--serve", str(folder)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            document = json.loads(process.stdout.readline())["state"]
            yield RunState(**{**document, "connection": Connection(**document["connection"])})
        finally:
            process.terminate()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--block", type=float, default=4.0, metavar="SECONDS")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--watch", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.watch:
        watch(RunState.from_dict(json.loads(options.watch)))
        return
    rows = []
    turn: Step = ("move_angle", {"angle": 15.0})
    with Backend.start(RunRequest(TASK, ROBOT, ENVIRONMENT)) as backend:
        rows.append(measure("miniroom:1, ray-traced", backend.state, turn, options.rounds, options.block))
    with tempfile.TemporaryDirectory() as folder, still(Path(folder)) as state:
        straight: Step = ("move_distance", {"distance": 0.0})
        rows.append(measure("nothing simulated", state, straight, options.rounds, options.block))
    print(f"{'':<24}{'steps/s':>9}{'wall':>7}{'CPU':>7}{'watcher':>11}{'supervisor':>12}")
    for row in rows:
        ratios = f"{row.steps_per_s:>9.1f}{row.wall_ratio:>7.3f}{row.cpu_ratio:>7.3f}"
        print(f"{row.run:<24}{ratios}{row.watcher_cpu_s_per_min:>7.2f} s/m{row.supervisor_cpu_s_per_min:>8.2f} s/m")
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1), "utf-8")


if __name__ == "__main__":
    main()
