"""Environments for learning: stepped as arrays, beside one after the other in the same run.

python -m benchmarks vector [--device cuda] [--env PointGoal] [--envs 1 64] [--sizes 64] [--within-s 60] [--json FILE]

Rates are medians of interleaved rounds, in environment steps per second of wall time: each is a random move, ahead by
0.25 m or a turn by 15 degrees, and what the task observes: pictures with depth (and ids in SemanticSlam), laser and
poses. What has ended begins anew. What the processors of this machine had to do for a step does not depend on what else
they do, so that `ratio` is that of processor time. `sync` is gymnasium.vector.SyncVectorEnv, whose environments load a
scene each and take one turn after the other, so that two of them tell the rate of any number. Kernels are compiled, or
come from the cache of earlier runs, before anything is measured. With `--within-s`, and on a graphics processor within
a minute, rows that would take longer are left out, the largest first.
"""

import argparse
import json
import math
import statistics
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import gymnasium

from benchbot.plugins.gymnasium import MOVES
from benchbot_sim_taichi import _ti

SIZES = (64, 128)
ENVIRONMENTS = (1, 4, 16, 64)
TASKS = ("PointGoal", "SemanticSlam", "Exploration")
SYNC_ENVIRONMENTS = 2
ARGUMENTS: dict[str, Any] = {"moves": MOVES, "reward": "collision"}

VectorEnv = gymnasium.vector.VectorEnv[Any, Any, Any]


@dataclass(frozen=True)
class Row:
    """Environment steps per second, milliseconds of processor time for each, and how many times less they are."""

    size: int
    environments: int
    sync: float
    batched: float
    sync_cpu_ms: float
    batched_cpu_ms: float
    ratio: float


@dataclass
class Measured:
    """A way to step environments, and its steps so far."""

    envs: VectorEnv
    rates: list[float] = field(default_factory=list)
    cpu_ms: list[float] = field(default_factory=list)

    def step(self) -> None:
        actions = self.envs.action_space.sample()
        started_s, started_cpu_s = time.perf_counter(), time.process_time()
        self.envs.step(actions)
        self.rates.append(self.envs.num_envs / (time.perf_counter() - started_s))
        self.cpu_ms.append((time.process_time() - started_cpu_s) / self.envs.num_envs * 1e3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--env", choices=TASKS, default=TASKS[0], help="which environment, of the -v0")
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="PIXELS", help="width and height")
    parser.add_argument("--envs", type=int, nargs="+", default=ENVIRONMENTS, metavar="N")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--within-s", type=float, metavar="SECONDS", help="leave out what does not fit (cuda: 60)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    ends_s = time.monotonic() + (options.within_s or (60.0 if options.device == "cuda" else math.inf))
    name = f"benchbot/{options.env}-v0"
    print(f"{name}, carter_lowres in miniroom:1, {options.device}")
    print(f"{'size':>5} {'envs':>5} {'sync/s':>9} {'arrays/s':>9} {'sync ms':>8} {'CPU ms':>7} {'ratio':>6}")
    rows = []
    for size in options.sizes:
        sync = made(name, "sync", SYNC_ENVIRONMENTS, size, options.device)
        longest_s = 0.0
        for environments in sorted(options.envs):
            started_s = time.monotonic()
            if started_s + 2 * longest_s > ends_s:
                print(f"{size:5} {environments:5} left out")
                continue
            row = measure(name, size, sync, environments, options.rounds, options.device)
            longest_s = time.monotonic() - started_s
            rows.append(row)
            print(
                f"{row.size:5} {row.environments:5} {row.sync:9.1f} {row.batched:9.1f} {row.sync_cpu_ms:8.2f}"
                f" {row.batched_cpu_ms:7.3f} {row.ratio:6.2f}",
                flush=True,
            )
        sync.close()
    if options.json:
        document = {"device": options.device, "rows": [asdict(row) for row in rows]}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def made(name: str, mode: str, count: int, size: int, device: str) -> VectorEnv:
    """Return environments that have taken their first step: what is compiled has been."""
    choices: dict[str, Any] = {**ARGUMENTS, "image_size": (size, size), "platform_options": {"device": device}}
    envs: VectorEnv = gymnasium.make_vec(name, count, mode, **choices)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    envs.step(envs.action_space.sample())
    return envs


def measure(name: str, size: int, sync: VectorEnv, environments: int, rounds: int, device: str) -> Row:
    one_by_one = Measured(sync)
    together = Measured(made(name, "vector_entry_point", environments, size, device))
    for _ in range(rounds):
        one_by_one.step()
        together.step()
    together.envs.close()
    slow, quick = statistics.median(one_by_one.rates), statistics.median(together.rates)
    slow_ms, quick_ms = statistics.median(one_by_one.cpu_ms), statistics.median(together.cpu_ms)
    return Row(size, environments, slow, quick, slow_ms, quick_ms, slow_ms / quick_ms)


if __name__ == "__main__":
    main()
