"""A folder of BenchBot v2's add-ons as its documentation describes them: every kind, in the world of the sample."""

import json
from pathlib import Path
from typing import Any

import yaml

SAMPLE = Path(__file__).parent / "sample_plugin" / "benchbot_sample"

TASK = """\
name: "count:passive:ground_truth"
description: |
  Say how many things there are, along a given trajectory.
type: sim_unreal
actions:
  - move_next
observations:
  - image_rgb
  - laser
  - poses
localisation: ground_truth
results_format: counts
scene_count: 1
"""

FORMAT = """\
name: counts
description: How many things of each class there are.
functions:
  create: "counts.create"
  create_object: "counts.create_object"
  validate: "counts.validate"
"""

FORMAT_CODE = """\
import kinds


def create(class_list=None):
    return {"counts": {}, "class_list": class_list or kinds.KINDS}


def create_object():
    return dict.fromkeys(kinds.KINDS, 0)


def validate(instance):
    for kind, number in instance["counts"].items():
        assert kind in instance["class_list"], "'%s' is not in class_list" % kind
        assert number >= 0
"""

KINDS_CODE = 'KINDS = ["bottle", "chair"]\n'

TRUTH_FORMAT = """\
name: counts_ground_truth
functions:
  create: "counts.create"
"""

METHOD = """\
name: count_error
description: How far the counts are off.
valid_result_formats:
  - counts
valid_ground_truth_formats:
  - counts_ground_truth
functions:
  evaluate: "count_error.evaluate"
  combine: "count_error.combine"
"""

METHOD_CODE = """\
import kinds


def evaluate(results, ground_truths):
    truth = ground_truths[0]["ground_truth"]["counts"]
    found = results["results"].pop("counts")
    right = sum(found.get(kind, 0) == truth.get(kind, 0) for kind in kinds.of(truth))
    return {
        "task_details": results["task_details"],
        "environment_details": results["environment_details"],
        "scores": {"exact": right / len(truth), "classes": len(truth)},
    }


def combine(scores):
    scores = [one["scores"] if one else {"exact": 0, "classes": 0} for one in scores]
    return {
        "task_details": {},
        "environment_details": [],
        "scores": {name: sum(one[name] for one in scores) / len(scores) for name in ("exact", "classes")},
    }
"""

METHOD_KINDS_CODE = "def of(truth):\n    return sorted(truth)\n"

EXAMPLE = """\
name: count_bottles
description: Follows the trajectory and says that there is one bottle.
native_command: python3 .count_bottles/count_bottles one
container_directory: .count_bottles
"""

SOLUTION = """\
import json
import sys

from benchbot_api import ActionResult, Agent, BenchBot


class Counter(Agent):
    def is_done(self, action_result):
        return action_result != ActionResult.SUCCESS

    def pick_action(self, observations, action_list):
        return action_list[0], {}

    def save_result(self, filename, empty_results, results_format_fns):
        assert results_format_fns["create_object"]() == {"bottle": 0, "chair": 0}
        empty_results["results"]["counts"] = {"bottle": 1 if sys.argv[1:] == ["one"] else -1}
        results_format_fns["validate"](empty_results["results"])
        with open(filename, "w") as file:
            json.dump(empty_results, file)


BenchBot(agent=Counter()).run()
"""

ENVIRONMENT = """\
name: hall
variant: 1
type: sim_sample
map_path: .maps/hall_1.yaml
start_pose: [0.7, 0, 0, 0, -2, 0, 0]
trajectory_poses:
  - [0.7, 0, 0, 0, -1, 0, 0]
robots:
  - sample_robot
object_labels: [bottle, chair, person]
"""

OMNI_ENVIRONMENT = ENVIRONMENT.replace("variant: 1", "variant: 2").replace("sim_sample", "sim_omni").split("robots:")[0]

ROBOT = """\
name: carter_of_old
type: sim_omni
address: "benchbot_robot:10000"
global_frame: map
robot_frame: base_link
poses: [base_link, initial_pose, camera_left, lidar]
persistent_cmds: ["touch executed"]
persistent_status: "touch executed"
run_cmd: "touch executed"
stop_cmd: "touch executed"
connections:
  image_rgb: {connection: ros_to_api, ros_topic: /rgb, ros_type: sensor_msgs/Image, callback_robot: m.f}
  laser: {connection: ros_to_api, ros_topic: /scan, ros_type: sensor_msgs/LaserScan}
  poses: {connection: ros_to_api}
  move_next: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/Twist}
"""

BATCH = "name: halls\nenvironments:\n  - hall:1\n"


def make(root: Path) -> Path:
    """Write the add-ons into a folder, as v2 lays them out: `user/repository/kind`."""
    truth = {
        "environment": yaml.safe_load(ENVIRONMENT),
        "format": yaml.safe_load(TRUTH_FORMAT),
        "ground_truth": {"counts": {"bottle": 1, "chair": 2}, "class_list": ["bottle", "chair"]},
    }
    files: dict[str, Any] = {
        "me/tasks_count/tasks/count.yaml": TASK,
        "me/formats_count/formats/counts.yaml": FORMAT,
        "me/formats_count/formats/counts_ground_truth.yml": TRUTH_FORMAT,
        "me/formats_count/formats/counts.py": FORMAT_CODE,
        "me/formats_count/formats/kinds.py": KINDS_CODE,
        "me/eval_count/.dependencies": "me/formats_count\n",
        "me/eval_count/evaluation_methods/count_error.yaml": METHOD,
        "me/eval_count/evaluation_methods/count_error.py": METHOD_CODE,
        "me/eval_count/evaluation_methods/kinds.py": METHOD_KINDS_CODE,
        "me/examples/examples/count_bottles.yaml": EXAMPLE,
        "me/examples/examples/.count_bottles/count_bottles": SOLUTION,
        "me/examples/examples/.count_bottles/tasks/not_a_task.yaml": "name: [",
        "me/envs/environments/hall_1.yaml": ENVIRONMENT,
        "me/envs/environments/hall_2.yaml": OMNI_ENVIRONMENT,
        "me/envs/environments/.maps/hall_1.yaml": (SAMPLE / "maps" / "arena_1.yaml").read_text(),
        "me/robots/robots/carter_of_old.yaml": ROBOT,
        "me/truths/ground_truths/hall_1.json": json.dumps(truth),
        "me/batches/batches/halls.yaml": BATCH,
    }
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root
