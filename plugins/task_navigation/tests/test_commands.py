"""Navigation from the command line, in real processes: submit an episode, score it, refuse what cannot be scored."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.core.declarations import schema
from benchbot.core.provenance import distribution_hash
from plugins.task_navigation.tests.floors import LASER_TASK, arena_truth

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
    from benchbot_task_navigation.floor_plan import FloorPlan

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


def test_only_ray_traced_scenes_can_be_planned(folder: Path) -> None:
    words = [sys.executable, "-m", "benchbot_task_navigation.make_episodes", "arena:1", "--robot", "sample_robot"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)

    assert done.returncode == 2
    assert "cannot be planned" in done.stderr
