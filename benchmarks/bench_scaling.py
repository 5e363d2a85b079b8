"""How a batch scales with its workers: episodes an hour, and processor seconds, for 1, 2, 4, … workers of one thread.

Each row is a `benchbot batch` of the same episodes, on kernels, tree and light that are there before. `overall` counts
everything from the command to its end; `steady` the time in which all workers work, each with its first episode behind
it. Efficiency is the speed of a worker, as a part of that of the first row's. A row that its share of `--within-s` does
not suffice for is ended, and counts what is finished.

python -m benchmarks.bench_scaling [--episodes 64] [--workers 1,2,4,8,16] [--device cuda] [--json FILE]
"""

import argparse
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from typing import Any

COMMAND = [sys.executable, "-m", "benchbot", "batch"]
TASK = "semantic_slam:passive:ground_truth"
ENDING_S = 20.0
"""The time that a row may need to end."""


@dataclass(frozen=True)
class Row:
    """A batch of one number of workers; `steady` is episodes a second, None where no time was steady."""

    workers: int
    finished: int
    wall_s: float
    processor_s: float
    steady: float | None

    @property
    def overall(self) -> float:
        """Episodes a second, with starting and ending."""
        return self.finished / self.wall_s


def measure(folder: Path, words: list[str], workers: int, threads: int, longest_s: float) -> Row:
    """Compute a batch with so many workers, for no longer than `longest_s`."""
    target = folder / f"{workers}-workers"
    command = [*COMMAND, *words, "--jobs", str(workers), "--cpus", str(threads), "--output-location", str(target)]
    before, start_s = getrusage(RUSAGE_CHILDREN), time.monotonic()
    with (folder / "said.txt").open("wb") as said:
        process = subprocess.Popen(command, cwd=folder, stdout=said, stderr=said)
        with suppress(subprocess.TimeoutExpired):
            process.wait(longest_s)
        wall_s, finished = time.monotonic() - start_s, len(list(target.glob("episodes/*/result.json")))
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.wait()
        elif process.returncode != 0:
            raise SystemExit((folder / "said.txt").read_text("utf-8"))
    if not finished:
        raise SystemExit(f"{workers} workers finished no episode in {longest_s:.0f} s: give it more with --within-s.")
    after = getrusage(RUSAGE_CHILDREN)
    processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    steady = steady_rate(target / "events", workers)
    shutil.rmtree(target)
    return Row(workers, finished, wall_s, processor_s, steady)


def steady_rate(events: Path, workers: int) -> float | None:
    """Return the episodes a second while all workers work: the sum of what each does in that time.

    It lasts from when the last of them has finished its first episode to when the first of them has finished its last;
    an episode counts by the part of it that lies within.
    """
    ends = []
    for path in events.glob("*.jsonl"):
        entries = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
        ends.append(sorted(entry["time_s"] for entry in entries if entry["what"] == "finished"))
    ends = [each for each in ends if each]
    begin_s, end_s = max((each[0] for each in ends), default=0.0), min((each[-1] for each in ends), default=0.0)
    if len(ends) < workers or end_s <= begin_s:
        return None
    done = 0.0
    for each in ends:
        for began_s, ended_s in pairwise(each):
            done += max(0.0, min(ended_s, end_s) - max(began_s, begin_s)) / (ended_s - began_s)
    return done / (end_s - begin_s)


def show(rows: list[Row]) -> None:
    """Print the table."""
    print(f"\n{'workers':>8}{'episodes':>10}{'wall s':>9}{'cpu s':>9}{'cpu s each':>12}{'steady':>9}{'overall':>9}")
    first = rows[0]
    for row in rows:
        scale = row.workers / first.workers
        steady = row.steady / first.steady / scale if row.steady and first.steady else None
        print(
            f"{row.workers:8}{row.finished:10}{row.wall_s:9.1f}{row.processor_s:9.1f}"
            f"{row.processor_s / row.finished:12.2f}{'–' if steady is None else f'{steady:.2f}':>9}"
            f"{row.overall / first.overall / scale:9.2f}"
        )
    for row in rows[1:]:
        times = f"{row.overall / first.overall:.1f} times as many episodes an hour as {first.workers}"
        print(f"{row.workers} workers: {times}, each at {_dearer(row, first):.2f} times the processor time")


def _dearer(row: Row, first: Row) -> float:
    return (row.processor_s / row.finished) / (first.processor_s / first.finished)


def described() -> str:
    """Describe this machine: its processors, as this process may use them, and its load."""
    names = [line.split(":", 1)[1].strip() for line in _lines("/proc/cpuinfo") if line.startswith("model name")]
    siblings = {path.read_text("utf-8") for path in Path("/sys/devices/system/cpu").glob("cpu*/topology/thread_sib*")}
    cores = f"{len(os.sched_getaffinity(0))} of {os.cpu_count()} processors, {len(siblings)} cores"
    return f"{names[0] if names else platform.processor()}, {cores}; the load is {os.getloadavg()[0]:.1f}"


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text("utf-8").splitlines()
    except OSError:
        return []


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=64, metavar="N")
    parser.add_argument("--workers", default="1,2,4,8,16", metavar="W,W", help="the first is what others are held to")
    parser.add_argument("--threads", type=int, default=1, metavar="N", help="of each worker")
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="cpu")
    parser.add_argument("--env", default="miniroom:1", metavar="NAME:VARIANT")
    parser.add_argument("--robot", default="carter_lowres", metavar="NAME")
    parser.add_argument("--within-s", type=float, default=450.0, metavar="SECONDS", help="for all rows together")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the numbers to this file")
    options = parser.parse_args()
    ends_s = time.monotonic() + options.within_s
    words = ["--task", TASK, "--robots", options.robot, "--envs", options.env, "--example", "hello_passive"]
    words += ["--device", options.device, "--no-canary", "--display", "none"]
    print(f"{described()}\n{options.episodes} episodes of {options.robot} in {options.env}, {options.device}")
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="bb-") as name:
        os.environ["BENCHBOT_STATE_DIR"] = f"{name}/state"
        measure(Path(name), [*words, "--seeds", str(options.episodes)], 1, len(os.sched_getaffinity(0)), 600.0)
        counts = [int(text) for text in options.workers.split(",")]
        for place, workers in enumerate(counts):
            left_s = ends_s - time.monotonic() - ENDING_S * (len(counts) - place)
            share_s = left_s if place + 1 == len(counts) else left_s / 2
            every = ["--seeds", f"0..{options.episodes - 1}"]
            rows.append(measure(Path(name), [*words, *every], workers, options.threads, max(share_s, 1.0)))
            print(f"{workers} workers: {rows[-1].finished} episodes in {rows[-1].wall_s:.1f} s", flush=True)
    show(rows)
    if options.json:
        document: dict[str, Any] = {"machine": described(), "rows": [asdict(row) for row in rows]}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
