"""What our ray tracer costs: frames a second, the first frame, memory, and how costs grow."""

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.rays import first_frame
from benchmarks.rays.against_peers import NIGHT
from benchmarks.rays.scene import generate
from benchmarks.rays.workload import look

TURN_RAD = 0.3


@dataclass(frozen=True)
class Cost:
    """Seconds of one thing by wall clock and of all threads' processor time, medians; `amount` says how much of it."""

    what: str
    amount: float
    wall_s: float
    processor_s: float


def timed(what: str, amount: float, rounds: int, job: Callable[[], Any]) -> Cost:
    """Median of some runs, after one that is not measured."""
    job()
    taken = []
    for _ in range(rounds):
        wall, processor = time.perf_counter(), time.process_time()
        job()
        taken.append((time.perf_counter() - wall, time.process_time() - processor))
    wall_s, processor_s = (statistics.median(column) for column in zip(*taken, strict=True))
    return Cost(what, amount, wall_s, processor_s)


def observations(cache: Path, rounds: int) -> list[Cost]:
    """`realtime` in the shipped room at 640x480, the robot turning between observations."""
    simulator = first_frame.observer(cache)

    def observe(channels: Sequence[str]) -> None:
        simulator.drive(0.0, TURN_RAD / 0.5, 0.5)
        simulator.observe(channels)

    return [
        timed("miniroom:1, six observations", 1, rounds, lambda: observe(first_frame.SIX)),
        timed("miniroom:1, with segmentation", 1, rounds, lambda: observe(first_frame.EIGHT)),
        timed("miniroom:1, depth and laser", 1, rounds, lambda: observe(("image_depth", "laser", "poses"))),
    ]


def starts(cache: Path, rounds: int) -> list[Cost]:
    """A fresh process up to its first six observations: nothing cached, kernels alone, everything (median)."""
    cold = _start("first frame, cold cache", cache)
    for made_of_the_scene in cache.glob("*.npz"):
        made_of_the_scene.unlink()
    kernels = _start("first frame, kernels cached", cache)
    warm = [_start("first frame, warm cache", cache) for _ in range(rounds)]
    return [
        cold,
        kernels,
        replace(
            warm[0],
            wall_s=statistics.median(cost.wall_s for cost in warm),
            processor_s=statistics.median(cost.processor_s for cost in warm),
        ),
    ]


def _start(what: str, cache: Path) -> Cost:
    taken = first_frame.measure("observe", str(cache))
    return Cost(what, 1, taken["wall_s"], taken["processor_s"])


def memory(sizes: Sequence[int], cache: Path) -> dict[str, float]:
    """Peak bytes of a fresh process less that of the same with the smallest scene, in MB per million triangles."""
    peaks: dict[str, list[tuple[int, float]]] = {"depth": [], "picture": []}
    with tempfile.TemporaryDirectory() as folder:
        for size in sizes:
            scene = generate(size)
            path = Path(folder) / f"{size}.npz"
            first_frame.store(path, scene)
            for kind, found in peaks.items():
                first_frame.measure(kind, str(cache), str(path))  # fills the cache: what counts is the second time
                found.append((len(scene.triangles), first_frame.measure(kind, str(cache), str(path))["peak_bytes"]))
    grown = {}
    for kind, found in peaks.items():
        (few, low), (many, high) = found[0], found[-1]
        grown[f"{kind}: peak of {few} triangles, MB"] = low / 1e6
        grown[f"{kind}: MB per million triangles more"] = (high - low) / (many - few)
    return grown


def growth(sizes: Sequence[int], widths: Sequence[int], cameras: Sequence[int], cache: Path, rounds: int) -> list[Cost]:
    """Depth and ids, and whole pictures, as triangles, pixels and cameras grow; otherwise 200k, 320x180, one camera."""
    costs = []
    for rgb, kind in ((False, "depth+ids"), (True, "picture")):
        for size in sizes:
            renderer = Renderer(generate(size), NIGHT, cache_dir=cache)
            costs.append(timed(f"{kind} by triangles", size, rounds, _pictures(renderer, 320, 180, 1, rgb=rgb)))
        renderer = Renderer(generate(200_000), NIGHT, cache_dir=cache)
        for width in widths:
            height = width * 9 // 16
            job = _pictures(renderer, width, height, 1, rgb=rgb)
            costs.append(timed(f"{kind} by pixels", width * height, rounds, job))
        for count in cameras:
            job = _pictures(renderer, 64, 64, count, rgb=rgb)
            costs.append(timed(f"{kind} by cameras of 64x64", count, rounds, job))
    return costs


def _pictures(renderer: Renderer, width: int, height: int, count: int, *, rgb: bool) -> Callable[[], Any]:
    lens = Intrinsics.from_horizontal_fov(width, height, 90.0)
    poses = np.tile(look((5.3, 0.7, 1.6), 139.0, -14.0), (count, 1, 1))
    return lambda: renderer.render_batch(poses, lens, rgb=rgb)


def table(costs: Sequence[Cost]) -> Iterator[str]:
    """Lines of text."""
    yield f"\n{'':34} {'amount':>9} {'wall ms':>9} {'CPU ms':>9} {'per s':>7}"
    for cost in costs:
        ms = f"{1e3 * cost.wall_s:9.1f} {1e3 * cost.processor_s:9.1f}"
        yield f"{cost.what:34} {cost.amount:9.0f} {ms} {1 / cost.wall_s:7.1f}"
