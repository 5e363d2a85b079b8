"""The pictures and the table of docs/gallery.md: every environment by day, evening and night, beside path tracing.

python -m benchmarks.gallery [--only NAME:VARIANT ...] [--device cuda] [--width 640] [--samples 512] [--strips FOLDER]

One view of each environment, from the pose of its trajectory that sees the most objects, in the quality `realtime` and
path traced with so many samples a pixel (denoised where `pyoidn` is installed). Writes docs/images/gallery-PLACE.jpg, a
row for each variant, and the rows of the table. RMSE is in bytes of sRGB, SSIM that of luma, both after the tone curve
and at full size; with a positive bias `realtime` is the brighter. With `--strips` the rows of pictures are kept there,
and sheets hold all that lie there: so a gallery can be made in parts.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot.core.declarations.catalog import Declaration
from benchbot_sim_taichi import _ti, denoise
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.bench_environments import SEEN_PIXELS, best_views
from benchmarks.bench_quality import compare
from benchmarks.views import LOOK, camera_poses, declared, save_sheet, scene_of, shipped

DOCS = Path(__file__).parents[1] / "docs"
TIMES = {
    "noon": {"time": "12:00", "lamps": "none"},
    "evening": {"time": "19:00", "lamps": "all"},
    "night": {"time": "23:00", "lamps": "all"},
}
THUMBNAIL_PIXELS = 256

Picture = npt.NDArray[np.uint8]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME:VARIANT", help="these environments; otherwise all")
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--width", type=int, default=640, help="of the pictures that are compared; 4 : 3")
    parser.add_argument("--samples", type=int, default=512, help="of the path tracer, per pixel")
    parser.add_argument("--cache", type=Path, help="keep what is made of the scenes there")
    parser.add_argument("--strips", type=Path, metavar="FOLDER", help="keep the rows of pictures there")
    parser.add_argument("--docs", type=Path, default=DOCS, help="the folder with gallery.md and images (default: docs)")
    options = parser.parse_args()
    names = options.only or shipped()
    if not denoise.is_installed():
        print("pyoidn is not installed: the path traced pictures keep their noise, and so do the figures")
    page = options.docs / "gallery.md"
    with tempfile.TemporaryDirectory() as folder:
        cache, strips = options.cache or Path(folder), options.strips or Path(folder)
        strips.mkdir(parents=True, exist_ok=True)
        for name in names:
            started_s = time.perf_counter()
            environment = declared(name)
            pictures, cells = [], []
            for at, fast, slow in views(environment, cache, options):
                figures = compare("fast", fast, slow)
                cells.append(f"{figures['fast_rmse']:.1f} · {figures['fast_ssim']:.2f}")
                pictures += [thumbnail(fast), thumbnail(slow)]
                print(f"{name:14} {at:8} {cells[-1]}  bias {figures['fast_bias']:+.1f}", flush=True)
            Image.fromarray(np.hstack(pictures)).save(strips / f"{name.replace(':', '_')}.png")
            write_sheet(environment.data["name"], strips, options.docs / "images")
            text = with_row(page.read_text(encoding="utf-8"), [f"`{name}`", *cells])
            page.write_text(with_sheet(text, environment.data["name"]), encoding="utf-8")
            print(f"{name:14} {time.perf_counter() - started_s:.0f} s", flush=True)


def views(environment: Declaration, cache: Path, options: argparse.Namespace) -> Iterator[tuple[str, Picture, Picture]]:
    """Name of a time of day, and both pictures taken then."""
    data = environment.data
    scene, poses = scene_of(environment, cache), camera_poses(environment)
    camera = Intrinsics.from_horizontal_fov(options.width, options.width * 3 // 4, 90.0)
    pose = None
    for at in TIMES:
        lighting = Lighting.from_mapping(light_at(at, data.get("lighting") or {}))
        fast, slow = (
            Renderer(scene, lighting, cache_dir=cache, device=options.device, quality=chosen)
            for chosen in (REALTIME, Quality("path", options.samples))
        )
        if pose is None:
            objects = {known.index for known in scene.instances if known.class_name is not None}
            instances = fast.render_batch(poses, LOOK, rgb=False).instance
            pose = poses[next(best_views([seen(view) for view in instances], objects))]
        yield at, fast.render(pose, camera).rgb, slow.render(pose, camera).rgb


def light_at(at: str, declared: Mapping[str, Any]) -> dict[str, Any]:
    """An environment's light at a time of midsummer at 45°, by night with its lamps on."""
    lamps = {**declared.get("lamps", {}), "on": TIMES[at]["lamps"]}
    kept = {key: declared[key] for key in ("north_deg", "turbidity") if key in declared and "time" in declared}
    around = {"exterior": declared["exterior"]} if "exterior" in declared else {}
    return {**kept, **around, "time": TIMES[at]["time"], "lamps": lamps}


def seen(instances: npt.NDArray[np.integer]) -> set[int]:
    """Objects that a picture shows in so many pixels that one can tell."""
    numbers, pixels = np.unique(instances, return_counts=True)
    return {int(number) for number, count in zip(numbers, pixels, strict=True) if count >= SEEN_PIXELS}


def thumbnail(picture: Picture) -> Picture:
    """A picture as small as in the sheets."""
    return np.asarray(
        Image.fromarray(picture).resize((THUMBNAIL_PIXELS, THUMBNAIL_PIXELS * 3 // 4), Image.Resampling.LANCZOS)
    )


def write_sheet(place: str, strips: Path, folder: Path) -> None:
    """A place's variants one below the other."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = [np.asarray(Image.open(strip)) for strip in sorted(strips.glob(f"{place}_*.png"))]
    save_sheet(rows, folder / f"gallery-{place}.jpg")


def with_row(page: str, cells: list[str]) -> str:
    """The page with a row of its table of environments replaced, or added in order of names."""
    lines = page.splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("| environment |")) + 2
    end = next((number for number in range(start, len(lines)) if not lines[number].startswith("|")), len(lines))
    table = {line.split("|")[1].strip(): line for line in lines[start:end]}
    table[cells[0]] = f"| {' | '.join(cells)} |"
    return "\n".join([*lines[:start], *(table[name] for name in sorted(table)), *lines[end:]]) + "\n"


def with_sheet(page: str, place: str) -> str:
    """The page with a place's sheet at its end, unless it is there."""
    sheet = f"![{place}](images/gallery-{place}.jpg)"
    return page if sheet in page else f"{page}\n{sheet}\n"


if __name__ == "__main__":
    main()
