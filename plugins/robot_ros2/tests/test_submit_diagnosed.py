"""`benchbot submit` on the test robot: it is diagnosed before it moves, and its results say what they rest on."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from plugins.record_mcap.tests.bags import by_rosbags
from plugins.robot_ros2.tests.unicycle import BY_TRUTH, MOUNTS, arm_declaration, declaration, unicycle, until
from tests.plugin_factory import DECLARES, PluginFactory

Document = dict[str, Any]

PLUGIN = "\n".join(DECLARES.format(kind=kind) for kind in ("robots", "environments", "tasks"))
TASK = "name: 'hall:walk'\nactions: [move_distance]\nobservations: [laser, poses]\nlocalisation: ground_truth\n"
HALL = {"name": "hall", "variant": 1, "type": "real", "start_pose": [1, 0, 0, 0, 0, 0, 0], "object_labels": []}
SOLUTION = """
import json, os
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.reset()
benchbot.step("move_distance", distance=0.1)
with open(os.environ["BENCHBOT_RESULT"], "w") as file:
    json.dump(benchbot.empty_results(), file)
"""


class Submission:
    """Submits a short walk on the test robot, as declared, in the hall."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.result = folder / "result.json"

    def __call__(self, *words: str, solution: str = SOLUTION) -> "subprocess.CompletedProcess[str]":
        (self.folder / "solution.py").write_text(solution)
        command = [sys.executable, "-m", "benchbot", "submit", "--native", f"{sys.executable} solution.py"]
        command += ["--task", "hall:walk", "--robot", "unicycle", "--env", "hall:1", "-r", "result.json", *words]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=self.folder)

    @property
    def provenance(self) -> Document:
        """The provenance of the result, which is valid."""
        document = json.loads(self.result.read_text())
        schema.check(document, "result", self.result)
        provenance: Document = document["provenance"]
        return provenance


def declared(**driver: Any) -> Document:
    """Return the test robot with a depth camera, localised by the truth."""
    robot = declaration(localisation=BY_TRUTH, **driver)
    robot["runs_in"] = ["real"]
    for channel, topic, kind in (("image_depth", "/depth", "Image"), ("image_depth_info", "/depth_info", "CameraInfo")):
        robot["connections"][channel] = {
            "connection": "ros_to_api",
            "ros_topic": topic,
            "ros_type": f"sensor_msgs/msg/{kind}",
        }
    return robot


@pytest.fixture
def submit(domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Submission:
    files = {
        "robots/unicycle.yaml": json.dumps(declared()),
        "environments/hall_1.yaml": json.dumps(HALL),
        "tasks/walk.yaml": TASK,
    }
    PluginFactory(tmp_path).make("hall", PLUGIN, files)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    return Submission(tmp_path)


ARM_TASK = """
name: 'hall:reach'
actions: [move_distance, move_joints, move_gripper]
observations: [joint_states, laser, poses]
localisation: ground_truth
"""
REACHING = """
import json, math, os
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.reset()
benchbot.step("move_gripper", width=0.05)
observations, _ = benchbot.step("move_joints", positions=[0.5, -0.3])
joints = observations["joint_states"]
assert benchbot.last_outcome == "reached", benchbot.last_outcome
assert joints["names"] == ["shoulder", "elbow", "gripper"]
assert abs(joints["positions"][0] - 0.5) < 0.02 and math.isnan(joints["velocities"][0])
with open(os.environ["BENCHBOT_RESULT"], "w") as file:
    json.dump(benchbot.empty_results(), file)
"""


def test_an_arm_is_moved_by_a_solution_and_recorded(submit: Submission) -> None:
    robot = arm_declaration(localisation=BY_TRUTH)
    (submit.folder / "hall" / "robots" / "unicycle.yaml").write_text(json.dumps(robot | {"runs_in": ["real"]}))
    (submit.folder / "hall" / "tasks" / "walk.yaml").write_text(ARM_TASK.replace("reach", "walk"))
    recorders = ("--record", "mcap=bag", "--record", "steps=steps")
    with unicycle(arm=True, mounts=MOUNTS) as there:
        done = submit(*recorders, solution=REACHING)
        assert done.returncode == 0, done.stderr
        joints = there.state["joints"]
    assert (joints["shoulder"], joints["elbow"]) == pytest.approx((0.5, -0.3), abs=0.02)
    document = json.loads(submit.result.read_text())
    assert [row[1] for scene in document["actions"] for row in scene["rows"][1:]] == ["move_gripper", "move_joints"]
    told = {one["name"]: one["level"] for one in document["provenance"]["robot"]["findings"]}
    assert told["move_joints /arm/commands"] == told["move_gripper /gripper/commands"] == "ok"
    messages = [message for _, message in by_rosbags(submit.folder / "bag")["/joint_states"]]
    assert list(messages[-1].name) == ["shoulder", "elbow", "gripper"]
    assert messages[-1].position[0] == pytest.approx(0.5, abs=0.02)


BROKEN: list[tuple[str, Document, str, str]] = [
    ("depth in millimetres", {"depth": 1000.0, "wall_x_m": 2.0}, "depth /depth", "that looks like another unit"),
    ("depth in kilometres", {"depth": 0.001, "wall_x_m": 2.0}, "depth /depth", "that looks like another unit"),
    ("the scanner turned round", {"scanner_yaw_deg": 180.0}, "laser and depth", "Turned by 180 degrees"),
    (
        "the scanner declared otherwise than its URDF says",
        {"mounts": MOUNTS | {"lidar": ["base_link", 0.05, 0, 0.3, 0, 0, 180]}},
        "frame lidar",
        "180.0 degrees from where the transforms put it",
    ),
    (
        "transforms in two pieces",
        {"mounts": MOUNTS | {"lidar": ["mast", 0, 0, 0.3, 0, 0, 0]}},
        "frame lidar",
        "they are in two trees",
    ),
]


@pytest.mark.parametrize(
    ("options", "finding", "says"), [case[1:] for case in BROKEN], ids=[case[0] for case in BROKEN]
)
def test_a_broken_robot_is_refused_before_it_moves(
    submit: Submission, options: Document, finding: str, says: str
) -> None:
    with unicycle(**{"depth": 1.0, "wall_x_m": 3.0, "off_start_m": 0.01, "mounts": MOUNTS, **options}) as robot:
        done = submit()
        state = robot.state

    assert done.returncode == 2, done.stderr
    assert "The robot 'unicycle' is not fit to be driven." in done.stderr
    assert says in done.stderr
    assert f"--despite '{finding}'" in done.stderr
    # A return to the start would have moved it there.
    assert (state["x"], state["moved_s"]) == (0.0, None)
    assert not submit.result.exists()


def test_it_is_driven_all_the_same_when_told_so_and_the_result_says_it(submit: Submission) -> None:
    with unicycle(depth=1.0, wall_x_m=3.0, mounts=MOUNTS, scanner_yaw_deg=180.0) as robot:
        done = submit("--despite", "laser and depth")
        assert robot.state["moved_s"] is not None

    assert done.returncode == 0, done.stderr
    told = submit.provenance["robot"]
    assert told["despite"] == ["laser and depth"]
    assert [one["level"] for one in told["findings"] if one["name"] == "laser and depth"] == ["broken"]


def test_a_robot_that_is_well_is_driven_and_what_is_worth_a_look_is_printed(submit: Submission) -> None:
    odd = {"reliability": {"/scan": "best_effort"}, "stamp_offset_s": {"/odom": 0.5, "/truth": 0.5}}
    with unicycle(depth=1.0, wall_x_m=3.0, mounts=MOUNTS, **odd):
        done = submit()

    assert done.returncode == 0, done.stderr
    assert "warning      e-stop: none is declared" in done.stderr
    assert "ok  " not in done.stderr
    driver = submit.provenance["robot"]["driver"]
    assert (driver["distribution"], driver["middleware"]) == ("jazzy", "rmw_fastrtps_cpp")
    assert (driver["domain"], driver["discovery_range"]) == (int(os.environ["ROS_DOMAIN_ID"]), "LOCALHOST")
    assert driver["packages"].keys() >= {"rclpy", "rmw_fastrtps_cpp", "sensor_msgs"}
    assert len(driver["declaration_sha256"]) == 64
    assert driver["subscriptions"]["/scan"] == {"reliability": "best_effort", "durability": "volatile", "depth": 5}
    assert driver["subscriptions"]["/odom"]["reliability"] == "reliable"
    assert driver["clocks"]["/odom"]["messages"] > 10
    assert 0.4 < -driver["clocks"]["/odom"]["median_s"] < 0.6
    assert driver["clocks"]["/scan"]["median_s"] > -0.1
    assert "/collision" not in driver["clocks"]
    levels = {one["name"]: one["level"] for one in submit.provenance["robot"]["findings"]}
    assert levels["laser and depth"] == "ok"
    assert "broken" not in levels.values()


# The frame changes behind the diagnosis, when the robot is at its start.
CHANGES_FRAME = SOLUTION.replace(
    'benchbot.step("move', 'open("go", "w").close()\nwhile os.path.exists("go"): pass\nbenchbot.step("move'
)


def test_a_message_in_another_frame_keeps_its_own_remedy(submit: Submission) -> None:
    with unicycle(depth=1.0, wall_x_m=3.0, mounts=MOUNTS) as robot, ThreadPoolExecutor() as elsewhere:
        submitted = elsewhere.submit(submit, solution=CHANGES_FRAME)
        until((submit.folder / "go").exists, 60.0)
        robot.set(frames={"/scan": "lidar_2"})
        (submit.folder / "go").unlink()
        done = submitted.result()

    assert done.returncode == 3, done.stderr
    assert "The messages on /scan have the frame_id 'lidar_2'" in done.stderr
    assert (
        "Correct the frame in the declaration (with its place under 'frames'), or in what publishes /scan."
        in (done.stderr.rpartition("Fix: ")[2])
    )
    assert "Run it again" not in done.stderr
