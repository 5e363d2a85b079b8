"""Scans with labels from import to score, in each format that is read.

python -m benchmarks scans [--only FORMAT …] [--json FILE]

For each format a synthetic room is written as its data set is published, imported by `benchbot import-environment`, and
driven through by two examples: `hello_passive`, whose map is empty, and `segmentation_mapper`. Printed are the true
objects, the poses of the trajectory, how far a face of a true box is off at most, and both OMQ.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from plugins.scenes.tests.importing.scanned import FORMATS, TRUTH

SELECTION = ("--task", "semantic_slam:passive:ground_truth:segmentation", "--robot", "carter_lowres", "--env", "room:1")
EXAMPLES = ("hello_passive", "segmentation_mapper")


def main() -> int:
    """Print a line for each format."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks scans", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(FORMATS), default=list(FORMATS), metavar="FORMAT")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    rows = {}
    print(
        f"{'format':20} {'objects':>7} {'poses':>5} {'worst face':>10}" + "".join(f" {name:>19}" for name in EXAMPLES)
    )
    for title in options.only:
        with tempfile.TemporaryDirectory() as folder:
            row = rows[title] = measured(title, Path(folder))
        scores = "".join(f" {row[name]:19.3f}" for name in EXAMPLES)
        print(f"{title:20} {row['objects']:7} {row['poses']:5} {row['worst_face_mm']:7.2f} mm{scores}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


def measured(title: str, folder: Path) -> dict[str, float]:
    """Import the room in one format and run both examples in it."""
    made = folder / "made"
    words = ("--name", "room", "--output-location", str(made), "--robot", "carter_lowres", "--no-pictures")
    benchbot("import-environment", str(FORMATS[title](folder)), *words)
    truth = json.loads((made / "ground_truths" / "room_1.json").read_text())
    objects = truth["ground_truth"]["objects"]
    row: dict[str, float] = {
        "objects": len(objects),
        "poses": len(truth["environment"]["trajectory_poses"]),
        "worst_face_mm": 1000 * _worst_m(objects),
    }
    for name in EXAMPLES:
        run = ("--example", name, "--results-location", str(folder / f"{name}.json"), "--evaluate-with", "omq")
        row[name] = float(benchbot("submit", "--addons", str(made), *SELECTION, *run).split()[-1])
    return row


def _worst_m(objects: list[dict[str, Any]]) -> float:
    errors = [0.0]
    for entry, box in zip(objects, TRUTH.values(), strict=True):
        middle, half = np.array(entry["centroid"]), np.array(entry["extent"]) / 2
        errors += [np.abs(middle - half - box.bounds[0]).max(), np.abs(middle + half - box.bounds[1]).max()]
    return float(max(errors))


def benchbot(*words: str) -> str:
    """Run a command and return what it prints; end this process, saying why, where it fails."""
    done = subprocess.run([sys.executable, "-m", "benchbot", *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"benchbot {' '.join(words)}\n{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
