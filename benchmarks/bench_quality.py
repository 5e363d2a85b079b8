"""How close the qualities `realtime` and `path` are to `reference`, after the tone curve.

python -m benchmarks.bench_quality [--width 160] [--samples 256] [--json FILE] [--pictures FOLDER]

RMSE in bytes of sRGB; SSIM of luma (Wang et al., "Image quality assessment: from error visibility to structural
similarity", 2004), Gaussian window of 1.5 pixels. The reference is bounded by --samples: its own error is printed too.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from benchbot.core import resources
from benchbot.core.declarations import schema
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene_file import scene_file
from benchbot_sim_taichi import camera_response, denoise
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.quality import REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.bench_renderer import looking

SHIPPED = Path(__file__).parents[1] / "plugins/envs_bear/src/benchbot_envs_bear/environments/miniroom_1.yaml"
PLACES = (((1.2, 1.5, 1.05), -90.0), ((0.4, 1.2, 1.05), 60.0), ((2.1, 1.6, 1.05), 180.0))
LUMA = np.array([0.299, 0.587, 0.114])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--environment", type=Path, default=SHIPPED)
    parser.add_argument("--width", type=int, default=160)
    parser.add_argument("--samples", type=int, default=256, help="of the reference, per pixel")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="also write the pictures there")
    arguments = parser.parse_args()
    environment = schema.read(arguments.environment)
    scene = load_scene(scene_file(arguments.environment.parent / environment["map_path"], resources.cache_dir()))
    camera = Intrinsics.from_horizontal_fov(arguments.width, arguments.width * 3 // 4, 90.0)
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        lighting = Lighting.from_mapping(environment.get("lighting"))
        fast, slow = (
            Renderer(scene, lighting, cache_dir=Path(cache), quality=chosen)
            for chosen in (REALTIME, Quality("path", 16))
        )
        for place, (position, yaw_deg) in enumerate(PLACES):
            pose = looking(np.array(position), yaw_deg)
            halves = [
                path_trace(slow, pose, camera, samples_per_pixel=arguments.samples // 2, seed=seed) for seed in (1, 2)
            ]
            truth = camera_response.develop_on_host(np.mean(halves, axis=0, dtype=np.float32))
            started, spent = time.perf_counter(), time.process_time()
            path = slow.render(pose, camera).rgb
            wall_s, processor_s = time.perf_counter() - started, time.process_time() - spent
            pictures = {"reference": truth, "realtime": fast.render(pose, camera).rgb, "path": path}
            noise = [camera_response.develop_on_host(half).astype(float) for half in halves]
            rows.append(
                {
                    "place": place,
                    "reference_noise_rmse": 0.5 * float(np.sqrt(np.mean((noise[0] - noise[1]) ** 2))),
                    "path_wall_s": wall_s,
                    "path_processor_s": processor_s,
                    "denoised": denoise.is_installed(),
                    **compare("realtime", pictures["realtime"], truth),
                    **compare("path", path, truth),
                }
            )
            print("  ".join(f"{name} {value:.3g}" for name, value in rows[-1].items()), flush=True)
            for name, picture in pictures.items() if arguments.pictures else ():
                Image.fromarray(picture).save(arguments.pictures / f"{place}_{name}.png")
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def compare(name: str, picture: np.ndarray, truth: np.ndarray) -> dict[str, Any]:
    """RMSE and mean difference in bytes, and SSIM."""
    difference = picture.astype(float) - truth
    return {
        f"{name}_rmse": float(np.sqrt(np.mean(difference**2))),
        f"{name}_bias": float(difference.mean()),
        f"{name}_ssim": ssim(picture @ LUMA, truth @ LUMA),
    }


def ssim(one: np.ndarray, other: np.ndarray) -> float:
    """Structural similarity of two (H, W) pictures in bytes."""
    mean_one, mean_other = (gaussian_filter(picture, 1.5) for picture in (one, other))
    variance_one, variance_other, covariance = (
        gaussian_filter(a * b, 1.5) - mean_a * mean_b
        for a, b, mean_a, mean_b in (
            (one, one, mean_one, mean_one),
            (other, other, mean_other, mean_other),
            (one, other, mean_one, mean_other),
        )
    )
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    luminance = (2 * mean_one * mean_other + c1) / (mean_one**2 + mean_other**2 + c1)
    structure = (2 * covariance + c2) / (variance_one + variance_other + c2)
    return float((luminance * structure).mean())


if __name__ == "__main__":
    main()
