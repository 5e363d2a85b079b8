"""Every environment: how large it is, what loading it costs, what its trajectory sees, and what it looks like.

python -m benchmarks.bench_environments [NAME:VARIANT ...] [--device cpu] [--json FILE] [--pictures FOLDER]

An object counts as seen when the camera on the trajectory (that of `carter`, a quarter as wide) shows it in 4 pixels
or more of a picture. `--pictures` also writes a sheet for each place: a row for each variant, from above and from three
poses that together see the most objects. Each environment is loaded in a process of its own, so that peak memory is its
own.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from benchbot.core.declarations.catalog import Declaration
from benchbot_scenes.top_down import top_down
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.views import LOOK, camera_poses, declared, save_sheet, scene_of, shipped

SEEN_PIXELS = 4
SHOW = Intrinsics.from_horizontal_fov(400, 225, 90.0)
VIEWS = 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("environment", nargs="*", metavar="NAME:VARIANT")
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--cache", type=Path, help="keep what is made of the scenes there")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="also write environments-PLACE.jpg there")
    parser.add_argument("--alone", metavar="FOLDER", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        print(json.dumps(measure(declared(options.environment[0]), options, Path(options.alone))))
        return
    names = options.environment or shipped()
    rows = []
    print(f"{'':14} {'triangles':>9} {'lamps':>6} {'load s':>7} {'MB':>6} {'objects':>7} {'poses':>5}  not seen")
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            rows.append(row := alone(name, options, folder))
            print(
                f"{name:14} {row['triangles']:9} {row['glowing_triangles']:6} {row['load_s']:7.1f} "
                f"{row['peak_mb']:6.0f} {row['objects']:7} {row['poses']:5}  {', '.join(row['not_seen']) or '-'}",
                flush=True,
            )
        if options.pictures:
            write_sheets(Path(folder), names, options.pictures)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def alone(name: str, options: argparse.Namespace, folder: str) -> dict[str, Any]:
    """Measure one environment in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.bench_environments", name, "--alone", folder]
    command += ["--device", options.device]
    command += ["--cache", str(options.cache)] if options.cache else []
    command += ["--pictures", str(options.pictures)] if options.pictures else []
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    row: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return row


def measure(environment: Declaration, options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """One environment's figures; leaves its row of pictures in `folder`."""
    cache = options.cache or folder
    data = environment.data
    started_s = time.process_time()
    scene = scene_of(environment, cache)
    loaded_s = time.process_time() - started_s
    glowing = np.array([material.is_emissive for material in scene.materials], bool)[scene.triangle_material]
    renderer = Renderer(scene, Lighting.from_mapping(data.get("lighting")), cache_dir=cache, device=options.device)
    poses = camera_poses(environment)
    instances = renderer.render_batch(poses, LOOK, rgb=False).instance
    objects = {known.index: known.name for known in scene.instances if known.class_name is not None}
    seen = [
        {i for i, n in zip(*np.unique(view, return_counts=True), strict=True) if n >= SEEN_PIXELS} for view in instances
    ]
    if options.pictures:
        views = [renderer.render(poses[k], SHOW).rgb for k in best_views(seen, set(objects))]
        plan = top_down(scene, pixel_m=0.03)
        plan.thumbnail((SHOW.width, SHOW.height))
        above = Image.new("RGB", (SHOW.width, SHOW.height), "white")
        above.paste(plan, ((SHOW.width - plan.width) // 2, (SHOW.height - plan.height) // 2))
        strip = np.hstack([np.asarray(above), *views])
        Image.fromarray(strip).save(folder / f"{data['name']}_{data['variant']}.png")
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {
        "environment": environment.name,
        "triangles": len(scene.triangles),
        "glowing_triangles": int(glowing.sum()),
        "load_s": loaded_s,
        "peak_mb": int(status["VmHWM"].split()[0]) / 1024,
        "objects": len(objects),
        "poses": len(poses),
        "not_seen": sorted(name for index, name in objects.items() if not any(index in view for view in seen)),
    }


def best_views(seen: list[set[int]], objects: set[int]) -> Iterator[int]:
    """Poses that one after the other see most of what has not been seen yet."""
    left = set(objects)
    for _ in range(VIEWS):
        best = max(range(len(seen)), key=lambda k: (len(seen[k] & left), len(seen[k] & objects)))
        left -= seen[best]
        yield best


def write_sheets(strips: Path, names: list[str], folder: Path) -> None:
    """A picture for each place, its variants one below the other."""
    places = defaultdict(list)
    for name in names:
        place, variant = name.split(":")
        places[place].append(np.asarray(Image.open(strips / f"{place}_{variant}.png")))
    for place, rows in places.items():
        save_sheet(rows, folder / f"environments-{place}.jpg")


if __name__ == "__main__":
    main()
