"""The same solutions in two simulators: scores, ranks, and where the difference comes from.

python -m benchmarks simulators [--envs miniroom:1 house:1 apartment:1] [--wide] [--work FOLDER] [--json FILE]

Three mappers (see `partial_mapper`) follow the trajectory of each environment in the ray tracer and in MuJoCo, with
cameras of 320 x 180 pixels, or with --wide of 960 x 540. `driven` are the scores of these runs. `placed` are those of
robots that are put at the poses of the trajectory, so that only pictures differ; `stops` those of the ray tracer's
pictures from where MuJoCo's robot stopped, so that the rest of MuJoCo's score is pictures. `spread` is the standard
deviation of 4 tries in the ray tracer where each pose is another one within the tolerance of motion, 1 cm and 1 degree.
Below each row stand the objects whose qualities differ the most where robots drove, and what each is worth in OMQ.
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

from benchbot.core.channels import Observations
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, execute
from benchbot.core.platform import PlatformSpec, Scene, Simulation
from benchbot.core.plugin_manager import load
from benchbot.mapping import ObjectMap, describe
from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq.omq import matched
from benchbot_eval_omq.qualities import qualities

TASK = "semantic_slam:passive:ground_truth:segmentation"
CHANNELS = ("image_depth", "image_depth_info", "image_segment", "poses")
SOLUTIONS = {"every picture": (), "one of eight": ("--every", "8"), "up to 1.5 m": ("--farthest", "1.5")}
OBJECTS = 3
TRIES, TOLERANCE_M, TOLERANCE_RAD, DEPTH_M = 4, 0.01, np.radians(1.0), 1e-3
SIMULATORS = {"ray tracer": "carter{}", "MuJoCo": "carter{}_mujoco"}


@dataclass(frozen=True)
class Swing:
    """A true object: its quality in both simulators, and what the difference is worth in OMQ."""

    name: str
    qualities: tuple[float, float]
    omq: float


@dataclass(frozen=True)
class Row:
    """The scores of a solution in both simulators, in the order of `SIMULATORS`."""

    solution: str
    driven: tuple[float, float]
    placed: tuple[float, float]
    at_stops: float
    spread: float
    swings: list[Swing]


@dataclass(frozen=True)
class Pixels:
    """The shares of pixels that differ between both simulators from the same poses."""

    of_another_class: float
    depth_off_by_1_mm: float


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--envs", nargs="+", default=["miniroom:1", "house:1", "apartment:1"])
    parser.add_argument("--wide", action="store_true")
    parser.add_argument("--work", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    work = options.work or Path(tempfile.mkdtemp())
    robots = [robot.format("" if options.wide else "_lowres") for robot in SIMULATORS.values()]
    found: dict[str, tuple[list[Row], Pixels]] = {}
    for environment in options.envs:
        found[environment] = _measured(work, robots, environment)
        _print(environment, *found[environment])
    for kind in ("driven", "placed"):
        scores = [[getattr(row, kind) for row in rows] for rows, _ in found.values()]
        taus = [f"{kendalltau(*zip(*pairs, strict=True)).statistic:.2f}" for pairs in scores]
        everything = kendalltau(*zip(*(pair for pairs in scores for pair in pairs), strict=True)).statistic
        print(f"Kendall's tau, {kind}: {', '.join(taus)} in each environment, {everything:.2f} of all scores")
    if options.json:
        rows = {name: [asdict(row) for row in rows] + [asdict(pixels)] for name, (rows, pixels) in found.items()}
        options.json.write_text(json.dumps(rows, indent=1))
    return 0


def _measured(work: Path, robots: Sequence[str], environment: str) -> tuple[list[Row], Pixels]:
    driven = {
        name: [_submitted(work, robot, environment, name, arguments) for robot in robots]
        for name, arguments in SOLUTIONS.items()
    }
    stages = [_Stage(work, robot, environment) for robot in robots]
    at_stops = stages[0].observe(stages[1].stops())
    seen = [stage.observe(stage.poses) for stage in stages]
    random = np.random.default_rng(0)
    elsewhere = [stages[0].observe([_nearby(pose, random) for pose in stages[0].poses]) for _ in range(TRIES)]
    rows = []
    for name, results in driven.items():
        placed = [_mapped(results[0], name, frames) for frames in seen]
        tries = [_omq(stages[0].truth, _mapped(results[0], name, frames)) for frames in elsewhere]
        stopped = _omq(stages[0].truth, _mapped(results[0], name, at_stops))
        scores = [_omq(stages[0].truth, result) for result in results]
        here, there = (_omq(stages[0].truth, result) for result in placed)
        swings = _swings(stages[0].truth, results)
        rows.append(Row(name, (scores[0], scores[1]), (here, there), stopped, float(np.std(tries, ddof=1)), swings))
    return rows, _differences(*seen)


class _Stage:
    """A simulator with its robot in an environment, which is placed and not driven."""

    def __init__(self, work: Path, robot: str, environment: str) -> None:
        catalog = Catalog(load())
        declared = catalog.get("environments", environment)
        scene = Scene(declared.data, declared.path.parent)
        self._robot = data = catalog.get("robots", robot).data
        create = load().pool("simulators")[data["type"]].value.create
        self._platform = cast(Simulation, create(PlatformSpec(data, "ground_truth", work / "cache")))
        self._platform.load(scene, 0)
        # The last move ends the run, before its picture is mapped.
        self.poses = (scene.start_pose, *scene.trajectory[:-1])
        truth = declared.path.parents[1] / "ground_truths" / f"{environment.replace(':', '_')}.json"
        self.truth = json.loads(truth.read_text())

    def stops(self) -> list[Pose]:
        """Drive along the trajectory; return where the robot was when it took its pictures."""
        config = MotionConfig.from_robot(self._robot, "ground_truth")
        stops = [self._platform.pose()]
        for goal in self.poses[1:]:
            execute(self._platform, "move_next", {}, goal, config)
            stops.append(self._platform.pose())
        return stops

    def observe(self, poses: Sequence[Pose]) -> list[Observations]:
        """Return what the robot sees from each pose."""
        frames = []
        for pose in poses:
            self._platform.place(pose)
            frames.append(self._platform.observe(CHANNELS))
        return frames


def _nearby(pose: Pose, random: np.random.Generator) -> Pose:
    x, y, z = pose.translation_xyz
    off_m, bearing_rad = TOLERANCE_M * np.sqrt(random.random()), 2 * np.pi * random.random()
    yaw_rad = pose.yaw_rad + TOLERANCE_RAD * random.uniform(-1, 1)
    return Pose.planar(x + off_m * np.cos(bearing_rad), y + off_m * np.sin(bearing_rad), yaw_rad, z)


def _submitted(work: Path, robot: str, environment: str, name: str, arguments: Sequence[str]) -> dict[str, Any]:
    result = work / f"{robot}-{environment.replace(':', '-')}-{name.replace(' ', '-')}.json"
    if not result.exists():
        solution = shlex.join([sys.executable, "-m", "benchmarks.partial_mapper", *arguments])
        command = ["submit", "--task", TASK, "--robot", robot, "--env", environment, "--native", solution]
        command += ["--results-location", str(result)]
        subprocess.run([sys.executable, "-m", "benchbot", *command], check=True, capture_output=True)
    return cast(dict[str, Any], json.loads(result.read_text()))


def _mapped(like: Mapping[str, Any], solution: str, frames: Sequence[Observations]) -> dict[str, Any]:
    """Return a result as a solution would have written it of these pictures."""
    arguments = dict(zip(SOLUTIONS[solution][::2], SOLUTIONS[solution][1::2], strict=True))
    every, farthest_m = int(arguments.get("--every", 1)), float(arguments.get("--farthest", np.inf))
    objects = ObjectMap()
    for frame in frames[::every]:
        depth_m = frame["image_depth"]
        objects.add({**frame, "image_depth": np.where(depth_m <= farthest_m, depth_m, np.float32(np.inf))})
    results = like["results"]
    return {
        **like,
        "results": {**results, "objects": [describe(item, results["class_list"]) for item in objects.objects]},
    }


def _omq(truth: Mapping[str, Any], result: Mapping[str, Any]) -> float:
    return float(load().pool("evaluators")["omq"].value.evaluate(result, [truth])["OMQ"])


def _swings(truth: Mapping[str, Any], results: Sequence[Mapping[str, Any]]) -> list[Swing]:
    """Return the objects whose qualities differ the most; without false positives, OMQ is the mean of qualities."""
    tables = [qualities(cast(Result, result), [cast(GroundTruth, truth)]) for result in results]
    objects = tables[0].true_objects
    found = np.zeros((2, len(objects)))
    for values, comparison in zip(found, map(matched, tables), strict=True):
        values[comparison.pairs[:, 0]] = comparison.pairwise
    worth = (found[1] - found[0]) / len(objects)
    names = [f"{item['class']} of {' x '.join(f'{100 * side:.0f}' for side in item['extent'])} cm" for item in objects]
    largest = np.argsort(-np.abs(worth))[:OBJECTS]
    return [Swing(names[i], (float(found[0, i]), float(found[1, i])), float(worth[i])) for i in largest]


def _differences(one: Sequence[Observations], other: Sequence[Observations]) -> Pixels:
    classes, depths = [], []
    for here, there in zip(one, other, strict=True):
        segments = (seen["image_segment"]["class_segment_img"] for seen in (here, there))
        classes.append(np.mean(np.not_equal(*segments)))
        depths.append(np.mean(~np.isclose(here["image_depth"], there["image_depth"], rtol=0, atol=DEPTH_M)))
    return Pixels(float(np.mean(classes)), float(np.mean(depths)))


def _print(environment: str, rows: Sequence[Row], pixels: Pixels) -> None:
    print(f"\n{environment:16}{'driven':>9}{'':9}{'placed':>9}{'':9}{'stops':>9}{'spread':>9}", flush=True)
    print(f"{'':16}" + 2 * "".join(f"{name:>11}" for name in SIMULATORS))
    for row in rows:
        values = (*row.driven, *row.placed)
        print(
            f"  {row.solution:14}"
            + "".join(f"{value:11.4f}" for value in values)
            + f"{row.at_stops:9.4f}{row.spread:9.4f}"
        )
        for swing in row.swings:
            here, there = swing.qualities
            print(f"    {swing.omq:+.4f}  {here:.2f} · {there:.2f}  {swing.name}")
    print(
        f"  pixels of another class {pixels.of_another_class:.3%}, of depth {pixels.depth_off_by_1_mm:.3%}", flush=True
    )


if __name__ == "__main__":
    sys.exit(main())
