"""`python -m tools.thousand FOLDER [--numbers 1 1000] [--processes 2]`: freeze the thousand places.

A place is the first sound one of a series of seeds. FOLDER gets the places, one folder each, as they are made at first
use; what it has already is kept, so that it may be stopped and started again. Afterwards places.csv, the batches and
`docs/images/thousand.jpg`, all floor plans on one sheet, are written anew.
"""

import argparse
import json
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from importlib.resources import files
from pathlib import Path

import yaml
from PIL import Image

from benchbot.core.errors import BenchbotError
from benchbot_envs_thousand.making import NAME, SPLITS, Place, digest, write
from benchbot_scenes.top_down import top_down
from benchmarks.bench_soundness import Checked, examined, kind_and_rooms, tell

FIRST_SEED, SEEDS_APART = 700_000, 1000
"""The first seed of number V is FIRST_SEED + V, the next that plus SEEDS_APART, and so on."""
COLUMNS, SIDE_PX, GAP_PX = 40, 41, 3
PACKAGE = Path(str(files("benchbot_envs_thousand")))
POSTER = Path("docs/images/thousand.jpg")


def main() -> None:
    """Make what is missing, and write the package's files once all are there."""
    parser = argparse.ArgumentParser(prog="python -m tools.thousand", description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--numbers", type=int, nargs=2, default=(1, 1000), metavar=("FIRST", "LAST"))
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    first, last = options.numbers
    with ProcessPoolExecutor(options.processes) as workers:
        for told in workers.map(partial(freeze, options.folder), range(first, last + 1)):
            sys.stderr.write(told + "\n")
    wanted = [number for split in SPLITS.values() for number in split]
    if all((options.folder / str(number) / "place.json").is_file() for number in wanted):
        _write_package(options.folder, wanted)


def freeze(folder: Path, number: int) -> str:
    """Make a place, unless it is there; return a line about it."""
    there = folder / str(number) / "place.json"
    kind, rooms = kind_and_rooms(number)
    seed, refused = FIRST_SEED + number, []
    while not there.is_file():
        started_s, place = time.process_time(), Place(number, kind, rooms, seed, "")
        try:
            made, written = write(place, there.parent)
            found = examined(f"{NAME}_{number}:1", made, written.geometry, started_s)
            wrong = list(map(str, found.violations))
        except BenchbotError as error:
            wrong = [error.title]
        if wrong:
            refused.append(f"{seed}: {'; '.join(wrong)}")
            seed += SEEDS_APART
            continue
        place = place._replace(sha256=str(digest(there.parent, number)))
        # On the sheet a pixel is still coarser.
        top_down(written.geometry, pixel_m=0.15).save(there.with_name("above.png"))
        there.write_text(json.dumps({"place": place, "refused": refused, "checked": asdict(found)}), "utf-8")
    return f"{NAME}_{number}:1 {json.loads(there.read_text('utf-8'))['refused'] or ''}"


def _write_package(folder: Path, numbers: list[int]) -> None:
    kept = [json.loads((folder / str(number) / "place.json").read_text("utf-8")) for number in numbers]
    rows = [",".join(Place._fields), *(",".join(map(str, one["place"])) for one in kept)]
    (PACKAGE / "places.csv").write_text("\n".join(rows) + "\n", "utf-8")
    for split, among in SPLITS.items():
        batch = {"name": f"{NAME}_{split}", "environments": [f"{NAME}_{number}:1" for number in among]}
        (PACKAGE / "batches" / f"{split}.yaml").write_text(yaml.safe_dump(batch, sort_keys=False), "utf-8")
    _sheet(folder, numbers).save(POSTER, quality=40, optimize=True, progressive=True)
    tell(NAME, [Checked(**one["checked"]) for one in kept])
    print(f"  seeds that gave no sound place: {sum(len(one['refused']) for one in kept)}")


def _sheet(folder: Path, numbers: list[int]) -> Image.Image:
    step = SIDE_PX + GAP_PX
    sheet = Image.new("RGB", (COLUMNS * step + GAP_PX, -(-len(numbers) // COLUMNS) * step + GAP_PX), "white")
    for at, number in enumerate(numbers):
        with Image.open(folder / str(number) / "above.png") as above:
            picture = above.convert("RGB")
        picture.thumbnail((SIDE_PX, SIDE_PX), Image.Resampling.LANCZOS)
        row, column = divmod(at, COLUMNS)
        sheet.paste(
            picture,
            (
                GAP_PX + column * step + (SIDE_PX - picture.width) // 2,
                GAP_PX + row * step + (SIDE_PX - picture.height) // 2,
            ),
        )
    return sheet


if __name__ == "__main__":
    main()
