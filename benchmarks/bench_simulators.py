"""The same solutions in two simulators: scores, ranks, and where the difference comes from.

python -m benchmarks simulators [--envs miniroom:1 house:1 apartment:1] [--wide] [--work FOLDER] [--json FILE]

Three mappers (see `partial_mapper`) follow the trajectory of each environment in the ray tracer and in MuJoCo, with
cameras of 320 x 180 pixels, or with --wide of 960 x 540. Kendall's tau of their ranks, over all environments; then what
is left of the full mapper's difference where both simulators observe from the very same poses: so much of it is
pictures, and the rest is where the robots stopped.
"""

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from scipy.stats import kendalltau

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import PlatformSpec, Scene, Simulation
from benchbot.core.plugin_manager import load
from benchbot_task_semslam.mapping.objects import ObjectMap, describe

TASK = "semantic_slam:passive:ground_truth:segmentation"
CHANNELS = ("image_depth", "image_depth_info", "image_segment", "poses")
SOLUTIONS = {"every picture": (), "one of eight": ("--every", "8"), "up to 1.5 m": ("--farthest", "1.5")}
SIMULATORS = {"ray tracer": "carter{}", "MuJoCo": "carter{}_mujoco"}


@dataclass(frozen=True)
class SamePoses:
    """What both simulators see from one set of poses: scores, and the shares of pixels that differ."""

    omq: dict[str, float]
    classes_differ: float
    depth_differs: float


def main() -> int:
    """Measure and print; return 1 when an episode fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--envs", nargs="+", default=["miniroom:1", "house:1", "apartment:1"])
    parser.add_argument("--wide", action="store_true")
    parser.add_argument("--work", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    work = options.work or Path(tempfile.mkdtemp())
    robots = {name: robot.format("" if options.wide else "_lowres") for name, robot in SIMULATORS.items()}
    scores: dict[str, dict[str, dict[str, float]]] = {}
    same: dict[str, SamePoses] = {}
    for environment in options.envs:
        scores[environment] = {
            simulator: {
                name: _submitted(work, robot, environment, name, arguments) for name, arguments in SOLUTIONS.items()
            }
            for simulator, robot in robots.items()
        }
        same[environment] = _same_poses(work, robots, environment)
        _print(environment, scores[environment], same[environment])
    pairs = [[list(by[name].values()) for by in scores.values()] for name in robots]
    taus = [kendalltau(one, other).statistic for one, other in zip(*pairs, strict=True)]
    print(f"Kendall's tau of the solutions' ranks: {', '.join(f'{tau:.2f}' for tau in taus)}")
    print(f"of all {sum(map(len, pairs[0]))} scores: {kendalltau(*map(np.ravel, pairs)).statistic:.2f}")
    if options.json:
        details = {environment: asdict(found) for environment, found in same.items()}
        options.json.write_text(json.dumps({"scores": scores, "same_poses": details, "tau": taus}, indent=1))
    return 0


def _submitted(work: Path, robot: str, environment: str, name: str, arguments: Sequence[str]) -> float:
    result = work / f"{robot}-{environment.replace(':', '-')}-{name.replace(' ', '-')}.json"
    if not result.exists():
        solution = shlex.join([sys.executable, "-m", "benchmarks.partial_mapper", *arguments])
        command = ["submit", "--task", TASK, "--robot", robot, "--env", environment, "--native", solution]
        command += ["--results-location", str(result)]
        subprocess.run([sys.executable, "-m", "benchbot", *command], check=True, capture_output=True)
    return _omq(result)


def _omq(result: Path) -> float:
    scores = result.with_suffix(".scores")
    command = ["eval", "--method", "omq", "--output-location", str(scores), str(result)]
    subprocess.run([sys.executable, "-m", "benchbot", *command], check=True, capture_output=True)
    return float(json.loads(scores.read_text())["scores"]["OMQ"])


def _same_poses(work: Path, robots: Mapping[str, str], environment: str) -> SamePoses:
    """Place the robot of each simulator at the poses of the trajectory, without driving, and map what it sees."""
    catalog = Catalog(load())
    declared = catalog.get("environments", environment)
    scene = Scene(declared.data, declared.path.parent)
    seen: dict[str, list[dict[str, Any]]] = {}
    omq: dict[str, float] = {}
    for simulator, name in robots.items():
        robot = catalog.get("robots", name)
        create = load().pool("simulators")[robot.data["type"]].value.create
        platform = cast(Simulation, create(PlatformSpec(robot.data, "ground_truth", work / "cache")))
        platform.load(scene, 0)
        objects, seen[simulator] = ObjectMap(), []
        for pose in (scene.start_pose, *scene.trajectory):
            platform.place(pose)
            observations = platform.observe(CHANNELS)
            objects.add(observations)
            seen[simulator].append(dict(observations))
        platform.close()
        driven = json.loads((work / f"{name}-{environment.replace(':', '-')}-every-picture.json").read_text())
        labels = driven["results"]["class_list"]
        driven["results"]["objects"] = [describe(item, labels) for item in objects.objects]
        placed = work / f"{name}-{environment.replace(':', '-')}-placed.json"
        placed.write_text(json.dumps(driven))
        omq[simulator] = _omq(placed)
    return SamePoses(omq, *_differences(*seen.values()))


def _differences(one: Sequence[Mapping[str, Any]], other: Sequence[Mapping[str, Any]]) -> tuple[float, float]:
    classes, depths = [], []
    for here, there in zip(one, other, strict=True):
        segments = (seen["image_segment"]["class_segment_img"] for seen in (here, there))
        classes.append(np.mean(np.not_equal(*segments)))
        depths.append(np.mean(np.abs(here["image_depth"] - there["image_depth"]) > 1e-3))
    return float(np.mean(classes)), float(np.mean(depths))


def _print(environment: str, scores: Mapping[str, Mapping[str, float]], same: SamePoses) -> None:
    print(f"\n{environment:20}" + "".join(f"{name:>16}" for name in scores))
    for solution in SOLUTIONS:
        print(f"  {solution:18}" + "".join(f"{by[solution]:16.4f}" for by in scores.values()))
    print(f"  {'from the same poses':18}" + "".join(f"{value:15.4f} " for value in same.omq.values()))
    print(f"  pixels of another class: {same.classes_differ:.4%}, of depth off by 1 mm: {same.depth_differs:.4%}")


if __name__ == "__main__":
    sys.exit(main())
