"""How fast the ray tracer is, beside Embree in the same run.

python -m benchmarks.bench_renderer [SCENE.glb] [--device cuda] [--json FILE]

Rates are medians; ratios compare runs that were interleaved on the same machine. Embree (through `embreex`, optional)
runs on one thread, hence the ratio per processor second beside the one of wall time.
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

from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer

SHIPPED = Path(__file__).parents[1] / "plugins/envs_bear/src/benchbot_envs_bear/scenes/miniroom_1.glb"
CAMERA = Intrinsics.from_horizontal_fov(960, 540, 90.0)
LASER_BEAMS = 900


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=SHIPPED)
    parser.add_argument("--position", type=float, nargs=3, default=(1.2, 1.5, 1.05), metavar=("X", "Y", "Z"))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file")
    arguments = parser.parse_args()
    scene = load_scene(arguments.scene)
    report = {"scene": arguments.scene.name, "triangles": len(scene.triangles), "width": CAMERA.width}
    with tempfile.TemporaryDirectory() as cache:
        report |= measure(scene, Path(cache), np.array(arguments.position), arguments.rounds, arguments.device)
    for name, value in report.items():
        print(f"{name:32} {value:.3g}" if isinstance(value, float) else f"{name:32} {value}")
    if arguments.json:
        arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def measure(scene: SceneGeometry, cache: Path, position: np.ndarray, rounds: int, device: str) -> dict[str, Any]:
    renderer, load_s, _ = timed(lambda: Renderer(scene, Lighting(), cache_dir=cache, device=device))
    poses = [looking(position, yaw_deg) for yaw_deg in range(0, 360, 60)]
    _, first_s, _ = timed(lambda: renderer.render(poses[0], CAMERA))
    renderer.render(poses[0], CAMERA, rgb=False)
    pixels = CAMERA.width * CAMERA.height
    beams = np.linspace(-np.pi, np.pi, LASER_BEAMS)
    directions = np.stack([np.cos(beams), np.sin(beams), np.zeros_like(beams)], axis=1)
    origins = np.tile([*position[:2], 0.3], (LASER_BEAMS, 1))
    renderer.cast(origins, directions, 30.0)
    rays = [camera_rays(pose) for pose in poses]
    embree = embree_caster(scene) if find_spec("embreex") else None

    jobs: dict[str, Callable[[int], Any]] = {
        "frame": lambda i: renderer.render(poses[i], CAMERA),
        "depth": lambda i: renderer.render(poses[i], CAMERA, rgb=False),
        "laser": lambda i: renderer.cast(origins, directions, 30.0),
        "rays": lambda i: renderer.cast(*rays[i], 1e4),
    }
    if embree is not None:
        jobs["embree"] = lambda i: embree(*rays[i])
    wall: dict[str, list[float]] = {name: [] for name in jobs}
    processor: dict[str, list[float]] = {name: [] for name in jobs}
    for index in range(rounds * len(poses)):
        for name, job in jobs.items():
            _, wall_s, processor_s = timed(partial(job, index % len(poses)))
            wall[name].append(wall_s)
            processor[name].append(processor_s)
    seconds = {name: statistics.median(values) for name, values in wall.items()}
    report: dict[str, Any] = {
        "load_s": load_s,
        "first_frame_s": first_s,
        "frame_s": seconds["frame"],
        "frames_per_s": 1 / seconds["frame"],
        "depth_frame_s": seconds["depth"],
        "laser_ms": 1e3 * seconds["laser"],
        "depth_mrays_per_s": pixels / seconds["depth"] / 1e6,
        "cast_mrays_per_s": pixels / seconds["rays"] / 1e6,
    }
    if embree is not None:
        report["embree_mrays_per_s"] = pixels / seconds["embree"] / 1e6
        report["cast_over_embree_wall"] = seconds["embree"] / seconds["rays"]
        report["cast_over_embree_processor"] = statistics.median(processor["embree"]) / statistics.median(
            processor["rays"]
        )
    return report


def timed(job: Callable[[], Any]) -> tuple[Any, float, float]:
    """Result, wall seconds and processor seconds (all threads) of one call."""
    wall, processor = time.perf_counter(), time.process_time()
    result = job()
    return result, time.perf_counter() - wall, time.process_time() - processor


def looking(position: np.ndarray, yaw_deg: float) -> np.ndarray:
    """Pose of a level optical frame."""
    yaw = np.radians(yaw_deg)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[np.sin(yaw), 0, np.cos(yaw)], [-np.cos(yaw), 0, np.sin(yaw)], [0, -1, 0]])
    pose[:3, 3] = position
    return pose


def camera_rays(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions of a picture's rays."""
    column, row = np.meshgrid(np.arange(CAMERA.width) + 0.5, np.arange(CAMERA.height) + 0.5)
    rays = np.stack([(column - CAMERA.cx) / CAMERA.fx, (row - CAMERA.cy) / CAMERA.fy, np.ones_like(row)], axis=-1)
    directions = rays.reshape(-1, 3) @ pose[:3, :3].T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.tile(pose[:3, 3], (len(directions), 1)).astype(np.float32), directions.astype(np.float32)


def embree_caster(scene: SceneGeometry) -> Callable[[np.ndarray, np.ndarray], Any]:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore import EmbreeDevice
    from embreex.rtcore_scene import EmbreeScene

    device = EmbreeDevice()
    target = EmbreeScene(device, robust=True)
    TriangleMesh(target, scene.vertices, scene.triangles)

    def cast(origins: np.ndarray, directions: np.ndarray) -> Any:
        return target.run(origins, directions, output=True, dists=np.full(len(origins), 1e30, np.float32))

    return cast


if __name__ == "__main__":
    main()
