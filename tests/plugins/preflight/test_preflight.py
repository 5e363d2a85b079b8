"""What would fail after everything was computed is refused before anything is."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from tests.cli.solutions import PASSIVE
from tests.cli.submitted import SELECTION
from tests.command_line import CommandLine, Here, environment, wait_for

DECLARES = (
    "from importlib.resources import files\nfrom benchbot.plugin import hookimpl\n\n@hookimpl\n"
    "def benchbot_environments():\n    yield files(__name__) / 'environments'\n"
)
BATCH = ["--task", "sample:passive", "--robots", "sample_robot", "--envs", "arena:1,arena:2"]


@pytest.fixture
def lost_map(make_plugin: Callable[..., Path]) -> None:
    """An environment `lost:1` as BenchBot v2's add-ons declare them, whose scene was never downloaded."""
    declared = {**environment(1), "name": "lost", "map_path": "../scenes/lost.glb"}
    make_plugin("lost", DECLARES, {"environments/lost_1.yaml": yaml.safe_dump(declared)})


@pytest.mark.usefixtures("lost_map")
@pytest.mark.parametrize(
    "words",
    [
        ["run", "-t", "sample:passive", "-r", "sample_robot", "-e", "lost:1", "--port", "0"],
        ["submit", "--native", "true", "--task", "sample:passive", "--robot", "sample_robot", "--env", "lost:1"],
        ["batch", *BATCH[:-1], "arena:1,lost:1", "--native", "true", "--dry-run"],
        ["batch", *BATCH[:-1], "arena:1,lost:1", "--native", "true"],
    ],
)
def test_a_scene_that_is_not_there_is_refused_by_every_command(words: list[str], cli: CommandLine) -> None:
    done = cli(*words)

    assert done.returncode == 2
    assert "A file of the environment 'lost:1' is not there." in done.stderr
    assert "lost.glb" in done.stderr
    assert "Ready" not in done.stderr


def test_a_scene_in_the_store_of_another_simulator_is_a_warning(
    make_plugin: Callable[..., Path], cli: CommandLine
) -> None:
    files = {f"environments/{name}.yaml": {**environment(1), "name": name} for name in ("stored", "schemed")}
    files["environments/stored.yaml"]["map_path"] = "/Game/Maps/house"
    files["environments/schemed.yaml"]["map_path"] = "omniverse://host/house.usd"
    make_plugin("elsewhere", DECLARES, {name: yaml.safe_dump(data) for name, data in files.items()})

    done = cli("batch", *BATCH[:-1], "stored:1,schemed:1", "--native", "true", "--dry-run")

    assert done.returncode == 0, done.stderr
    assert "warning      A file of the environment 'stored:1' is not there." in done.stderr
    assert "ok           scene: schemed:1" in done.stderr


@pytest.mark.parametrize("command", ["submit", "batch"])
@pytest.mark.parametrize("only_shown", [True, False])
def test_a_solution_that_is_not_there_is_refused(command: str, only_shown: bool, here: Here, cli: CommandLine) -> None:
    selection = SELECTION if command == "submit" else BATCH

    done = here(command, *selection, "--native", f"{sys.executable} nothing.py", *["--dry-run"][:only_shown])

    assert done.returncode == 2
    assert f"There is no {cli.folder / 'nothing.py'}" in done.stderr
    assert not list(cli.folder.iterdir())


def test_a_method_without_ground_truth_is_refused_and_the_environments_are_named(here: Here, cli: CommandLine) -> None:
    solution = cli.script("solution.py", PASSIVE)

    batch = here("batch", *BATCH, "--native", solution, "--evaluate-with", "omq", "--dry-run")
    submit = here("submit", *SELECTION, "--native", solution, "--evaluate-with", "omq")

    assert (batch.returncode, submit.returncode) == (2, 2)
    assert "There is no ground truth of the environment 'arena:1'." in submit.stderr
    assert "This batch is not possible, for 2 reasons." in batch.stderr
    assert "There is no ground truth of the environment 'arena:2'." in batch.stderr
    assert "leave --evaluate-with out" in batch.stderr


def test_everything_that_is_wrong_is_told_at_once(here: Here, cli: CommandLine) -> None:
    (cli.folder / "file").write_text("")
    words = ["--robot", "nobody", "--task", "sample:passive", "--env", "arena:1"]

    done = here("submit", *words, "--native", "nothing", "-e", "nothing", "--record", "frames=file/in/it,nothing")
    more = here("submit", *words, "--native", "nothing", "-e", "nothing", "--record", "frames=file/in/it")

    assert done.returncode == more.returncode == 2
    assert "for 4 reasons" in more.stderr
    for reason in (
        "no such program on PATH",
        "'nobody' is not a known robot",
        "'nothing' is not an installed evaluator",
    ):
        assert reason in more.stderr
    assert "The recorder 'frames' cannot write into file/in/it." in more.stderr


def test_a_batch_names_wrong_axes_solution_recorder_and_executor_together(here: Here) -> None:
    words = ["--task", "sample:passive", "--robots", "nobody", "--envs", "arena:1,arena:3", "--native", "nothing"]

    done = here("batch", *words, "--record", "nothing", "--executor", "nothing", "--dry-run")

    assert done.returncode == 2
    assert "for 5 reasons" in done.stderr
    for reason in ("on PATH", "known robot", "known environment", "installed recorder", "installed executor"):
        assert reason in done.stderr


def test_too_little_room_is_told_before_the_first_episode(here: Here, cli: CommandLine) -> None:
    words = [*BATCH, "--native", cli.script("solution.py", PASSIVE)]

    done = here("batch", *words, "--min-free-gb", "1000000")

    assert done.returncode == 2
    assert "There is no room in" in done.stderr


def test_what_was_proven_is_shown_by_a_dry_run(here: Here, cli: CommandLine) -> None:
    solution = cli.script("solution.py", PASSIVE)

    done = here("submit", *SELECTION, "--native", solution, "--record", "frames", "--dry-run")

    assert done.returncode == 0, done.stderr
    for line in (f"ok           solution: {solution}", "ok           scene: arena:1", "recorder: frames, into"):
        assert line in done.stderr


def test_a_running_back_end_without_ground_truth_is_found_before_the_solution_runs(cli: CommandLine) -> None:
    back_end = cli.start("run", "-t", "sample:passive", "-r", "sample_robot", "-e", "arena:1", "--port", "0")
    wait_for(back_end, "Ready.")

    done = cli("submit", "--native", cli.script("solution.py", "open('ran', 'w')"), "--evaluate-with", "omq")

    assert done.returncode == 2
    assert "There is no ground truth of the environment 'arena:1'." in done.stderr
    assert not (cli.folder / "ran").exists()
    cli("stop")


REAL_ROBOT = """\
name: walker
type: real_sample
runs_in: [real]
global_frame: map
robot_frame: base_link
poses: [base_link]
connections: {laser: {connection: ros_to_api}, poses: {connection: ros_to_api}, move_next: {connection: api_to_ros}}
"""
DECLARES_ALL = DECLARES + (
    "\n@hookimpl\ndef benchbot_robots():\n    yield files(__name__) / 'robots'\n"
    "\n@hookimpl\ndef benchbot_tasks():\n    yield files(__name__) / 'tasks'\n"
)
WALK = "name: walk\nactions: [move_next]\nobservations: [laser, poses]\nlocalisation: ground_truth\n"
MAP = "image: hall.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
# Three metres in a row, as plain PGM: free, occupied and unknown.
PICTURE = "P2\n3 1\n255\n254 0 205\n"


def hall(make_plugin: Callable[..., Path], *way_x_m: float, about: str = MAP) -> list[str]:
    """Make a real hall with a map, a way through it, and a robot; return the words of a run there."""
    poses = [[1, 0, 0, 0, x_m, 0.5, 0] for x_m in way_x_m]
    declared = {"name": "hall", "variant": 1, "type": "real", "object_labels": [], "map_path": "../maps/hall.yaml"}
    declared |= {"start_pose": poses[0], "trajectory_poses": poses}
    files = {
        "environments/hall_1.yaml": yaml.safe_dump(declared),
        "robots/walker.yaml": REAL_ROBOT,
        "tasks/walk.yaml": WALK,
        "maps/hall.yaml": about,
        "maps/hall.pgm": PICTURE,
    }
    make_plugin("halls", DECLARES_ALL, files)
    return ["submit", "--native", "true", "--task", "walk", "--robot", "walker", "--env", "hall:1", "--dry-run"]


def test_a_start_in_the_free_space_of_a_real_rooms_map_is_proven(
    make_plugin: Callable[..., Path], cli: CommandLine
) -> None:
    done = cli(*hall(make_plugin, 0.5, 0.9))

    assert done.returncode == 0, done.stderr
    assert "ok           start: hall:1: free in hall.yaml" in done.stderr


@pytest.mark.parametrize(
    ("x_m", "why"),
    [
        (1.5, "is occupied in"),
        (2.5, "is unknown in"),
        (-0.5, "is outside in"),
    ],
)
def test_a_start_where_the_robot_cannot_be_is_refused(
    make_plugin: Callable[..., Path], cli: CommandLine, x_m: float, why: str
) -> None:
    done = cli(*hall(make_plugin, x_m))

    assert done.returncode == 2
    assert "The environment 'hall:1' puts the robot where it cannot be." in done.stderr
    assert f"Its start_pose is at ({x_m:.2f}, 0.50) m, which {why}" in " ".join(done.stderr.split())


def test_a_way_through_a_wall_is_a_warning(make_plugin: Callable[..., Path], cli: CommandLine) -> None:
    done = cli(*hall(make_plugin, 0.5, 1.5))

    assert done.returncode == 0, done.stderr
    assert "warning      The environment 'hall:1' puts the robot" in done.stderr
    assert "trajectory_poses[1]" in done.stderr


def test_a_map_that_cannot_be_used_is_refused_with_what_is_wrong(
    make_plugin: Callable[..., Path], cli: CommandLine
) -> None:
    done = cli(*hall(make_plugin, 0.5, about=MAP + "mode: raw\n"))

    assert done.returncode == 2
    assert "Its mode is 'raw'" in done.stderr
    assert "map_saver_cli --mode trinary" in done.stderr
