"""The mapper that sees and the one that is told: their OMQ in each environment, with intervals.

python -m benchmarks perception [--only PLACE …] [--work FOLDER] [--set KEY=VALUE …] [--json FILE]

Each is a batch of `carter_lowres` along the given trajectories, with true poses; with --work it is kept, and what is
computed in it already is not computed again.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.bench_baselines import PLACES, ROBOT

TASK = "semantic_slam:passive:ground_truth"
MAPPERS = {"perception_mapper": TASK, "segmentation_mapper": f"{TASK}:segmentation"}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="PLACE", default=list(PLACES), help="such as apartment:3 (all)")
    parser.add_argument("--work", type=Path, metavar="FOLDER", help="keep the batches there, and go on with them")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="as of benchbot batch")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    places = options.only
    with tempfile.TemporaryDirectory() as scratch:
        work = options.work or Path(scratch)
        scores = {name: scored(name, task, places, work / name, options.set) for name, task in MAPPERS.items()}
    omq = {name: {row["environment"]: row["scores"]["OMQ"] for row in of["rows"]} for name, of in scores.items()}
    print(f"{'':12}" + "".join(f"{name:>22}" for name in omq))
    for place in places:
        print(f"{place:12}" + "".join(f"{found.get(place, float('nan')):22.2f}" for found in omq.values()))
    for name, found in scores.items():
        interval = found["intervals"]["OMQ"]
        spread = f"{interval['low']:.2f} to {interval['high']:.2f}" if interval else "unknown"
        print(f"{name}: mean {found['scores']['OMQ']:.3f}, {spread} ({found['statistics']['method']})")
    if options.json:
        options.json.write_text(json.dumps(omq, indent=1) + "\n", encoding="utf-8")
    return 0


def scored(name: str, task: str, places: list[str], folder: Path, settings: list[str]) -> dict[str, Any]:
    """Return the scores of a batch; compute what is missing of it."""
    command = [sys.executable, "-m", "benchbot", "batch", "--task", task, "--robots", ROBOT, "--envs", ",".join(places)]
    command += [
        "--example",
        name,
        "--evaluate-with",
        "omq",
        "--jobs",
        "1",
        "--output-location",
        str(folder),
        "--update",
    ]
    command += [word for setting in settings for word in ("--set", setting)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    found: dict[str, Any] = json.loads((folder / "scores.json").read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    sys.exit(main())
