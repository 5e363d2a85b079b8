"""Environments for learning: stepped together, beside one after the other in the same run.

python -m benchmarks.bench_vector [--arch cuda] [--envs 1 64] [--sizes 64] [--json FILE]

Rates are medians of interleaved rounds, in environment steps per second of wall time: each turns by up to 15 degrees
and observes pictures, laser and poses. `sync` is gymnasium.vector.SyncVectorEnv, whose environments load a
scene each and take one turn after the other: it has at most 16 of them, in the row of 64 too.
"""

import argparse
import json
import os
import statistics
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gymnasium

import benchbot.gymnasium  # noqa: F401  registers the environments
from benchbot_sim_taichi import _ti

SIZES = (64, 128)
ENVIRONMENTS = (1, 4, 16, 64)
MOST_SYNC_ENVIRONMENTS = 16
ARGUMENTS = {"largest_distance_m": 0.25, "largest_angle_deg": 15.0}


@dataclass(frozen=True)
class Row:
    """Environment steps per second, and the ratio of batched to sync."""

    size: int
    environments: int
    sync: float
    batched: float
    ratio: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arch", choices=_ti.ARCHS, default="cpu")
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="PIXELS", help="width and height")
    parser.add_argument("--envs", type=int, nargs="+", default=ENVIRONMENTS, metavar="N")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    print(f"benchbot/SemanticSlam-v0, carter_lowres in miniroom:1, {options.arch}")
    print(f"{'size':>5} {'envs':>5} {'sync':>9} {'batched':>9} {'ratio':>6}")
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        os.environ["BENCHBOT_CACHE_DIR"] = cache
        for size in options.sizes:
            for environments in options.envs:
                row = measure(size, environments, options.rounds, options.arch)
                rows.append(row)
                print(
                    f"{row.size:5} {row.environments:5} {row.sync:9.1f} {row.batched:9.1f} {row.ratio:6.2f}", flush=True
                )
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")


def measure(size: int, environments: int, rounds: int, arch: str) -> Row:
    choices: dict[str, Any] = {**ARGUMENTS, "image_size": (size, size), "platform_options": {"arch": arch}}

    def make(mode: str, count: int) -> "gymnasium.vector.VectorEnv[Any, Any, Any]":
        return gymnasium.make_vec("benchbot/SemanticSlam-v0", count, mode, **choices)

    ways = (make("sync", min(environments, MOST_SYNC_ENVIRONMENTS)), make("vector_entry_point", environments))
    rates: tuple[list[float], list[float]] = ([], [])
    for envs in ways:
        envs.reset(seed=0)
        envs.action_space.seed(0)
        envs.step(turning(envs))
    for _ in range(rounds):
        for envs, measured in zip(ways, rates, strict=True):
            actions = turning(envs)
            started_s = time.perf_counter()
            envs.step(actions)
            measured.append(envs.num_envs / (time.perf_counter() - started_s))
    for envs in ways:
        envs.close()
    sync, batched = (statistics.median(measured) for measured in rates)
    return Row(size, environments, sync, batched, batched / sync)


def turning(envs: "gymnasium.vector.VectorEnv[Any, Any, Any]") -> dict[str, Any]:
    """Return an action for each that cannot collide, so that none starts again."""
    actions: dict[str, Any] = envs.action_space.sample()
    return {**actions, "action": actions["action"] * 0 + 1}


if __name__ == "__main__":
    main()
