"""The pictures and the table of docs/gallery.md: every environment by day, evening and night, beside path tracing.

python -m benchmarks fidelity --device cuda --json FIGURES.json --pictures FOLDER
python -m benchmarks.gallery FIGURES.json FOLDER [--docs docs]

Writes docs/images/gallery-PLACE.jpg, a row for each variant, and the rows of the table, from what `fidelity` measured:
RMSE in bytes of sRGB and SSIM of luma. Environments that it did not measure keep their rows of the table; a sheet
shows those of its place that it measured.
"""

import argparse
import json
from itertools import groupby
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchmarks.bench_fidelity import picture_name
from benchmarks.views import TIMES, save_sheet

DOCS = Path(__file__).parents[1] / "docs"
THUMBNAIL_PIXELS = 256

Picture = npt.NDArray[np.uint8]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("figures", type=Path, help="what `fidelity --json` wrote")
    parser.add_argument("pictures", type=Path, help="the folder that `fidelity --pictures` filled")
    parser.add_argument("--docs", type=Path, default=DOCS, help="the folder with gallery.md and images (default: docs)")
    options = parser.parse_args()
    page = options.docs / "gallery.md"
    text = page.read_text(encoding="utf-8")
    rows = json.loads(options.figures.read_text(encoding="utf-8"))
    measured = {(row["environment"], row["time"]): row for row in rows if row["view"] == 0}
    names = sorted({name for name, _ in measured})
    if missing := [f"{name} {at}" for name in names for at in TIMES if (name, at) not in measured]:
        raise SystemExit(f"{options.figures} lacks {', '.join(missing)}: run fidelity with --times {' '.join(TIMES)}.")
    for place, of_place in groupby(names, key=lambda name: name.partition(":")[0]):
        strips = []
        for name in of_place:
            strips.append(np.hstack([pair(options.pictures / picture_name(name, at, 0)) for at in TIMES]))
            figures = [measured[name, at] for at in TIMES]
            text = with_row(text, [f"`{name}`", *(f"{row['rmse']:.1f} · {row['ssim']:.2f}" for row in figures)])
        save_sheet(strips, options.docs / "images" / f"gallery-{place}.jpg")
        text = with_sheet(text, place)
    page.write_text(text, encoding="utf-8")


def pair(path: Path) -> Picture:
    """Ours and the path traced picture, as small as in the sheets; `fidelity` painted two others beside them."""
    with Image.open(path) as painted:
        width, height = painted.width // 4, painted.height
        size = (2 * THUMBNAIL_PIXELS, THUMBNAIL_PIXELS * height // width)
        return np.asarray(painted.crop((0, 0, 2 * width, height)).resize(size, Image.Resampling.LANCZOS))


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
