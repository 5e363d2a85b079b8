"""The same solutions, to the byte, on a simulated robot and on one behind ROS 2: same task, same room, same score."""

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
import yaml

from benchbot.core.declarations import schema
from benchbot.core.geometry import Pose
from plugins.record_mcap.tests.bags import by_rosbags
from plugins.robot_ros2.tests.bridge.bridged import bridge
from plugins.robot_ros2.tests.conftest import _free_domain
from tests.conftest import SAMPLE_PLUGIN
from tests.plugin_factory import DECLARES, PluginFactory

Document = dict[str, Any]

COMMAND = [sys.executable, "-m", "benchbot"]
MAPPING = "semantic_slam:passive:ground_truth:segmentation"
EXAMPLES = {
    "hello_passive": files("benchbot.plugins") / "examples" / "hello_passive.py",
    "hello_active": files("benchbot.plugins") / "examples" / "hello_active.py",
    "segmentation_mapper": files("benchbot_task_semslam") / "examples" / "segmentation_mapper.py",
}
POSITION_TOLERANCE_M, ANGLE_TOLERANCE_DEG = 0.01, 1.0

PLUGIN = "\n".join(DECLARES.format(kind=kind) for kind in ("robots", "environments", "ground_truths"))

# Two short ways: past the arena's furniture, and once around in the middle of the room.
NOOK: Document = {
    "start_pose": [1, 0, 0, 0, -1.0, 0, 0],
    "trajectory_poses": [[1, 0, 0, 0, -0.7, 0, 0], [0.9659258, 0, 0, -0.2588190, -0.7, 0, 0]],
}
LOOK_AROUND: Document = {
    "start_pose": [0.707107, 0, 0, -0.707107, 1.2, 1.5, 0],
    "trajectory_poses": [
        [0.9238795, 0, 0, -0.3826834, 1.2, 1.5, 0],
        [0.9659258, 0, 0, 0.2588190, 1.2, 1.5, 0],
        [0.8660254, 0, 0, 0.5, 1.25, 1.55, 0],
    ],
}


@dataclass(frozen=True)
class Run:
    """What is left of a run: which file ran, the result, and what was recorded."""

    solution_sha256: str
    result: Document
    recording: dict[str, list[tuple[int, Any]]]
    folder: Path

    @property
    def objects(self) -> list[Document]:
        """The mapped objects, sorted by what and where they are."""
        objects: list[Document] = self.result["results"]["objects"]
        return sorted(objects, key=lambda item: (item["label_probs"], item["centroid"]))

    def visited(self) -> list[Pose]:
        """Return where the solution was told that the robot's base was, step by step."""
        return [
            Pose((at.x, at.y, at.z), (turned.x, turned.y, turned.z, turned.w))
            for _, message in self.recording["/tf"]
            for transform in message.transforms
            if transform.child_frame_id == "base_link"
            for at, turned in [(transform.transform.translation, transform.transform.rotation)]
        ]


@dataclass(frozen=True)
class Platforms:
    """A simulated robot, and its twin behind ROS 2, in one environment."""

    simulated: str
    real: str
    environment: str
    folder: Path

    def both(self, task: str, example: str, *words: str) -> tuple[Run, Run]:
        """Submit an example to the one and to the other."""
        return self.submit(task, self.simulated, example, words), self.submit(task, self.real, example, words)

    def replay(self, run: Run, example: str, *words: str) -> Run:
        """Submit an example to the recording of a run."""
        return self._run(run.folder.with_name(f"{run.folder.name}_again"), example, words, "replay", run.folder / "bag")

    def submit(self, task: str, robot: str, example: str, words: tuple[str, ...] = ()) -> Run:
        """Submit an example to a robot."""
        selection = ("--task", task, "--robot", robot, "--env", self.environment)
        return self._run(self.folder / f"{example}_{robot}", example, words, "submit", *selection)

    def _run(self, folder: Path, example: str, words: tuple[str, ...], *command_words: str | Path) -> Run:
        folder.mkdir()
        command = [*map(str, command_words), "--example", example]
        command += ["--results-location", str(folder / "result.json"), "--record", f"mcap={folder / 'bag'}", *words]
        digest = sha256(EXAMPLES[example].read_bytes()).hexdigest()
        done = subprocess.run([*COMMAND, *command], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return Run(digest, json.loads((folder / "result.json").read_text()), by_rosbags(folder / "bag"), folder)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A plug-in, installed for all processes: the sample robot's twin behind ROS 2, and two rooms with short ways."""
    arena = Path(SAMPLE_PLUGIN) / "benchbot_sample" / "environments" / "arena_1.yaml"
    miniroom = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
    truth = schema.read(miniroom.parents[1] / "ground_truths" / "miniroom_1.json")
    look_around = environment(miniroom, "look_around", LOOK_AROUND)
    folder = tmp_path_factory.mktemp("rooms")
    PluginFactory(folder).make(
        "short-ways",
        PLUGIN,
        {
            "robots/twin.yaml": json.dumps(twin()),
            "robots/stamped_twin.yaml": json.dumps(stamped_twin()),
            "environments/nook_1.yaml": json.dumps(environment(arena, "nook", NOOK)),
            "environments/look_around_1.yaml": json.dumps(look_around),
            "ground_truths/look_around_1.json": json.dumps({**truth, "environment": look_around}),
        },
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BENCHBOT_STATE_DIR", str(folder / "state"))
        patch.setenv("PYTHONPATH", os.pathsep.join([str(folder), os.environ["PYTHONPATH"]]))
        yield folder


def environment(path: Path, name: str, way: Document) -> Document:
    """Return an environment under another name with another way through it."""
    data = schema.read(path)
    return {**data, "name": name, "map_path": str((path.parent / data["map_path"]).resolve()), **way}


def twin() -> Document:
    """Return carter_ros2 with the body of the sample robot."""
    data: Document = yaml.safe_load((files("benchbot_robot_ros2") / "robots" / "carter_ros2.yaml").read_text())
    # The sample robot has no inertial measurement unit.
    del data["connections"]["imu"]
    # On a machine that is busy with other tests, pictures come late.
    data["driver"]["timing"]["wait_s"] = 60.0
    return {
        **data,
        "name": "sample_twin",
        "runs_in": ["sim_sample"],
        "poses": ["base_link", "initial_pose", "camera", "lidar"],
        "frames": {"camera": {"xyz": [0, 0, 0.5], "rpy_deg": [-90, 0, -90]}, "lidar": {"xyz": [0, 0, 0]}},
        "camera": {"frame": "camera"},
        "footprint": {"radius_m": 0.2, "z_min_m": 0.03, "z_max_m": 1.0},
    }


def stamped_twin() -> Document:
    """Return the twin whose base takes stamped velocities."""
    data = twin()
    for action in ("move_next", "move_distance", "move_angle"):
        data["connections"][action] = {**data["connections"][action], "ros_type": "geometry_msgs/msg/TwistStamped"}
    return {**data, "name": "sample_stamped_twin"}


@contextmanager
def domain_of_its_own() -> Iterator[None]:
    """Let what is started meanwhile find one another, and nobody else."""
    with pytest.MonkeyPatch.context() as patch, _free_domain() as (number, _):
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield


@contextmanager
def bridge_on_a_domain(*words: str) -> Iterator[None]:
    """Start a bridge that has a ROS domain to itself, where what is started meanwhile finds it."""
    with domain_of_its_own(), bridge(*words):
        yield


@pytest.fixture(scope="module")
def in_the_nook(rooms: Path) -> Iterator[Platforms]:
    """The sample robot and its twin."""
    with bridge_on_a_domain("--robot", "sample_careful_robot", "--env", "nook:1", "--camera-rate-hz", "20"):
        yield Platforms("sample_careful_robot", "sample_twin", "nook:1", rooms)


def same_solution(one: Run, other: Run) -> bool:
    """Say whether both runs ran the same file, to the byte, by the same command."""
    ours, theirs = one.result["provenance"]["solution"], other.result["provenance"]["solution"]
    return bool(ours["command"] == theirs["command"] and one.solution_sha256 == other.solution_sha256)


def off(reached: Pose, goal: Pose) -> tuple[float, float]:
    """Return how far one pose is from another: metres in the plane, degrees."""
    difference = goal.inverse() @ reached
    return math.hypot(*difference.translation_xyz[:2]), math.degrees(abs(difference.yaw_rad))


@pytest.mark.xdist_group("robots 1")
def test_two_bridged_robots_of_one_declaration_are_driven_at_once(rooms: Path) -> None:
    names = ("tb1", "tb2")
    nook = ("--robot", "sample_careful_robot", "--env", "nook:1")
    with ExitStack() as stack, ThreadPoolExecutor() as pool:
        words = [(*nook, "--namespace", name) for name in names]
        stack.enter_context(domain_of_its_own())
        list(pool.map(lambda arguments: stack.enter_context(bridge(*arguments)), words))
        fleet = [Platforms("", f"sample_twin@{name}", "nook:1", rooms) for name in names]
        task = "semantic_slam:passive:ground_truth"
        runs = list(pool.map(lambda one: one.submit(task, one.real, "hello_passive"), fleet))

    assert [run.result["provenance"]["selection"]["robot"] for run in runs] == ["sample_twin@tb1", "sample_twin@tb2"]
    goals = [Pose.from_wxyz_xyz(pose) for pose in NOOK["trajectory_poses"]]
    for run in runs:
        assert run.result["provenance"]["failure"] is None
        for reached, goal in zip(run.visited()[1:], goals, strict=True):
            away_m, turned_deg = off(reached, goal)
            assert away_m < 2 * POSITION_TOLERANCE_M
            assert turned_deg < 2 * ANGLE_TOLERANCE_DEG


@pytest.mark.xdist_group("robots 1")
@pytest.mark.parametrize(
    ("example", "task", "steps"),
    [
        ("hello_passive", "semantic_slam:passive:ground_truth", 2),
        ("hello_active", "semantic_slam:active:ground_truth", 5),
    ],
)
def test_a_first_solution_runs_on_both(in_the_nook: Platforms, example: str, task: str, steps: int) -> None:
    simulated, real = in_the_nook.both(task, example)

    assert same_solution(simulated, real)
    assert simulated.result["provenance"]["steps"] == real.result["provenance"]["steps"] == steps
    for run in (simulated, real):
        assert run.result["provenance"]["failure"] is None
    for here, there in zip(simulated.visited(), real.visited(), strict=True):
        away_m, turned_deg = off(there, here)
        assert away_m < 0.05
        assert turned_deg < 4.0


@pytest.mark.xdist_group("robots 1")
def test_a_first_solution_runs_where_velocities_are_stamped(rooms: Path) -> None:
    with bridge_on_a_domain(
        "--robot", "sample_careful_robot", "--env", "nook:1", "--camera-rate-hz", "20", "--stamped"
    ):
        platforms = Platforms("sample_careful_robot", "sample_stamped_twin", "nook:1", rooms / "stamped")
        platforms.folder.mkdir()
        simulated, real = platforms.both("semantic_slam:passive:ground_truth", "hello_passive")

    assert same_solution(simulated, real)
    assert real.result["provenance"]["failure"] is None
    for here, there in zip(simulated.visited(), real.visited(), strict=True):
        assert off(there, here)[0] < 0.05


@pytest.fixture(scope="module")
def mapped(in_the_nook: Platforms) -> tuple[Run, Run]:
    """What the mapper leaves of the nook."""
    return in_the_nook.both(MAPPING, "segmentation_mapper")


@pytest.mark.xdist_group("robots 1")
def test_a_mapper_finds_the_same_things_in_the_same_places(mapped: tuple[Run, Run]) -> None:
    simulated, real = mapped

    assert same_solution(simulated, real)
    assert len(simulated.objects) > 0
    for here, there in zip(simulated.objects, real.objects, strict=True):
        assert here["label_probs"] == there["label_probs"]
        assert math.dist(here["centroid"], there["centroid"]) < 0.1


@pytest.mark.xdist_group("robots 1")
def test_what_both_have_seen_is_replayed_to_the_same_maps(in_the_nook: Platforms, mapped: tuple[Run, Run]) -> None:
    for run in mapped:
        replayed = in_the_nook.replay(run, "segmentation_mapper")
        assert same_solution(run, replayed)
        assert replayed.objects == run.objects
        assert replayed.result["actions"] == run.result["actions"]


@pytest.mark.xdist_group("robots 1")
def test_recordings_of_both_have_the_same_topics(mapped: tuple[Run, Run]) -> None:
    simulated, real = (contents(run) for run in mapped)

    assert simulated == real
    assert simulated["/camera/color/image_raw"] == ("sensor_msgs/msg/Image", len(NOOK["trajectory_poses"]) + 1)


def contents(run: Run) -> dict[str, tuple[str, int]]:
    """Return the recorded topics' types, and how many messages each has."""
    return {topic: (messages[0][1].__msgtype__, len(messages)) for topic, messages in run.recording.items()}


@pytest.mark.slow
@pytest.mark.xdist_group("renderer")
def test_the_ray_traced_room_is_mapped_and_scored_alike(
    rooms: Path, kernel_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    with bridge_on_a_domain("--robot", "carter_lowres", "--env", "look_around:1"):
        platforms = Platforms("carter_lowres", "carter_ros2", "look_around:1", rooms)
        simulated, real = platforms.both(MAPPING, "segmentation_mapper", "--evaluate-with", "omq")
    replayed = [platforms.replay(run, "segmentation_mapper", "--evaluate-with", "omq") for run in (simulated, real)]

    assert same_solution(simulated, real)
    goals = [Pose.from_wxyz_xyz(pose) for pose in LOOK_AROUND["trajectory_poses"]]
    for run in (simulated, real):
        for reached, goal in zip(run.visited()[1:], goals, strict=True):
            away_m, turned_deg = off(reached, goal)
            assert away_m <= 1.5 * POSITION_TOLERANCE_M
            assert turned_deg <= 1.5 * ANGLE_TOLERANCE_DEG
    assert len(simulated.objects) == len(real.objects) > 5
    ours, theirs, *again = (
        json.loads((run.folder / "scores.json").read_text())["scores"] for run in (simulated, real, *replayed)
    )
    assert ours["OMQ"] > 0.3
    assert theirs["OMQ"] == pytest.approx(ours["OMQ"], abs=0.03)
    assert again == [ours, theirs]
