import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from benchbot.core import results
from benchbot.core.errors import BenchbotError
from benchbot.gymnasium import Move, TaskEnv, Velocity

Make = Callable[..., gymnasium.Env[Any, Any]]
FORWARD = {"action": 0, "argument": np.array([0.5], np.float32)}
WALL = Move("move_distance", 9.0)


def task_env(env: gymnasium.Env[Any, Any]) -> TaskEnv:
    assert isinstance(env.unwrapped, TaskEnv)
    return env.unwrapped


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize(
    ("task", "environment"),
    [
        ("sample:active", "arena:1"),
        ("sample:noisy", "arena:1"),
        ("sample:passive", "arena:1"),
        ("sample:goal", "arena:1"),
        ("sample:two_scenes", "arena:1:2"),
    ],
)
def test_gymnasium_finds_nothing_to_complain_about(make: Make, task: str, environment: str) -> None:
    check_env(make(task=task, env=environment, reward={"coverage": 1, "collision": 10}).unwrapped)


def test_the_spaces_are_those_of_the_robots_declaration(make: Make) -> None:
    env = make()
    assert {name: box.shape for name, box in env.observation_space.spaces.items()} == {  # type: ignore[attr-defined]
        "class_segment_img": (32, 48),
        "image_depth": (32, 48),
        "image_rgb": (32, 48, 3),
        "instance_segment_img": (32, 48),
        "laser": (36,),
        "pose_base_link": (7,),
        "pose_camera": (7,),
        "pose_initial_pose": (7,),
        "pose_lidar": (7,),
    }
    assert task_env(env).action_names == ("move_distance", "move_angle")


def test_an_argument_is_a_share_of_the_largest(make: Make) -> None:
    env = make(largest_distance_m=0.6)
    env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(FORWARD)
    assert observation["pose_base_link"] == pytest.approx([-1.7, 0, 0, 0, 0, 0, 1], abs=0.011)
    assert (reward, terminated, truncated, info["outcome"], info["steps"]) == (0.0, False, False, "reached", 1)
    assert info["pose_xyyaw"][0] == pytest.approx(observation["pose_base_link"][0])


def test_what_is_constant_is_told_by_reset(make: Make) -> None:
    env = make()
    _, info = env.reset(seed=7)
    assert (info["env"], info["seed"], info["steps"], info["state"]) == ("arena:1", 7, 0, "clean")
    assert info["class_ids"] == {"bottle": 1, "chair": 2}
    assert info["image_depth_info"]["matrix_intrinsics"].shape == (3, 3)
    assert info["laser_angles_rad"].shape == (36,)
    assert "class_ids" not in env.step(FORWARD)[4]


def test_the_true_pose_is_not_told_where_the_task_hides_it(make: Make) -> None:
    env = make(task="sample:noisy")
    assert "pose_xyyaw" not in env.reset()[1]
    assert "pose_xyyaw" not in env.step(FORWARD)[4]


def test_a_collision_terminates(make: Make) -> None:
    env = make(reward="collision")
    env.reset()
    _, reward, terminated, truncated, info = env.step(WALL)
    assert (reward, terminated, truncated) == (-1.0, True, False)
    assert (info["collided"], info["result"], list(info["action_mask"])) == (True, "COLLISION", [0, 0])
    with pytest.raises(BenchbotError, match="The episode is over"):
        env.step(FORWARD)
    _, info = env.reset()
    assert (info["collided"], info["state"]) == (False, "clean")


def test_the_end_of_the_trajectory_terminates(make: Make) -> None:
    env = make(task="sample:passive")
    env.reset()
    ends = [env.step({"action": 0})[2] for _ in range(3)]
    assert ends == [False, False, True]


def test_a_task_of_two_scenes_has_a_way_to_the_next(make: Make) -> None:
    env = make(task="sample:two_scenes", env="arena:1:2")
    assert task_env(env).action_names == ("move_next", "next_scene")
    env.reset()
    for _ in range(3):
        _, _, terminated, _, info = env.step({"action": 0})
    assert (terminated, list(info["action_mask"])) == (False, [0, 1])
    assert env.step({"action": 0})[4]["outcome"] == "unavailable"
    _, _, terminated, _, info = env.step({"action": 1})
    assert (info["outcome"], info["scene_number"], info["class_ids"]) == ("entered", 1, {"chair": 2, "person": 3})
    assert env.step({"action": 1})[4]["outcome"] == "unavailable"
    ends = [env.step({"action": 0})[2] for _ in range(3)]
    assert ends == [False, False, True]


def test_used_up_simulated_time_truncates(make: Make) -> None:
    env = make(max_simulated_time_s=2.0)
    env.reset()
    ends = [env.step(Move("move_angle", 30.0))[3] for _ in range(2)]
    assert ends == [False, True]
    with pytest.raises(BenchbotError, match="The episode is over"):
        env.step(FORWARD)


def test_gymnasiums_own_time_limit_truncates(make: Make) -> None:
    env = make(max_episode_steps=2)
    env.reset()
    assert [env.step(FORWARD)[3] for _ in range(2)] == [False, True]


def test_a_reset_chooses_among_environments(make: Make) -> None:
    env = make(env=["arena:1", "arena:2"])
    names = {env.reset(seed=seed)[1]["env"] for seed in range(20)}
    assert names == {"arena:1", "arena:2"}
    assert [env.reset(seed=3)[1]["env"] for _ in range(3)].count(env.reset(seed=3)[1]["env"]) == 3
    assert env.reset(options={"env": "arena:2"})[1]["class_ids"] == {"chair": 2, "person": 3}


def test_ranges_beyond_the_sensor_are_the_bound(make: Make) -> None:
    env = make()
    observation, _ = env.reset()
    # The upper half of the sample's picture is open sky wherever no wall stands in it.
    assert observation["image_depth"].max() == 10.0
    assert np.isfinite(observation["laser"]).all()


def test_a_velocity_moves_without_stopping(make: Make) -> None:
    env = make()
    env.reset()
    _, _, _, _, first = env.step(Velocity(0.5, 0.0, 0.5))
    _, _, _, _, second = env.step(Velocity(0.5, 0.0, 0.5))
    assert second["simulated_time_s"] == pytest.approx(1.0)
    assert second["pose_xyyaw"][0] - first["pose_xyyaw"][0] == pytest.approx(0.25)
    assert env.step(Velocity(1.5, 0.0, 10.0))[2]


def test_rendering_shows_the_cameras_picture(make: Make) -> None:
    env = make(render_mode="rgb_array")
    observation, _ = env.reset()
    picture = env.render()
    assert isinstance(picture, np.ndarray)
    assert np.array_equal(picture, observation["image_rgb"])
    assert make().unwrapped.render_mode is None


def test_two_environments_do_not_disturb_each_other(make: Make) -> None:
    one, other = make(), make(env="arena:2")
    one.reset(seed=1)
    before, _ = other.reset(seed=1)
    one.step(WALL)
    after, *_ = other.step(Move("move_distance", 0.0))
    assert np.array_equal(before["image_rgb"], after["image_rgb"])


def test_a_closed_environment_says_so_and_can_be_reset(make: Make) -> None:
    env = make().unwrapped
    env.reset()
    env.close()
    env.close()
    with pytest.raises(BenchbotError, match="No episode is under way"):
        env.step(FORWARD)
    env.reset()
    assert env.step(FORWARD)[4]["steps"] == 1


def test_a_simulator_that_fails_is_started_anew(make: Make) -> None:
    env = make()
    with pytest.raises(BenchbotError, match="does not load"):
        env.reset(options={"env": "faulty:load"})
    assert env.reset()[1]["state"] == "clean"


def test_an_episode_makes_a_result(make: Make, tmp_path: Path) -> None:
    env = make()
    env.reset(seed=5)
    env.step(FORWARD)
    session = task_env(env).session
    found = {"class_list": ["bottle", "background"], "objects": []}
    document = results.finish({"results": found}, session)
    assert (document["provenance"]["selection"]["seed"], document["provenance"]["steps"]) == (5, 1)


def test_a_reset_begins_another_episode_with_all_its_budgets(make: Make) -> None:
    env = make(max_simulated_time_s=2.0)
    for _ in range(2):
        env.reset(seed=5)
        assert not env.step(FORWARD)[3]
        spent = task_env(env).session.progress.spent
        assert (spent.steps, spent.restarts) == (1, 0)


@pytest.mark.parametrize(
    ("action", "why"),
    [
        ({"action": 2, "argument": [0.0]}, "There is no action 2"),
        ({"action": 0, "argument": [1.5]}, "not between -1 and 1"),
        ({"action": 0, "argument": [np.nan]}, "not between -1 and 1"),
        ({"argument": [0.0]}, "cannot be read"),
        (3, "cannot be read"),
        ({"action": 0, "argument": [0.1, 0.2]}, "cannot be read"),
    ],
)
def test_a_wrong_action_is_refused_and_moves_nothing(make: Make, action: Any, why: str) -> None:
    env = make()
    env.reset()
    with pytest.raises(BenchbotError, match="is not an action of this environment") as caught:
        env.step(action)
    assert why in caught.value.why
    assert env.step(FORWARD)[4]["steps"] == 1


@pytest.mark.parametrize(
    ("choices", "title"),
    [
        ({"task": "sample:actve"}, "'sample:actve' is not a known task"),
        ({"env": []}, "There is no environment"),
        ({"env": ["arena:1", "arena:9"]}, "'arena:9' is not a known environment"),
        ({"robot": "sample_real_robot"}, "is a real one"),
        ({"reward": "covrage"}, "'covrage' is not a known reward"),
        ({"reward": 3.0}, "is not a reward"),
        ({"image_size": (64, 64)}, "cannot be resized"),
    ],
)
def test_an_impossible_choice_is_refused_at_once(make: Make, choices: dict[str, Any], title: str) -> None:
    with pytest.raises(BenchbotError, match=title):
        make(**choices)


def test_settings_change_every_environment_and_are_in_the_result(make: Make) -> None:
    env = make(env=["arena:1", "arena:2"], settings={"lighting.time": "21:30"})
    env.reset(seed=1)

    session = task_env(env).session
    assert [scene.environment["lighting"] for scene in session.scenes] == [{"time": "21:30"}]
    assert session.selection.settings == {"lighting.time": "21:30"}
    with pytest.raises(BenchbotError, match="A run cannot set 'map_path'"):
        make(settings={"map_path": "other.yaml"})


def test_an_unknown_option_of_reset_is_refused(make: Make) -> None:
    with pytest.raises(BenchbotError, match="no option 'environment'"):
        make().reset(options={"environment": "arena:1"})


EPISODE = """
import hashlib, sys
import gymnasium
from benchbot.gymnasium import DiscreteMoves
env = DiscreteMoves(gymnasium.make("benchbot/Task-v0", task="sample:noisy", robot="sample_robot", env="arena:1"))
env.action_space.seed(3)
digest = hashlib.sha256()
for seed in (int(sys.argv[1]), None):
    observation, info = env.reset(seed=seed)
    for _ in range(4):
        observation, *_ = env.step(env.action_space.sample())
        for name in sorted(observation):
            digest.update(observation[name].tobytes())
print(digest.hexdigest())
"""


def test_a_seed_means_the_same_in_every_process() -> None:
    def episodes(seed: int) -> str:
        command = [sys.executable, "-c", EPISODE, str(seed)]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert episodes(1) == episodes(1) != episodes(2)


def test_without_gymnasium_the_error_says_how_to_get_it() -> None:
    code = "import sys; sys.modules['gymnasium'] = None; import benchbot.gymnasium"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "pip install 'benchbot[gym]'" in done.stderr


def test_gymnasium_knows_the_environments_by_module_and_name() -> None:
    code = (
        "import gymnasium, json; kwargs = dict(task='sample:active', robot='sample_robot', env='arena:1');"
        "gymnasium.make('benchbot.gymnasium:benchbot/Task-v0', **kwargs);"
        "print(json.dumps(sorted(name for name in gymnasium.registry if name.startswith('benchbot/'))))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = ("Exploration", "PointGoal", "SceneChange", "SemanticSlam", "Task")
    assert json.loads(done.stdout) == [f"benchbot/{name}-v0" for name in names]
