"""The same views of three environments before and after: docs/images/then-and-now.jpg.

python -m benchmarks.then_and_now STRIP.png [--before STRIP.png] [--cache FOLDER]

Writes two views of each of `office:1`, `house:1` and `company:3` to STRIP.png, a row for each. With `--before`, a strip
that this script wrote in another checkout, both are put side by side as docs/images/then-and-now.jpg: before, now.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.views import camera_poses, declared, scene_of

# Poses of the trajectories, by number; these are the same in both.
VIEWS = {"office:1": (26, 53), "house:1": (75, 108), "company:3": (15, 50)}
SHOW = Intrinsics.from_horizontal_fov(640, 360, 90.0)
SMALL_PX = (300, 169)
SHEET = Path(__file__).parents[1] / "docs" / "images" / "then-and-now.jpg"
SHEET_BYTES = 60_000

Picture = npt.NDArray[np.uint8]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("strip", type=Path, metavar="STRIP.png")
    parser.add_argument("--before", type=Path, metavar="STRIP.png", help="what this script wrote in another checkout")
    parser.add_argument("--cache", type=Path, help="keep what is made of the scenes there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cache = options.cache or Path(folder)
        rows = [np.hstack(views(name, numbers, cache)) for name, numbers in VIEWS.items()]
    Image.fromarray(np.vstack(rows)).save(options.strip)
    if options.before:
        write_sheet(options.before, options.strip, SHEET)


def views(name: str, numbers: tuple[int, ...], cache: Path) -> list[Picture]:
    """Pictures of an environment from some poses of its trajectory, in its light."""
    environment = declared(name)
    lighting = Lighting.from_mapping(environment.data.get("lighting"))
    renderer = Renderer(scene_of(environment, cache), lighting, cache_dir=cache)
    poses = camera_poses(environment)
    return [renderer.render(poses[number], SHOW).rgb for number in numbers]


def write_sheet(before: Path, now: Path, path: Path) -> None:
    """Put each view before beside the same one now, in as good a quality as `SHEET_BYTES` allow."""
    strips = [Image.open(path).convert("RGB") for path in (before, now)]
    columns = []
    for left in range(0, strips[0].width, SHOW.width):
        for strip in strips:
            views = [
                strip.crop((left, top, left + SHOW.width, top + SHOW.height)).resize(SMALL_PX, Image.Resampling.LANCZOS)
                for top in range(0, strip.height, SHOW.height)
            ]
            columns.append(np.vstack([np.asarray(view) for view in views]))
    sheet = Image.fromarray(np.hstack(columns))
    for quality in range(84, 40, -4):
        sheet.save(path, quality=quality, optimize=True, progressive=True)
        if path.stat().st_size <= SHEET_BYTES:
            break


if __name__ == "__main__":
    main()
