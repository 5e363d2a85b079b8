"""A process of its own that loads something, takes a first picture, and says what that cost.

python -m benchmarks.rays.first_frame observe CACHE    miniroom:1, all six observations at 640x480
python -m benchmarks.rays.first_frame depth CACHE FILE    depth and ids of a scene stored by `store`
python -m benchmarks.rays.first_frame picture CACHE FILE    the same in colour
"""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchbot_scenes.scene import Instance, Material, SceneGeometry

ARRAYS = ("vertices", "triangles", "triangle_instance", "triangle_material", "normals", "uvs")


def measure(*arguments: str) -> dict[str, float]:
    """Run this in a fresh process; wall and processor seconds from its start to its first picture, peak bytes."""
    started_s = time.perf_counter()
    child = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.rays.first_frame", *arguments], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    line = child.stdout.readline()
    wall_s = time.perf_counter() - started_s
    if child.wait() != 0 or not line:
        raise RuntimeError("A process that was to take a first picture died; its message is above.")
    return {"wall_s": wall_s, **json.loads(line)}


def store(path: Path, scene: SceneGeometry) -> None:
    """Write a scene without images, so that a process can have it without the memory that making it takes."""
    colors = np.array([[*m.base_color, *m.emission] for m in scene.materials], np.float32)
    np.savez(path, colors=colors, **{name: getattr(scene, name) for name in ARRAYS})


def read(path: Path) -> SceneGeometry:
    """Return what `store` wrote, materials without their names."""
    with np.load(path) as stored:
        colors = stored["colors"].tolist()
        return SceneGeometry(
            **{name: stored[name] for name in ARRAYS},
            materials=tuple(Material("", tuple(row[:3]), emission=tuple(row[3:])) for row in colors),
            instances=tuple(Instance(i + 1, "", None) for i in range(len(colors))),
        )


def observer(cache: Path) -> Any:
    """The shipped room with a robot whose camera has 640x480 pixels."""
    from importlib.resources import files

    from benchbot.core.declarations import schema
    from benchbot.core.platform import PlatformSpec, Scene
    from benchbot_sim_taichi.simulator import RayTracedSimulator

    robot = schema.read(Path(str(files("benchbot_sim_taichi"))) / "robots" / "carter.yaml")
    robot["camera"] |= {"width": 640, "height": 480, "fx": 320, "fy": 320, "cx": 320, "cy": 240}
    environment = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
    simulator = RayTracedSimulator(PlatformSpec(robot, "ground_truth", cache))
    simulator.load(Scene(schema.read(environment), environment.parent), seed=0)
    return simulator


SIX = ("image_depth", "image_depth_info", "image_rgb", "image_rgb_info", "laser", "poses")
EIGHT = (*SIX, "image_segment", "image_segment_info")


def _picture(kind: str, cache: Path, scene: SceneGeometry) -> None:
    from benchbot_sim_taichi.renderer import Intrinsics, Renderer
    from benchmarks.rays.against_peers import NIGHT
    from benchmarks.rays.workload import look

    camera = Intrinsics.from_horizontal_fov(960, 540, 90.0)
    renderer = Renderer(scene, NIGHT, cache_dir=cache)
    renderer.render(look((5.3, 0.7, 1.6), 139.0, -14.0), camera, rgb=kind == "picture")


def main() -> None:
    kind, cache = sys.argv[1], Path(sys.argv[2])
    if kind == "observe":
        observer(cache).observe(SIX)
    else:
        _picture(kind, cache, read(Path(sys.argv[3])))
    # Not getrusage's ru_maxrss, which a new program has from the one that started it.
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    peak_bytes = int(status["VmHWM"].split()[0]) * 1024
    print(json.dumps({"processor_s": time.process_time(), "peak_bytes": peak_bytes}), flush=True)


if __name__ == "__main__":
    main()
