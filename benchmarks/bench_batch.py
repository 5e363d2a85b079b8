"""Small pictures of many cameras in one scene: taken together, beside one after the other in the same run.

python -m benchmarks.bench_batch [SCENE.glb] [--device cuda] [--quality fast] [--cameras 1 64 4096] [--json FILE]

Rates are medians of interleaved rounds, in pictures per second of wall time; `in place` leaves them on the device,
in memory that is used again, the others have them on the host.
"""

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import FAST, QUALITIES, REALTIME
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.bench_renderer import SHIPPED, looking

SIZES = (64, 128)
CAMERAS = (1, 4, 16, 64)
MOST_SINGLE_PICTURES = 64


@dataclass(frozen=True)
class Row:
    """Pictures per second, and the ratio of together to one by one."""

    channels: str
    size: int
    cameras: int
    one_by_one: float
    together: float
    ratio: float
    in_place: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=SHIPPED)
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--quality", choices=(FAST.name, REALTIME.name), default=REALTIME.name)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="PIXELS", help="width and height")
    parser.add_argument("--cameras", type=int, nargs="+", default=CAMERAS, metavar="N")
    parser.add_argument("--position", type=float, nargs=3, default=(1.2, 1.5, 1.05), metavar=("X", "Y", "Z"))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    scene = load_scene(options.scene)
    print(f"{options.scene.name}, {len(scene.triangles)} triangles, {options.device}")
    print(
        f"{'channels':9} {'size':>5} {'cameras':>8} {'one by one':>11} {'together':>11} {'ratio':>6} {'in place':>11}"
    )
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        quality = QUALITIES[options.quality]
        renderer = Renderer(scene, Lighting(), cache_dir=Path(cache), device=options.device, quality=quality)
        for rgb in (True, False):
            for size in options.sizes:
                for cameras in options.cameras:
                    row = measure(renderer, np.array(options.position), size, cameras, options.rounds, rgb=rgb)
                    rows.append(row)
                    print(
                        f"{row.channels:9} {size:5} {cameras:8} {row.one_by_one:11.1f} {row.together:11.1f}"
                        f" {row.ratio:6.2f} {row.in_place:11.1f}",
                        flush=True,
                    )
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")


def measure(
    renderer: Renderer, position: npt.NDArray[np.float64], size: int, cameras: int, rounds: int, *, rgb: bool
) -> Row:
    camera = Intrinsics.from_horizontal_fov(size, size, 90.0)
    spread = np.random.default_rng(0).uniform(-0.3, 0.3, (cameras, 3))
    poses = np.stack([looking(position + offset, 360 * k / cameras) for k, offset in enumerate(spread)])
    singles = poses[:: -(-cameras // MOST_SINGLE_PICTURES)]

    frames = renderer.render_on_device(poses, camera, rgb=rgb)

    def in_place() -> None:
        renderer.render_on_device(poses, camera, rgb=rgb, out=frames)
        _ti.ti.sync()

    jobs: dict[str, tuple[int, Callable[[], Any]]] = {
        "one by one": (len(singles), lambda: [renderer.render(pose, camera, rgb=rgb) for pose in singles]),
        "together": (cameras, lambda: renderer.render_batch(poses, camera, rgb=rgb)),
        "in place": (cameras, in_place),
    }
    rates: dict[str, list[float]] = {name: [] for name in jobs}
    for _, job in jobs.values():
        job()
    for _ in range(rounds):
        for name, (pictures, job) in jobs.items():
            started_s = time.perf_counter()
            job()
            rates[name].append(pictures / (time.perf_counter() - started_s))
    one_by_one, together, in_place_rate = (statistics.median(values) for values in rates.values())
    ratio = together / one_by_one
    return Row("rgb-d-ids" if rgb else "depth-ids", size, cameras, one_by_one, together, ratio, in_place_rate)


if __name__ == "__main__":
    main()
