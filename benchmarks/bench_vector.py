"""Environments for learning: stepped as arrays, beside one after the other in the same run.

python -m benchmarks vector [--device cuda] [--tensors torch] [--async] [--env PointGoal] [--envs 1 64] [--sizes 64]
    [--places miniroom:1 house:1] [--within-s 60] [--json FILE]

Rates are medians of interleaved rounds, in environment steps per second of wall time: each is a random move, ahead by
0.25 m or a turn by 15 degrees, and what the task observes: pictures with depth (and ids in SemanticSlam), laser and
poses. What has ended begins anew. What the processors of this machine had to do for a step does not depend on what else
they do, so that `ratio` is that of processor time. `sync` is gymnasium.vector.SyncVectorEnv, whose environments load a
scene each and take one turn after the other, so that two of them tell the rate of any number. Kernels are compiled, or
come from the cache of earlier runs, before anything is measured. `--tensors torch` leaves observations as tensors where
they are made, and first compares those of some steps with arrays. On a graphics processor, what its kernel moves is
compared with what arrays of numpy move. `--async` adds gymnasium.vector.AsyncVectorEnv with a
process for each of four environments; its processor time is in those, and not told. `MB` is what the memory of the
device, or of this process, grew by. With `--within-s`, and on a graphics processor within a minute, rows that would
take longer are left out, the largest first.
"""

import argparse
import importlib.util
import json
import math
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import psutil

from benchbot.plugins.gymnasium import MOVES
from benchbot.simulation import KinematicRobots
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.robots_on_device import TracedRobots

SIZES = (64, 128)
ENVIRONMENTS = (1, 4, 16, 64)
TASKS = ("PointGoal", "SemanticSlam", "Exploration")
SYNC_ENVIRONMENTS = 2
ASYNC_ENVIRONMENTS = 4
ARGUMENTS: dict[str, Any] = {"moves": MOVES, "reward": "collision"}

VectorEnv = gymnasium.vector.VectorEnv[Any, Any, Any]


@dataclass(frozen=True)
class Row:
    """Environment steps per second, milliseconds of processor time for each, and how many times less they are."""

    size: int
    environments: int
    sync: float
    asynchronous: float
    batched: float
    sync_cpu_ms: float
    batched_cpu_ms: float
    ratio: float
    megabytes: float


@dataclass
class Measured:
    """A way to step environments, and its steps so far."""

    envs: VectorEnv
    rates: list[float] = field(default_factory=list)
    cpu_ms: list[float] = field(default_factory=list)

    def step(self) -> None:
        actions = self.envs.action_space.sample()
        started_s, started_cpu_s = time.perf_counter(), time.process_time()
        observations, *_ = self.envs.step(actions)
        # Nothing is done before its result is there.
        float(next(iter(observations.values())).reshape(-1)[0])
        self.rates.append(self.envs.num_envs / (time.perf_counter() - started_s))
        self.cpu_ms.append((time.process_time() - started_cpu_s) / self.envs.num_envs * 1e3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--env", choices=TASKS, default=TASKS[0], help="which environment, of the -v0")
    parser.add_argument("--places", nargs="+", default=["miniroom:1"], metavar="NAME:N", help="drawn at every reset")
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="PIXELS", help="width and height")
    parser.add_argument("--envs", type=int, nargs="+", default=ENVIRONMENTS, metavar="N")
    parser.add_argument("--tensors", choices=["torch"], help="leave observations on the device")
    parser.add_argument("--async", action="store_true", dest="asynchronous", help="measure AsyncVectorEnv too")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--within-s", type=float, metavar="SECONDS", help="leave out what does not fit (cuda: 60)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    ends_s = time.monotonic() + (options.within_s or (60.0 if options.device == "cuda" else math.inf))
    name = f"benchbot/{options.env}-v0"
    ARGUMENTS["env"] = options.places
    print(f"{name}, carter_lowres in {', '.join(options.places)}, {options.device}, {options.tensors or 'numpy'}")
    if options.device == "cuda":
        compare_motion(name, options.device)
    if options.tensors:
        compare(name, options.sizes[0], options.device, options.tensors)
    print(
        f"{'size':>5} {'envs':>5} {'sync/s':>9} {'async/s':>9} {'arrays/s':>9}"
        f" {'sync ms':>8} {'CPU ms':>7} {'ratio':>6} {'MB':>6}"
    )
    rows = []
    for size in options.sizes:
        sync = made(name, "sync", SYNC_ENVIRONMENTS, size, options.device)
        beside = made(name, "async", ASYNC_ENVIRONMENTS, size, options.device) if options.asynchronous else None
        longest_s = 0.0
        for environments in sorted(options.envs):
            started_s = time.monotonic()
            if started_s + 2 * longest_s > ends_s:
                print(f"{size:5} {environments:5} left out")
                continue
            before = memory_mb(options.device)
            together = made(name, "vector_entry_point", environments, size, options.device, options.tensors)
            row = measure(size, sync, beside, together, options.rounds, lambda: memory_mb(options.device) - before)  # noqa: B023 - not kept
            together.close()
            longest_s = time.monotonic() - started_s
            rows.append(row)
            print(
                f"{row.size:5} {row.environments:5} {row.sync:9.1f} {row.asynchronous:9.1f} {row.batched:9.1f}"
                f" {row.sync_cpu_ms:8.2f} {row.batched_cpu_ms:7.3f} {row.ratio:6.2f} {row.megabytes:6.0f}",
                flush=True,
            )
        if beside is not None:
            beside.close()
        sync.close()
    if options.json:
        document = {"device": options.device, "rows": [asdict(row) for row in rows]}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def made(name: str, mode: str, count: int, size: int, device: str, tensors: str | None = None) -> VectorEnv:
    """Return environments that have taken their first steps: what is compiled has been."""
    choices: dict[str, Any] = {**ARGUMENTS, "image_size": (size, size), "platform_options": {"device": device}}
    if tensors is not None:
        choices["tensors"] = tensors
    if mode == "async":
        choices["vector_kwargs"] = {"context": "spawn"}
    envs: VectorEnv = gymnasium.make_vec(name, count, mode, **choices)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(2):
        envs.step(envs.action_space.sample())
    return envs


def compare(name: str, size: int, device: str, tensors: str) -> None:
    """Print how far observations as tensors are from those as arrays: by nothing on processors."""
    envs = [made(name, "vector_entry_point", 4, size, device, given) for given in (tensors, None)]
    off: dict[str, float] = {}
    for _ in range(5):
        actions = envs[0].action_space.sample()
        there, here = (each.step(actions)[0] for each in envs)
        for channel, rows in here.items():
            away = np.abs(there[channel].cpu().numpy().astype(np.float64) - rows)
            off[channel] = max(off.get(channel, 0.0), float(away.max()))
    for each in envs:
        each.close()
    print(
        "tensors beside arrays, largest differences: " + ", ".join(f"{key} {value:.2g}" for key, value in off.items())
    )


def compare_motion(name: str, device: str, count: int = 64, steps: int = 40) -> None:
    """Print how far robots that a kernel of the device moved are from those that arrays of numpy moved."""
    envs: list[Any] = [made(name, "vector_entry_point", count, 8, device) for _ in range(2)]
    ways = (TracedRobots.execute, KinematicRobots.execute)
    everyone, random, ended, away_m = np.arange(count), np.random.default_rng(0), 0, 0.0
    for _ in range(steps):
        moves = [MOVES[number] for number in random.integers(len(MOVES), size=count)]
        straight = np.array([move.action == "move_distance" for move in moves])
        arguments = np.array([move.argument for move in moves])
        pairs = list(zip(ways, (each.unwrapped.robots for each in envs), strict=True))
        outcomes = [way(robots, everyone, straight, arguments) for way, robots in pairs]
        there, here = (robots.poses_xyyaw(everyone) for _, robots in pairs)
        ended += int((outcomes[0] != outcomes[1]).sum())
        away_m = max(away_m, float(np.abs(there - here).max()))
    for each in envs:
        each.close()
    print(f"{count} robots, {steps} moves: {away_m:.2g} m or rad from those of numpy, {ended} ended otherwise")


def memory_mb(device: str) -> float:
    """Return how much of the device's memory is in use, as torch says, or of the host's by this process."""
    if device == "cuda":
        if importlib.util.find_spec("torch") is None:
            return math.nan
        import torch

        free, total = torch.cuda.mem_get_info()
        return float((total - free) / 2**20)
    return float(psutil.Process().memory_info().rss / 2**20)


def measure(
    size: int,
    sync: VectorEnv,
    beside: VectorEnv | None,
    together: VectorEnv,
    rounds: int,
    grown_mb: Callable[[], float],
) -> Row:
    """Return a row of the table, of rounds that take turns."""
    one_by_one, quick = Measured(sync), Measured(together)
    apart = None if beside is None else Measured(beside)
    for _ in range(rounds):
        one_by_one.step()
        if apart is not None:
            apart.step()
        quick.step()
    slow_rate, quick_rate = statistics.median(one_by_one.rates), statistics.median(quick.rates)
    apart_rate = math.nan if apart is None else statistics.median(apart.rates)
    slow_ms, quick_ms = statistics.median(one_by_one.cpu_ms), statistics.median(quick.cpu_ms)
    rates = (slow_rate, apart_rate, quick_rate)
    return Row(size, together.num_envs, *rates, slow_ms, quick_ms, slow_ms / quick_ms, grown_mb())


if __name__ == "__main__":
    main()
