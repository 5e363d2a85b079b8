"""Pictures of Gaussian splats: how long they take, and how near they come to what the splats were made from.

python -m benchmarks splats [--cells 0.0336 0.019 0.0104] [--environment miniroom:1] [--rounds 9]
    [--parts speed alignment scores] [--pictures FOLDER] [--cache FOLDER] [--json FILE]

No trained scan is shipped. Splats of an environment are made from pictures that the ray tracer takes all around from
every sixth pose of its trajectory (`splat_scans`), one for each cell of space, and looked at from poses between. Times
are medians of wall and processor time of --rounds pictures of each view, after two; `haze` are the same splats twice as
wide with an opacity of 0.3, so that each pixel sees through many. PSNR and SSIM compare with the picture of quality
realtime. Then the splats are moved, and the alignment check of an import says what it finds. At the end the mesh and
its splats, as files, are imported, and two examples are run with and without the splats.
"""

import argparse
import json
import statistics
import tempfile
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.importing import splat_alignment
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.splats import Splats, transformed
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks import splat_scans, views
from benchmarks.bench_quality import ssim
from benchmarks.bench_scans import benchbot
from plugins.scenes.tests.importing.trained import write_ply

SIZES = ((640, 480), (960, 540))
SCAN_LENS = Intrinsics.from_horizontal_fov(512, 512, 90.0)
EVERY = 6
MOST_VIEWS = 6
HAZE_OPACITY, HAZE_WIDTH = 0.3, 2.0
PARTS = ("speed", "alignment", "scores")
EXAMPLES = ("hello_passive", "segmentation_mapper")
SELECTION = ("--task", "semantic_slam:passive:ground_truth:segmentation", "--robot", "carter_lowres", "--env", "scan:1")


def main() -> None:
    """Print a line for each number of splats, then the scores."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks splats", description=__doc__.splitlines()[0])
    parser.add_argument("--environment", default="miniroom:1", metavar="NAME:VARIANT")
    parser.add_argument("--cells", type=float, nargs="+", default=[0.0336, 0.019, 0.0104], metavar="METRES")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, metavar="PART", help=" ".join(PARTS))
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="write what is compared there")
    parser.add_argument("--cache", type=Path, metavar="FOLDER", help="keep kernels and light there")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = measure(options, Path(folder))
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def measure(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """All figures, printed as they come."""
    environment = views.declared(options.environment)
    cache = options.cache or folder
    scene = views.scene_of(environment, cache)
    lighting = Lighting.from_mapping(environment.data.get("lighting"))
    mesh = Renderer(scene, lighting, cache_dir=cache)
    poses = views.camera_poses(environment)
    around = np.concatenate([splat_scans.around(pose) for pose in poses[::EVERY]])
    scan = splat_scans.scan(mesh, around, SCAN_LENS)
    between = poses[EVERY // 2 :: EVERY]
    between = between[:: -(-len(between) // MOST_VIEWS)]
    sizes = "".join(f" {f'{width}x{height} ms':>14} {'CPU ms':>7}" for width, height in SIZES)
    print(f"{'splats':>9} {'kind':>7}{sizes} {'PSNR dB':>8} {'SSIM':>6}", flush=True)
    rows: list[dict[str, Any]] = []
    for cell_m in options.cells:
        splats = splat_scans.splats_of(scan, cell_m)
        haze = replace(
            splats,
            opacities=np.full_like(splats.opacities, HAZE_OPACITY),
            scales_m=splats.scales_m * np.float32(HAZE_WIDTH),
        )
        for kind, seen in {"sharp": splats, "haze": haze}.items() if "speed" in options.parts else ():
            shown = Renderer(replace(scene, splats=seen), lighting, cache_dir=cache)
            row = {"splats": splats.count, "kind": kind, **timed(shown, between, options.rounds)}
            if seen is splats:
                row |= compared(shown, mesh, between, options.pictures)
            rows.append(row)
            print(line(row), flush=True)
    found: dict[str, Any] = {"rows": rows}
    if "alignment" in options.parts:
        found["alignment"] = aligned(replace(scene, splats=splats), environment.data["trajectory_poses"], cache)
    if "scores" in options.parts:
        found["scores"] = scored(scene, splats, folder)
        print(json.dumps(found["scores"], indent=1))
    return found


def aligned(scene: SceneGeometry, poses: list[list[float]], cache: Path) -> dict[str, dict[str, Any]]:
    """What the check says of the splats where they are, and of moved ones."""
    splats = scene.splats
    assert splats is not None
    middle = np.median(splats.positions_m, axis=0)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = {
        "as they are": splats,
        "shifted by 5 cm along x": transformed(splats, offset=(0.05, 0.0, 0.0)),
        "shifted by 20 cm along x": transformed(splats, offset=(0.2, 0.0, 0.0)),
        "10 % too large": transformed(splats, scale=1.1, offset=-0.1 * middle),
        "10 % too small": transformed(splats, scale=0.9, offset=0.1 * middle),
        "turned by 90° about z": transformed(splats, quarter, offset=middle - quarter @ middle),
        "y up instead of z": transformed(splats, Y_UP_TO_Z_UP),
        "in centimetres": transformed(splats, scale=100.0),
    }
    found = {}
    for name, cloud in moved.items():
        alignment = splat_alignment.measure(replace(scene, splats=cloud), poses, cache)
        assert alignment is not None
        found[name] = asdict(alignment)
        verdict = "error" if alignment.is_other_place else "warning" if alignment.is_off else "fine"
        print(f"{name:26} {verdict:8} {alignment}. {alignment.cause}", flush=True)
    return found


def timed(renderer: Renderer, poses: npt.NDArray[np.floating], rounds: int) -> dict[str, float]:
    """Median milliseconds of a picture at each size, of wall and of processor time."""
    found: dict[str, float] = {}
    for width, height in SIZES:
        lens = Intrinsics.from_horizontal_fov(width, height, 90.0)
        taken = []
        for number in range(rounds * len(poses) + 2):
            started_s = np.array([time.perf_counter(), time.process_time()])
            renderer.render(poses[number % len(poses)], lens)
            taken.append(np.array([time.perf_counter(), time.process_time()]) - started_s)
        wall_s, processor_s = np.median(taken[2:], axis=0)
        found |= {f"{width}x{height}": 1e3 * float(wall_s), f"{width}x{height} CPU": 1e3 * float(processor_s)}
    return found


def compared(
    shown: Renderer, mesh: Renderer, poses: npt.NDArray[np.floating], pictures: Path | None
) -> dict[str, float]:
    """Means of PSNR and SSIM over the views, at the larger size."""
    lens = Intrinsics.from_horizontal_fov(*SIZES[1], 90.0)
    noise, likeness = [], []
    for number, pose in enumerate(poses):
        ours, theirs = shown.render(pose, lens).rgb, mesh.render(pose, lens).rgb
        noise.append(psnr_db(ours, theirs))
        likeness.append(ssim(ours.mean(axis=2), theirs.mean(axis=2)))
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            count = shown.scene.splats.count if shown.scene.splats else 0
            Image.fromarray(np.vstack([theirs, ours])).save(pictures / f"{count}_{number}.png")
    return {"psnr_db": statistics.mean(noise), "ssim": statistics.mean(likeness)}


def psnr_db(ours: npt.NDArray[np.uint8], theirs: npt.NDArray[np.uint8]) -> float:
    """Peak signal over noise of bytes."""
    return float(20 * np.log10(255 / np.sqrt(np.mean((ours.astype(float) - theirs) ** 2))))


def line(row: dict[str, Any]) -> str:
    """A row of the table."""
    sizes = "".join(f" {row[f'{width}x{height}']:14.0f} {row[f'{width}x{height} CPU']:7.0f}" for width, height in SIZES)
    likeness = f" {row['psnr_db']:8.1f} {row['ssim']:6.3f}" if "psnr_db" in row else ""
    return f"{row['splats']:9,} {row['kind']:>7}{sizes}{likeness}"


def scored(scene: SceneGeometry, splats: Splats, folder: Path) -> dict[str, Any]:
    """Import the mesh with and without its splats, and run the examples in both."""
    mesh, cloud = folder / "scan.glb", folder / "point_cloud.ply"
    mesh.write_bytes(to_glb(scene))
    write_ply(cloud, transformed(splats, Y_UP_TO_Z_UP.T))
    found: dict[str, Any] = {}
    for name, more in (("mesh", ()), ("splats", ("--splats", str(cloud)))):
        made = folder / name
        words = ("-o", str(made), "--robot", "carter_lowres", "--no-pictures", "--json")
        told = json.loads(benchbot("import-environment", str(mesh), *words, *more))
        found[name] = {"alignment": told["splats"] and told["splats"]["alignment"]}
        found[name]["bytes"] = (made / "scenes" / "scan_1.glb").stat().st_size
        for example in EXAMPLES:
            results = ("--results-location", str(folder / f"{name}_{example}.json"), "--evaluate-with", "omq")
            run = ("submit", "--addons", str(made), *SELECTION, "--seed", "1", "--example", example, *results)
            found[name][example] = float(benchbot(*run).split()[-1])
    return found


if __name__ == "__main__":
    main()
