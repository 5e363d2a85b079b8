"""What a second thread brings: the same work on one thread and on two, ours and Open3D's, in turn.

Our runtime fixes its threads when it starts, so each number of threads has a process of its own.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from benchbot_sim_taichi.renderer import Renderer
from benchmarks.rays.against_peers import NIGHT
from benchmarks.rays.measure import timed
from benchmarks.rays.peers import open3d, ours
from benchmarks.rays.scene import generate
from benchmarks.rays.workload import prepare

MEASURES = ("primary", "shadow", "bounce", "frame")
THREADS = (1, 2)


@dataclass(frozen=True)
class Scaling:
    """Wall seconds on one thread over wall seconds on two, and processor seconds on two over those on one."""

    measure: str
    program: str
    speed_up: float
    processor_growth: float


def compare(triangles: int, width: int, height: int, rounds: int) -> list[Scaling]:
    """Scaling of each measure; only as good as the machine is quiet."""
    with tempfile.TemporaryDirectory() as cache:
        children = [_start(count, [str(triangles), str(width), str(height), cache]) for count in THREADS]
        try:
            _, names = (json.loads(_line(child)) for child in children)
            times = [[_ask(child, column) for column in range(len(names)) for child in children] for _ in range(rounds)]
        finally:
            for child in children:
                child.communicate()
    scalings = []
    for column, (measure, program) in enumerate(names):
        one, two = ([times[n][2 * column + k] for n in range(rounds)] for k in range(2))
        speed_up = statistics.median(a[0] / b[0] for a, b in zip(one, two, strict=True))
        growth = statistics.median(b[1] / a[1] for a, b in zip(one, two, strict=True))
        scalings.append(Scaling(measure, program, speed_up, growth))
    return scalings


def table(scalings: Sequence[Scaling]) -> Iterator[str]:
    """Lines of text."""
    yield f"\n{'two threads over one':34} {'speed':>8} {'CPU-s':>10}"
    for row in scalings:
        yield f"{row.measure + ', ' + row.program:34} {row.speed_up:8.2f} {row.processor_growth:10.2f}"


def _start(threads: int, arguments: list[str]) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "benchmarks.rays.threads", str(threads), *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "TI_CPU_MAX_NUM_THREADS": str(threads)},
    )


def _line(child: "subprocess.Popen[str]") -> str:
    assert child.stdout is not None
    line = child.stdout.readline()
    if not line:
        raise RuntimeError("A process that was to be measured died; its message is above.")
    return line


def _ask(child: "subprocess.Popen[str]", column: int) -> tuple[float, float]:
    assert child.stdin is not None
    child.stdin.write(f"{column}\n")
    child.stdin.flush()
    wall_s, processor_s = json.loads(_line(child))
    return wall_s, processor_s


def _serve(threads: int, triangles: int, width: int, height: int, cache: Path) -> None:
    scene = generate(triangles)
    renderer = Renderer(scene, NIGHT, cache_dir=cache)
    work = prepare(scene, renderer, width, height)
    jobs = [job for job in ours.jobs(work, renderer) if job.measure in MEASURES]
    if find_spec(open3d.MODULE):
        jobs += open3d.jobs(work, threads)
    for job in jobs:
        job.run()
    print(json.dumps([(job.measure, job.peer) for job in jobs]), flush=True)
    for line in sys.stdin:
        _, wall_s, processor_s = timed(jobs[int(line)])
        print(json.dumps([wall_s, processor_s]), flush=True)


if __name__ == "__main__":
    number, size, wide, high = (int(value) for value in sys.argv[1:5])
    _serve(number, size, wide, high, Path(sys.argv[5]))
