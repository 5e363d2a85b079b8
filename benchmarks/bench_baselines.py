"""The moving baselines in every environment of BEAR: metres driven and floor seen, and the least that each must reach.

python -m benchmarks baselines [PLACE …] [--seeds N] [--json FILE]

The examples `wander` (100 actions) and `dead_reckoning` (40) are a `benchbot.mapping.Roamer` each: it drives
carter_lowres here without server and pictures, as in `exploration:active:ground_truth:laser` and
`trajectory:active:dead_reckoning:laser`. A place in which one reaches less than its least fails the benchmark.
"""

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchbot.core import plugin_manager, resources
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.progress import ActionResult
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot.core.session import Session
from benchbot.evaluation.ground_truths import GroundTruths
from benchbot.mapping import Roamer
from benchbot_eval_exploration.coverage import covered
from benchbot_task_navigation.floor_plan import FloorPlan

NAMES = ("apartment", "company", "house", "miniroom", "office")
PLACES = tuple(f"{name}:{number}" for name in NAMES for number in range(1, 6))
ROBOT = "carter_lowres"


@dataclass(frozen=True)
class Baseline:
    """An example, the task that it is run in, its actions, and the least path and share of the floor it must reach."""

    name: str
    task: str
    steps: int
    least_path_m: float
    least_coverage: float


WANDER = Baseline("wander", "exploration:active:ground_truth:laser", 100, 30.0, 0.25)
DEAD_RECKONING = Baseline("dead_reckoning", "trajectory:active:dead_reckoning:laser", 40, 12.0, 0.05)


@dataclass(frozen=True)
class Row:
    """What one run reached."""

    place: str
    baseline: str
    seed: int
    steps: int
    blocked: int
    collided: bool
    path_length_m: float
    coverage: float

    def missed(self, baseline: Baseline) -> bool:
        """Return whether it is less than the least."""
        return self.collided or self.path_length_m < baseline.least_path_m or self.coverage < baseline.least_coverage


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("places", nargs="*", metavar="PLACE", help="such as apartment:3 (all)")
    parser.add_argument("--seeds", type=int, default=1, metavar="N")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    print(f"{'place':12} {'baseline':15} {'seed':>4} {'path m':>7} {'seen':>5} {'steps':>5} {'blocked':>7}")
    rows: list[Row] = []
    missed: list[Row] = []
    for place in options.places or PLACES:
        for baseline in (WANDER, DEAD_RECKONING):
            for seed in range(options.seeds):
                row = measure(place, baseline, seed)
                rows.append(row)
                missed += [row] if row.missed(baseline) else []
                print(
                    f"{row.place:12} {row.baseline:15} {row.seed:4} {row.path_length_m:7.1f} {row.coverage:5.2f}"
                    f" {row.steps:5} {row.blocked:7}{'  too little' if row.missed(baseline) else ''}",
                    flush=True,
                )
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    return 1 if missed else 0


def measure(place: str, baseline: Baseline, seed: int = 0) -> Row:
    """Return what a baseline reaches in a place."""
    catalog = Catalog(plugin_manager.load())
    selection = select(catalog, RunRequest(baseline.task, ROBOT, place, seed=seed))
    robot = selection.robot.data
    spec = PlatformSpec(robot, selection.localisation, resources.cache_dir(), {"device": "cpu"})
    platform = catalog.plugins.record("simulators", robot["type"]).create(spec)
    scenes = [Scene(scene.data, scene.path.parent) for scene in selection.environments]
    host = InProcessHost(platform, scenes, MotionConfig.from_robot(robot, selection.localisation))
    session = Session(selection, lambda: host)
    roamer = Roamer(robot["footprint"]["radius_m"], robot["robot_frame"])
    step, blocked = session.reset(), 0
    for _ in range(baseline.steps):
        if step.result is not ActionResult.SUCCESS:
            break
        step = session.step(*roamer.next_move(step.observations, step.outcome and step.outcome.value))
        blocked += step.outcome == "blocked"
    progress = session.progress
    coverage = seen(catalog, place, session)
    collided = step.result is ActionResult.COLLISION
    session.close()
    return Row(place, baseline.name, seed, progress.steps, blocked, collided, progress.path_length_m, coverage)


def seen(catalog: Catalog, place: str, session: Session) -> float:
    """Return the share of the floor that was seen, as the method `exploration` counts it."""
    truth = GroundTruths.of(catalog, None).find(place, {"floor_plan"})
    way = np.array([row[2:5] for row in session.tracks[0].as_dict("simulation")["rows"]], np.float64)
    found = covered(FloorPlan.from_ground_truth(truth["ground_truth"]), way)
    return 0.0 if found is None else found.seen_share


if __name__ == "__main__":
    sys.exit(main())
