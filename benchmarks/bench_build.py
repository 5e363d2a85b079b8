"""What building the search tree costs in time and memory, and what moving an object costs.

python -m benchmarks.bench_build [--quick] [--device cuda] [--json FILE]

Seconds are of the processor, all threads counted: on a busy machine they mean more than those of the clock, which are
given beside them. Embree (through `embreex`, optional) builds its tree for the same triangles.
"""

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.core.geometry import Pose
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import _ti, bvh, tables
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Renderer
from benchmarks.rays.scene import generate

SIZES = (20_000, 200_000, 1_000_000)
MOVES = 20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="leave out the scene of a million triangles")
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu", help="where objects are moved")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file")
    arguments = parser.parse_args()
    report = [measure(generate(size, seed=3), arguments.device) for size in (SIZES[:-1] if arguments.quick else SIZES)]
    print("triangles  build CPU s  clock s  Embree CPU s  tree MB  largest object  move: first ms  then ms")
    for row in report:
        embree = f"{row['embree_processor_s']:12.2f}" if "embree_processor_s" in row else " (no embreex)"
        print(
            f"{row['triangles']:9}  {row['build_processor_s']:11.2f}  {row['build_s']:7.2f}  {embree}"
            f"  {row['tree_mb']:7.1f}  {row['object_triangles']:14}  {row['first_move_processor_ms']:14.1f}"
            f"  {row['move_processor_ms']:7.1f}"
        )
    if arguments.json:
        arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def measure(scene: SceneGeometry, device: str) -> dict[str, Any]:
    groups = tables.group_triangles(scene)
    tree, build_s, build_processor_s = timed(
        lambda: bvh.build(scene.vertices, scene.triangles, (groups.solid, groups.sheer))
    )
    row: dict[str, Any] = {
        "triangles": len(scene.triangles),
        "build_s": build_s,
        "build_processor_s": build_processor_s,
        "tree_mb": (tree.nodes.nbytes + tree.leaves.nbytes) / 1e6,
    }
    if find_spec("embreex"):
        _, row["embree_s"], row["embree_processor_s"] = timed(lambda: build_embree(scene))
    count = np.bincount(scene.triangle_instance)
    largest = int(count.argmax())
    with tempfile.TemporaryDirectory() as cache:
        renderer = Renderer(scene, Lighting(exposure=1.0), cache_dir=Path(cache), device=device)
        poses = [Pose((0.01 * step, 0.0, 0.0)).matrix() for step in range(MOVES)]
        costs = [timed(partial(renderer.move, largest, pose))[2] for pose in poses]
    row["object_triangles"] = int(count[largest])
    row["first_move_processor_ms"] = 1e3 * costs[0]
    row["move_processor_ms"] = 1e3 * statistics.median(costs[1:])
    return row


def build_embree(scene: SceneGeometry) -> None:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore import EmbreeDevice
    from embreex.rtcore_scene import EmbreeScene

    target = EmbreeScene(EmbreeDevice())
    TriangleMesh(target, scene.vertices, scene.triangles)
    ray = np.array([[0.0, 0.0, 1.0]], np.float32)
    target.run(ray, ray)  # it builds when first asked


def timed(job: Callable[[], Any]) -> tuple[Any, float, float]:
    """Result, seconds of wall time, seconds of processor time."""
    wall_s, processor_s = time.perf_counter(), time.process_time()
    result = job()
    return result, time.perf_counter() - wall_s, time.process_time() - processor_s


if __name__ == "__main__":
    main()
