"""Navigation from the command line, in real processes: submit an episode, score it, refuse what cannot be scored."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.declarations import schema
from benchbot.core.provenance import distribution_hash
from benchbot_task_navigation.floor_plan import FloorPlan
from plugins.task_navigation.tests.floors import LASER_TASK, arena_truth
from tests.plugin_factory import DECLARES, PluginFactory

# Moves, is put back, and hands in its result as if nothing had been.
TWICE = """
import json, os
from benchbot.api.client import Client

client = Client()
client.reset()
client.step("move_distance", {"distance": 0.1})
client.reset()
with open(os.environ["BENCHBOT_RESULT"], "w") as file:
    json.dump({"results": {}}, file)
"""
COMMAND = [sys.executable, "-m", "benchbot"]


def benchbot(folder: Path, *words: str, cache: Path | None = None) -> "subprocess.CompletedProcess[str]":
    cache = cache or folder / "cache"
    variables = {"BENCHBOT_STATE_DIR": str(folder / "state"), "BENCHBOT_CACHE_DIR": str(cache)}
    return subprocess.run(
        [*COMMAND, *words], cwd=folder, env={**os.environ, **variables}, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two results in the sample arena, one of them by drifting odometry, and with its floor plan."""
    folder = tmp_path_factory.mktemp("navigation")
    (folder / "truth.json").write_text(json.dumps(arena_truth()))
    drifting = LASER_TASK.replace("ground_truth", "dead_reckoning")
    for number, task in ((1, LASER_TASK), (2, drifting)):
        done = benchbot(
            folder,
            *("submit", "--task", task, "--robot", "sample_robot", "--env", "arena:1", "--episode", str(number)),
            *("--example", "go_to_goal", "--results-location", f"{number}.json"),
        )
        assert done.returncode == 0, done.stderr
    return folder


def test_an_episode_is_driven_and_says_so(folder: Path) -> None:
    document = json.loads((folder / "1.json").read_text())
    schema.check(document, "result", folder / "1.json")

    episode = document["provenance"]["selection"]["episode"]
    assert (episode["list"], episode["number"]) == ("point_goal:arena:1", 1)
    assert document["environment_details"][0]["start_pose"][4:6] == document["track"][0]["rows"][0][2:4]
    plugins = document["provenance"]["plugins"]
    assert plugins["benchbot-task-navigation"]["sha256"] == distribution_hash("benchbot-task-navigation")
    assert "shortest_path_m" not in json.dumps(document)


def test_the_true_track_is_kept_where_the_solution_had_drifting_poses(folder: Path) -> None:
    (track,) = json.loads((folder / "2.json").read_text())["track"]

    assert len(track["rows"]) > 20


def test_its_score_is_that_of_the_track(folder: Path) -> None:
    done = benchbot(folder, "eval", "1.json", "--ground-truth", "truth.json", "--require", "success>=1")

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("SPL 0.")
    scores = json.loads((folder / "scores.json").read_text())["scores"]
    assert scores["path_length_m"] == json.loads((folder / "1.json").read_text())["track"][0]["path_length_m"]


def test_a_result_without_a_track_is_named_and_counts_as_no_success(folder: Path) -> None:
    document = json.loads((folder / "1.json").read_text())
    del document["track"]
    (folder / "bare.json").write_text(json.dumps(document))
    done = benchbot(folder, "eval", "bare.json", "--ground-truth", "truth.json", "-o", "none.json")

    assert done.returncode == 2
    assert "does not say where the robot went" in done.stderr
    assert "benchbot submit" in done.stderr


def test_an_episode_is_one_attempt(folder: Path) -> None:
    (folder / "twice.py").write_text(TWICE)
    done = benchbot(
        folder,
        *("submit", "--task", LASER_TASK, "--robot", "sample_robot", "--env", "arena:1", "--episode", "1"),
        *("--native", f"{sys.executable} twice.py", "--results-location", "twice.json"),
    )
    assert done.returncode == 0, done.stderr
    assert "one attempt" in done.stderr

    scored = benchbot(folder, "eval", "twice.json", "--ground-truth", "truth.json", "-o", "twice-scores.json", "--json")
    assert json.loads(scored.stdout)["scores"]["success"] == 0.0


def test_an_episode_that_there_is_not_is_refused_with_the_range(folder: Path) -> None:
    words = ("--task", LASER_TASK, "--robot", "sample_robot", "--env", "arena:1", "--episode", "3")
    done = benchbot(folder, "submit", *words, "--example", "go_to_goal")

    assert done.returncode == 2
    assert "0 to 2" in done.stderr


def test_the_lists_are_listed_and_checked(folder: Path) -> None:
    listed = benchbot(folder, "list", "episodes", "--json")
    rows = {row["name"]: row for row in json.loads(listed.stdout)}
    assert rows["point_goal:miniroom:1"]["episodes"] == 20

    done = benchbot(folder, "check", rows["object_goal:miniroom:1"]["path"])
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.slow
@pytest.mark.xdist_group("main job")
def test_an_episode_is_driven_in_the_ray_traced_room(tmp_path: Path, kernel_cache: Path) -> None:
    done = benchbot(
        tmp_path,
        *("submit", "--task", LASER_TASK, "--robot", "carter_lowres", "--env", "miniroom:1", "--episode", "19"),
        *("--example", "go_to_goal", "--evaluate-with", "navigation", "--require", "success>=1"),
        *("--results-location", "result.json"),
        cache=kernel_cache,
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("SPL 0.")


@pytest.mark.slow
def test_the_shipped_plan_and_episodes_are_made_again_from_the_scene(tmp_path: Path) -> None:
    import benchbot_task_navigation

    words = [sys.executable, "-m", "benchbot_task_navigation.make_episodes", "miniroom:1", "--output", str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) == 3

    shipped = Path(benchbot_task_navigation.__file__).parent
    for goal in ("point_goal", "object_goal"):
        name = f"episodes/{goal}/miniroom_1.json"
        assert (tmp_path / name).read_bytes() == (shipped / name).read_bytes()
    # Compressed bytes depend on the machine's zlib; what is in them does not.
    name = "ground_truths/floor_plan_miniroom_1.json"
    made, kept = (
        FloorPlan.from_ground_truth(json.loads((folder / name).read_text())["ground_truth"])
        for folder in (tmp_path, shipped)
    )
    assert (made.clearance_m == kept.clearance_m).all()


HALL = DECLARES.format(kind="environments")
SIDE_M = 0.05


def hall() -> dict[str, str]:
    """A real room of 6 m x 4 m and its map, with a wall from (3, 0) to (3, 2.5)."""
    free = np.full((80, 120), 254)
    free[[0, -1]] = free[:, [0, -1]] = free[30:, 60] = 0
    about = {"image": "hall.pgm", "resolution": SIDE_M, "origin": [0.0, 0.0, 0.0], "negate": 0}
    declared = {"name": "hall", "variant": 1, "type": "real", "map_path": "../maps/hall.yaml"}
    pixels = "\n".join(" ".join(map(str, row)) for row in free)
    return {
        "environments/hall_1.yaml": json.dumps({**declared, "start_pose": [1, 0, 0, 0, 1.0, 1.0, 0.0]}),
        "maps/hall.yaml": json.dumps({**about, "occupied_thresh": 0.65, "free_thresh": 0.196}),
        "maps/hall.pgm": f"P2\n120 80\n255\n{pixels}\n",
    }


def test_a_real_room_is_planned_by_its_map(tmp_path: Path, plugin_factory: PluginFactory) -> None:
    plugin_factory.make("benchbot-hall", HALL, hall())
    module = [sys.executable, "-m", "benchbot_task_navigation.make_episodes", "hall:1", "--count", "4"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(plugin_factory.folder), os.environ["PYTHONPATH"]])}
    done = subprocess.run(module, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert "No episodes of object_goal: a map does not say" in done.stderr
    plan = FloorPlan.from_ground_truth(
        json.loads((tmp_path / "ground_truths/floor_plan_hall_1.json").read_text())["ground_truth"]
    )
    # To the wall in the middle, to the outer one, round the wall's end, behind it.
    points = np.array([[2.0, 1.0], [1.0, 3.0], [3.0, 3.0], [5.0, 1.0]])
    assert plan.clearance_at(points) == pytest.approx([1.0, 0.95, 0.5, 0.95], abs=SIDE_M)
    assert plan.clearance_at(np.array([[3.02, 1.0], [-0.5, 1.0]])) == pytest.approx([0.0, 0.0])
    episodes = json.loads((tmp_path / "episodes/point_goal/hall_1.json").read_text())["episodes"]
    assert len(episodes) == 4


def test_no_other_scenes_can_be_planned(folder: Path) -> None:
    words = [sys.executable, "-m", "benchbot_task_navigation.make_episodes", "arena:1", "--robot", "sample_robot"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)

    assert done.returncode == 2
    assert "cannot be planned" in done.stderr
