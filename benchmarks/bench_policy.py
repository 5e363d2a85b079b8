"""The policy that drives to a point beside the planner: success and SPL, with intervals, in all 25 environments.

python -m benchmarks policy [--episodes 0..3] [--only PLACE …] [--jobs N] [--work FOLDER] [--json FILE]

Each is a batch of `carter_lowres` with true poses and seed 0; the policy has depth and laser in quick pictures, the
planner the laser. With --work the batches are kept, and what is computed in them already is not computed again.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.bench_baselines import PLACES, ROBOT

TASK = "navigation:point_goal:ground_truth"
SOLUTIONS = {
    "point_goal_policy": [TASK, "--set", "options.quality=fast"],
    "go_to_goal": [f"{TASK}:laser"],
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", default="0..3", help="of each environment")
    parser.add_argument("--only", nargs="+", metavar="PLACE", default=list(PLACES), help="such as apartment:3 (all)")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--work", type=Path, metavar="FOLDER", help="keep the batches there, and go on with them")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the scores to this file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = options.work or Path(scratch)
        found = {name: scored(name, words, options, work / name) for name, words in SOLUTIONS.items()}
    for name, scores in found.items():
        print(name)
        for key in ("success", "SPL", "collisions"):
            interval = scores["intervals"].get(key)
            spread = f"{interval['low']:.3f} to {interval['high']:.3f}" if interval else "unknown"
            print(f"  {key:12}{scores['scores'][key]:.3f} ({spread})")
        for place in dict.fromkeys(each.partition(":")[0] for each in options.only):
            rows = [row["scores"] for row in scores["rows"] if row["environment"].startswith(f"{place}:")]
            means = (sum(row[key] for row in rows) / max(len(rows), 1) for key in ("success", "SPL"))
            print(f"  {place:12}{len(rows):4} episodes, success and SPL " + ", ".join(f"{mean:.2f}" for mean in means))
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


def scored(name: str, words: list[str], options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Return the scores of a batch; compute what is missing of it."""
    command = [sys.executable, "-m", "benchbot", "batch", "--task", *words, "--robots", ROBOT, "--example", name]
    command += ["--envs", ",".join(options.only), "--episodes", options.episodes, "--jobs", str(options.jobs)]
    command += ["--evaluate-with", "navigation", "--output-location", str(folder), "--update"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    found: dict[str, Any] = json.loads((folder / "scores.json").read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    sys.exit(main())
