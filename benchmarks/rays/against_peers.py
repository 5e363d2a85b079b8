"""Our ray tracer and its peers asked the same questions in one process, in turn."""

import tempfile
from collections.abc import Iterable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.renderer import Renderer
from benchmarks.rays.measure import Figure, interleave
from benchmarks.rays.peers import embreex, mitsuba, mujoco, open3d, ours, pybullet
from benchmarks.rays.peers.job import Job
from benchmarks.rays.scene import generate
from benchmarks.rays.workload import prepare

PEERS = (open3d, embreex, mitsuba, pybullet, mujoco)
MEASURES = ("primary", "shadow", "bounce", "frame", "path")
DARK = (0.0, 0.0, 0.0)
NIGHT = Lighting(sun=Sun(irradiance=DARK), sky=Sky(DARK, DARK, DARK))


def missing() -> dict[str, str]:
    """Peers that cannot take part, and why; says how to install them."""
    reasons = {}
    for peer in PEERS:
        if find_spec(peer.MODULE) is None:
            reasons[peer.PEER] = f"not installed: {peer.INSTALL}"
            continue
        try:
            import_module(peer.MODULE)
        except (ImportError, OSError, AttributeError) as error:
            reasons[peer.PEER] = f"does not load ({error}): {peer.INSTALL}"
    return reasons


def compare(sizes: Iterable[int], width: int, height: int, rounds: int, cache: Path) -> Iterator[Figure]:
    """Figures of every measure and program, scene by scene."""
    absent = missing()
    for size in sizes:
        scene = generate(size)
        renderer = Renderer(scene, NIGHT, cache_dir=cache)
        work = prepare(scene, renderer, width, height)
        jobs: list[Job] = ours.jobs(work, renderer)
        for peer in PEERS:
            if peer.PEER not in absent:
                module: Any = peer
                jobs += module.jobs(work)
        for measure in MEASURES:
            chosen = [job for job in jobs if job.measure == measure]
            yield from interleave(chosen, rounds, len(scene.triangles))


def table(figures: Iterable[Figure]) -> Iterator[str]:
    """Lines of text, a block for each scene and measure."""
    before: tuple[int, str] | None = None
    for figure in figures:
        if (figure.triangles, figure.measure) != before:
            before = (figure.triangles, figure.measure)
            unit = "Msamples/s" if figure.measure == "path" else "Mrays/s"
            yield f"\n{figure.measure}, {figure.triangles} triangles"
            yield f"{unit:34} {'wall':>8} {'per CPU-s':>10} {'ours / it':>10} {'per CPU-s':>10} {'same':>9}"
        yield (
            f"{figure.program:34} {figure.wall_m_per_s:8.2f} {figure.processor_m_per_s:10.2f}"
            f" {figure.ours_over_it_wall:10.2f} {figure.ours_over_it_processor:10.2f} {figure.same:9.5f}"
        )


def temporary_cache() -> "tempfile.TemporaryDirectory[str]":
    """A folder for compiled kernels and trees."""
    return tempfile.TemporaryDirectory(prefix="benchmark-")
