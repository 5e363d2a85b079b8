"""What holding a solution costs: native beside sandboxed, its start and each of its steps, in turn in one run.

The simulator takes no time (that of the benchmark `step`), and a step carries a colour, depth and segmentation image of
640x480. The start is from asking for it to the first line of the solution, an empty Python. The processor time of a
start is that of this process and all that came of it; that of a step is the solution's own. A native solution has the
images from shared memory; one that is held has their bytes over the unix socket. With `--container` there is one as
well, of the tests' base image; what its engine computes is not counted.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchbot.api.client import Client
from benchbot.plugins.containers import context, engine
from benchbot.plugins.containers import image as images
from benchbot.plugins.containers.mode import Containerised
from benchbot.plugins.sandbox.mode import Sandbox
from benchbot.submission.init.process import adopt
from benchbot.submission.modes import NATIVE, Mode, SolutionSpec
from benchbot.wire.run_state import Connection
from benchmarks.bench_step import install, payload_bytes
from tests.plugins.containers import base_image
from tests.plugins.containers.solutions import DOCKERFILE

SOLUTION = """\
import os, sys, time
print(time.monotonic(), flush=True)
steps = int(sys.argv[1] if len(sys.argv) > 1 else os.environ["args"])
if steps:
    from benchbot.api.client import Client
    client = Client()
    client.reset()
    for _ in range(5):
        client.step(None)
    for _ in range(steps):
        wall_s, cpu_s = time.perf_counter(), time.process_time()
        client.step(None)
        print(time.perf_counter() - wall_s, time.process_time() - cpu_s)
"""


@dataclass(frozen=True)
class Cost:
    """Seconds, of wall time and of processors."""

    wall_s: float
    cpu_s: float


def spent_s() -> float:
    """Return the processor time of this process and of those that came of it and have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def children() -> set[str]:
    """Return the numbers of this process's children."""
    return set(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())


def reap(but: set[str]) -> None:
    """Wait for what the sandbox leaves to its adopter, this process; its back end goes on."""
    while children() - but:
        os.waitpid(-1, os.WNOHANG)
        time.sleep(0.001)


def run(mode: Mode, connection: Connection, folder: Path, steps: int) -> tuple[Cost, list[Cost]]:
    """Run the solution once; return what its start took, and each step."""
    output = bytearray()
    program = [mode.image] if isinstance(mode, Containerised) else [sys.executable, "solution.py"]
    spec = SolutionSpec([*program, str(steps)], folder, mode=mode)
    before = children()
    with tempfile.TemporaryDirectory(prefix="bb-") as exchange:
        cpu_before_s, asked_s = spent_s(), time.monotonic()
        with mode.start(spec, connection, Path(exchange), output.extend) as solution:
            while (status := solution.wait(10)) is None:
                pass
            explained = solution.explain(status)
        reap(before)
        cpu_s = spent_s() - cpu_before_s
    if status != 0:
        raise SystemExit(f"The solution in {mode.name} ended with {status}: {explained}\n{output.decode()}")
    first, *lines = output.decode().splitlines()
    return Cost(float(first) - asked_s, cpu_s), [Cost(*map(float, line.split())) for line in lines]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--steps", type=int, default=100, help="in each round")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the numbers there")
    parser.add_argument("--container", action="store_true", help="measure a container, too; needs podman or docker")
    options = parser.parse_args()
    modes: dict[str, Callable[[], Mode]] = {"native": lambda: NATIVE, "sandbox": Sandbox}
    adopt()
    with tempfile.TemporaryDirectory(prefix="bb-") as name, ExitStack() as stack:
        folder = Path(name)
        install(folder)
        solution = folder / "solution"
        solution.mkdir()
        (solution / "solution.py").write_text(SOLUTION)
        if options.container:
            container = stack.enter_context(contained(folder))
            modes["container"] = lambda: container
        starts: dict[str, list[Cost]] = {name: [] for name in modes}
        steps: dict[str, list[Cost]] = {name: [] for name in modes}
        command = [sys.executable, "-m", "benchmarks.bench_step", "--serve", str(folder)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            connection = Connection(**json.loads(process.stdout.readline())["state"]["connection"])
            try:
                for number in range(options.rounds + 1):
                    for way, make in modes.items():
                        start, _ = run(make(), connection, solution, 0)
                        _, taken = run(make(), connection, solution, options.steps)
                        if number > 0:
                            starts[way].append(start)
                            steps[way] += taken
            finally:
                Client(connection).stop()
    rows = [
        {"what": f"{what}, {way}", "wall_ms": median_ms(costs, "wall_s"), "cpu_ms": median_ms(costs, "cpu_s")}
        for what, measured in (("start", starts), ("step", steps))
        for way, costs in measured.items()
    ]
    print(f"{len(os.sched_getaffinity(0))} processors, steps of {payload_bytes() / 1e6:.1f} MB; medians")
    print(f"{'':<20}{'wall ms':>10}{'CPU ms':>10}")
    for row in rows:
        print(f"{row['what']:<20}{row['wall_ms']:>10.2f}{row['cpu_ms']:>10.2f}")
    if options.json:
        options.json.write_text(json.dumps({"rows": rows}, indent=1))


@contextmanager
def contained(folder: Path) -> Iterator[Containerised]:
    """Yield the mode, with an image of the solution on top of the tests' base image."""
    with engine.reached() as reached:
        base_image.build(reached.url, folder / "base")
        (folder / "solution" / "Dockerfile").write_text(DOCKERFILE)
        image = images.built(reached, context.find(folder / "solution"), print)
        yield Containerised(reached, image)


def median_ms(costs: list[Cost], which: str) -> float:
    seconds: list[float] = [getattr(cost, which) for cost in costs]
    return statistics.median(seconds) * 1e3


if __name__ == "__main__":
    main()
