"""Short runs in places of the set: a robot with a laser only, which needs no light worked out, looks about."""

from pathlib import Path

import yaml

import benchbot_sim_taichi

LOOK = """\
name: look:passive
description: Follow the trajectory with a laser, and map what is there.
actions: [move_next]
observations: [laser, poses]
localisation: ground_truth
results_format: object_map
scene_count: 1
"""
SOLUTION = """\
import json
from benchbot.api import BenchBot

benchbot = BenchBot()
for _ in range(3):
    benchbot.step("move_next")
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""
WHAT = ("--addons", "addons", "--task", "look:passive", "--robot", "carter_blind")


def prepare(folder: Path) -> Path:
    """Write the robot and the task into `addons` and the solution into `solution` of a folder; return that."""
    robots, tasks, solution = (folder / name for name in ("addons/robots", "addons/tasks", "solution"))
    for path in (robots, tasks, solution):
        path.mkdir(parents=True)
    carter = Path(benchbot_sim_taichi.__file__).parent / "robots" / "carter_lowres.yaml"
    robot = yaml.safe_load(carter.read_text("utf-8"))
    shown = {name: how for name, how in robot["connections"].items() if not name.startswith("image")}
    blind = {**robot, "name": "carter_blind", "connections": shown}
    (robots / "carter_blind.yaml").write_text(yaml.safe_dump(blind), "utf-8")
    (tasks / "look.yaml").write_text(LOOK, "utf-8")
    (solution / "look.py").write_text(SOLUTION, "utf-8")
    return folder
