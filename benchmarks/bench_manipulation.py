"""How often the shipped solution tidies up, and how fast the mobile manipulator is simulated.

python -m benchmarks manipulation [--quick] [--robot NAME] [--count N] [--json FILE] [--picture FILE]

Every episode of `tidyroom:1` (with --quick every sixth) is run in this process, with true poses and perfect
segmentation; the interval of success is Wilson's, at 95 %. Speeds are simulated time by processor time on one core,
without pictures: 2 s of each kind of motion, five times, the best. With --picture only a picture of the robot is made.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import numpy as np
from PIL import Image
from scipy.stats import binomtest

from benchbot.api import ActionResult, Observations
from benchbot.core import results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.documents import Result
from benchbot.core.geometry import Pose
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig, execute
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.resources import cache_dir
from benchbot.core.selection import select
from benchbot.core.session import Session
from benchbot.simulation import Camera
from benchbot_sim_mujoco.simulator import MujocoSimulator
from benchbot_task_manipulation.evaluator import combine, evaluate
from benchbot_task_manipulation.examples.fetch_and_place import FetchAndPlace

TASK, ENVIRONMENT = "manipulation:tidy_up:ground_truth:segmentation", "tidyroom:1"
LIST = Path(str(files("benchbot_task_manipulation"))) / "episodes" / "tidyroom_1.json"
QUICK_EVERY = 6
REPETITIONS, HELD_S = 5, 2.0
PICTURED = 2


@dataclass(frozen=True)
class Speed:
    """How many times faster than real time a kind of motion is simulated, by processor time."""

    what: str
    times_real_time: float


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--robot", default="carter_arm_lowres")
    parser.add_argument("--count", type=int)
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--picture", type=Path, metavar="FILE")
    options = parser.parse_args()
    if options.picture:
        take_picture(options.picture)
        return 0
    listed = json.loads(LIST.read_text("utf-8"))["episodes"]
    numbers = list(range(0, len(listed), QUICK_EVERY if options.quick else 1))[: options.count]
    catalog = Catalog(load())
    declared = catalog.get("robots", options.robot).data
    simulator = MujocoSimulator(PlatformSpec(declared, "ground_truth", cache_dir()))
    started_s = time.process_time()
    scores = {number: episode(catalog, simulator, options.robot, number) for number in numbers}
    used_s = time.process_time() - started_s
    for number, row in scores.items():
        goal = listed[number]["goal"]
        told = ", ".join(f"{name} {value:.3g}" for name, value in row.items())
        print(f"{number:3} {goal['fetch']['class']} to {goal['place']['class']}: {told}")
    successes = round(sum(row["success"] for row in scores.values()))
    interval = binomtest(successes, len(scores)).proportion_ci(method="wilson")
    print(f"\nsuccess: {successes} of {len(scores)}, {interval.low:.3f} to {interval.high:.3f} (Wilson, 95 %)")
    means = combine([dict(row) for row in scores.values()])
    print("means: " + ", ".join(f"{name} {value:.3g}" for name, value in means.items()))
    print(f"processor time: {used_s / len(scores):.1f} s an episode, pictures included")
    speeds = measured(simulator, catalog)
    for speed in speeds:
        print(f"{speed.what:34} {speed.times_real_time:6.1f} x real time")
    if options.json:
        document = {
            "robot": options.robot,
            "success": [successes, len(scores), interval.low, interval.high],
            "means": means,
            "episodes": scores,
            "speeds": [asdict(speed) for speed in speeds],
        }
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


def episode(catalog: Catalog, simulator: MujocoSimulator, robot: str, number: int) -> Mapping[str, float]:
    """Run one episode in this process, and score it."""
    selection = select(catalog, RunRequest(TASK, robot, ENVIRONMENT, episode=number))
    scenes = [Scene(declaration.data, declaration.path.parent) for declaration in selection.environments]
    motion = MotionConfig.from_robot(selection.robot.data, selection.localisation)
    session = Session(selection, lambda: InProcessHost(simulator, scenes, motion))
    agent = FetchAndPlace(selection.robot.data)
    step = session.reset()
    while not agent.is_done(ActionResult[step.result.name]):
        action, arguments = agent.pick_action(cast(Observations, step.observations), session.actions)
        step = session.step(action, arguments)
        agent.last_outcome = None if step.outcome is None else step.outcome.value
    document = results.finish({"results": {}}, session)
    return evaluate(cast(Result, document), [])


def measured(simulator: MujocoSimulator, catalog: Catalog) -> list[Speed]:
    """Return how fast standing, driving, moving the arm, and driving with an object are simulated."""
    declared = catalog.get("environments", ENVIRONMENT)
    simulator.load(Scene(declared.data, declared.path.parent), 0)
    motion = MotionConfig.from_robot(simulator.spec.robot, "ground_truth")
    home = [float(angle) for angle in np.radians(simulator.spec.robot["arm"]["home_deg"])]
    bent = [home[0] + 0.8, home[1] + 0.5, home[2] - 0.6, 0.5, *home[4:]]
    ticks = round(HELD_S / simulator.control_period_s)

    def drive(linear_mps: float, angular_radps: float) -> None:
        for sign in (1, -1):
            for _ in range(ticks // 2):
                simulator.drive(sign * linear_mps, angular_radps, simulator.control_period_s)

    def arm() -> None:
        for joints in (bent, home):
            execute(simulator, "move_joints", {"positions": joints}, None, motion)

    kinds: dict[str, Callable[[], Any]] = {
        "standing": lambda: drive(0.0, 0.0),
        "driving and turning": lambda: drive(0.2, 0.5),
        "moving all joints of the arm": arm,
    }
    return [
        Speed(what, max(_times_real_time(simulator, act) for _ in range(REPETITIONS))) for what, act in kinds.items()
    ]


def take_picture(path: Path) -> None:
    """Write a picture of the robot that has lifted an object, seen from aside."""
    catalog = Catalog(load())
    declared = catalog.get("environments", ENVIRONMENT)
    episode = json.loads(LIST.read_text("utf-8"))["episodes"][PICTURED]
    placed = {**declared.data, "start_pose": episode["start_pose"], "objects": episode["objects"]}
    simulator = MujocoSimulator(PlatformSpec(catalog.get("robots", "carter_arm").data, "ground_truth", cache_dir()))
    simulator.load(Scene(placed, declared.path.parent), 0)
    motion = MotionConfig.from_robot(simulator.spec.robot, "ground_truth")
    witnessed = simulator.witnessed()
    assert witnessed is not None
    x, y, _ = witnessed.objects[episode["goal"]["fetch"]["name"]].translation_xyz
    simulator.place(Pose.planar(x - 0.62, y, 0.0))
    heights_m = (0.94, 0.785)
    for height_m, width_m in zip((*heights_m, heights_m[0]), (0.11, 0.11, 0.0), strict=True):
        execute(simulator, "move_gripper", {"width": width_m}, None, motion)
        execute(simulator, "move_end_effector", {"pose": [0.62, 0.0, height_m, 1.0, 0.0, 0.0, 0.0]}, None, motion)
    eye, target = np.array([x - 1.57, y + 1.45, 1.45]), np.array([x - 0.32, y - 0.05, 0.66])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(forward, [0.0, 0.0, 1.0]))
    pose = np.eye(4)
    pose[:3] = np.column_stack([right, np.cross(forward, right), forward, eye])
    camera = Camera("eye", 900, 520, 640.0, 640.0, 450.0, 240.0, (0.05, 20.0))
    (frame,) = simulator.world.render(camera, [Pose.from_matrix(pose)], rgb=True)
    Image.fromarray(frame.rgb).resize((600, 347), Image.Resampling.LANCZOS).save(path, quality=70, optimize=True)


def _times_real_time(simulator: MujocoSimulator, act: Callable[[], Any]) -> float:
    simulated_s, used_s = simulator.clock(), time.process_time()
    act()
    return (simulator.clock() - simulated_s) / (time.process_time() - used_s)


if __name__ == "__main__":
    sys.exit(main())
