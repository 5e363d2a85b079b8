"""Places to practise driving in: `python -m benchbot_baselines.practice --seeds 2000-2047 --output PLACES`.

Each is an environment of the generator, with episodes from start to goal and the floor plan that they are evaluated
by, and for training alone how long the way to each goal is from anywhere. `benchbot … --addons PLACES` takes the
environments as any other.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchbot.cli.kit import console
from benchbot.plugin import BenchbotError, Catalog, Scene, load_plugins, write_atomically
from benchbot_baselines.places import KINDS
from benchbot_baselines.seeds import FIRST_SEED

ROBOT = "carter_lowres"
MOST_ROOMS = 6
COURSE = "course.npz"
EVERY = 2
"""Distances are kept at every second node of a floor plan, 5 cm apart."""


@dataclass(frozen=True)
class Course:
    """An environment, and the metres from nodes (E, I, J) to the goals of its episodes, along free floor.

    Node [i, j] is at `origin_xy` + `resolution_m` * (i, j) in the map frame.
    """

    environment: str
    distances_m: NDArray[np.float16]
    origin_xy: tuple[float, float]
    resolution_m: float


def courses(folder: Path) -> list[Course]:
    """Return the places in a folder; raises BenchbotError when there are none."""
    found = []
    for path in sorted(folder.glob(f"*/{COURSE}")):
        with np.load(path) as file:
            x, y = file["origin_xy"].tolist()
            found.append(Course(f"{path.parent.name}:1", file["distances_m"], (x, y), float(file["resolution_m"])))
    if not found:
        raise BenchbotError(
            f"There is no place to practise in {folder}.",
            f"No folder in it has a {COURSE}.",
            "Make some: python -m benchbot_baselines.practice --seeds 2000-2047 --output PLACES",
        )
    return found


def make(seed: int, folder: Path, episodes: int) -> str:
    """Make the place of a seed, unless it is there; return what became of it."""
    from benchbot_task_navigation import make_episodes
    from benchbot_task_navigation.floor_plan import FloorPlan
    from benchbot_task_navigation.generate import Place, point_goals
    from benchbot_task_navigation.ways import Ways

    random = np.random.default_rng([seed, 3])
    name = f"practice{seed}"
    environment = f"{name}:1"
    if (folder / name / COURSE).is_file():
        return f"{environment} is there"
    kind, rooms = KINDS[int(random.integers(len(KINDS)))], int(random.integers(2, MOST_ROOMS + 1))
    words = ["generate-environment", "--kind", kind, "--rooms", str(rooms), "--seed", str(seed), "--name", name]
    shutil.rmtree(folder / name, ignore_errors=True)
    (folder / f"{name}.origin.json").unlink(missing_ok=True)
    command = [sys.executable, "-m", "benchbot", *words, "--robot", ROBOT]
    made = subprocess.run(command, check=False, cwd=folder, capture_output=True, text=True)
    if made.returncode != 0:
        raise BenchbotError(
            f"The place of the seed {seed} was not made.", made.stderr.strip(), "Mend that, or leave the seed out."
        )
    os.environ["BENCHBOT_ADDONS"] = str(folder / name)
    catalog = Catalog(load_plugins())
    declared, robot = catalog.get("environments", environment), catalog.get("robots", ROBOT).data
    scene = Scene(declared.data, declared.path.parent)
    plan = make_episodes.floor_plan(scene, make_episodes.geometry_of(scene), robot)
    radius_m = robot["footprint"]["radius_m"]
    try:
        listed = point_goals(Place(environment, plan, scene.start_pose.translation_xyz, radius_m), seed, episodes)
    except BenchbotError as error:  # a place may be too small to lose one's way in
        return f"{environment} is left out: {error.title}"
    coarse = FloorPlan(plan.origin_xy, plan.resolution_m * EVERY, plan.clearance_m[::EVERY, ::EVERY])
    ways = Ways(coarse, radius_m, reach=2)
    goals = [tuple(episode["goal"]["position"][:2]) for episode in listed["episodes"]]
    distances_m = np.stack([ways.distances_m(goal) for goal in goals]).astype(np.float16)
    (folder / name / "episodes").mkdir(exist_ok=True)
    write_atomically(folder / name / "episodes" / f"{name}_1.json", json.dumps(listed).encode())
    truth = make_episodes.ground_truth(catalog, declared, plan)
    write_atomically(folder / name / "ground_truths" / f"floor_plan_{name}_1.json", json.dumps(truth).encode())
    np.savez(
        folder / name / COURSE,
        distances_m=distances_m,
        origin_xy=np.array(coarse.origin_xy),
        resolution_m=coarse.resolution_m,
    )
    return f"{environment} is made"


def _seeds(text: str) -> range:
    first, _, last = text.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    if seeds.start < FIRST_SEED:
        raise BenchbotError(
            f"The place of the seed {seeds.start} is not to be trained in.",
            f"Seeds below {FIRST_SEED} may be of places that solutions are scored in.",
            f"Choose others: --seeds {FIRST_SEED + 1000}-{FIRST_SEED + 1047}",
        )
    return seeds


def main(words: Sequence[str] | None = None) -> None:
    """Make places, several at once."""
    parser = argparse.ArgumentParser(
        prog="python -m benchbot_baselines.practice", description="Make places to practise driving in."
    )
    parser.add_argument("--seeds", default="2000-2047", metavar="FIRST-LAST", help=f"from {FIRST_SEED}, as in training")
    parser.add_argument("--episodes", type=int, default=60, metavar="N", help="of each place")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--output", type=Path, required=True, metavar="FOLDER")
    given = parser.parse_args(words)
    try:
        seeds = _seeds(given.seeds)
        given.output.mkdir(parents=True, exist_ok=True)
        # A process keeps to the add-ons that it found first, so that each place has one of its own.
        with ProcessPoolExecutor(given.processes, get_context("spawn"), max_tasks_per_child=1) as pool:
            for told in pool.map(partial(make, folder=given.output.absolute(), episodes=given.episodes), seeds):
                console.note(told)
    except BenchbotError as error:
        console.error(error)
        raise SystemExit(error.exit_code) from None


if __name__ == "__main__":
    main()
