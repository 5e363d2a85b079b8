"""Environments that are stepped as arrays are those of Gymnasium's own loop, to the byte."""

import importlib
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
import yaml
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from benchbot.core.errors import BenchbotError
from benchbot.gymnasium import DiscreteMoves
from benchbot.plugins.gymnasium import MOVES
from benchbot.plugins.gymnasium.arrays import ArrayVectorEnv
from benchbot.plugins.gymnasium.environment import TaskEnv
from benchbot.plugins.gymnasium.vector import TaskVectorEnv
from tests.plugin_factory import PluginFactory
from tests.plugins.gymnasium.test_vector import plain
from tests.plugins.simulation.test_kinematic import HALL, ROBOT

IMU = {"frame": "lidar", "noise": {"angular_velocity_sigma_radps": 0.01}}
PLUGIN = """
from importlib.resources import files
from benchbot.plugin import Simulator, hookimpl

@hookimpl
def benchbot_robots():
    yield files(__name__) / "robots"

@hookimpl
def benchbot_environments():
    yield files(__name__) / "environments"

@hookimpl
def benchbot_episodes():
    yield files(__name__) / "episodes"

@hookimpl
def benchbot_simulators():
    from tests.plugins.simulation.test_kinematic import HallSimulator
    yield Simulator("hall", HallSimulator)
"""
EPISODES = """
{"task": "point_goal", "environment": "hall:1", "version": 1, "robot_radius_m": 0.3, "success_distance_m": 0.36,
 "episodes": [
  {"id": "one", "start_pose": [1, 0, 0, 0, 0, 0, 0], "goal": {"position": [0.9, 0, 0]}, "shortest_path_m": 0.9},
  {"id": "two", "start_pose": [1, 0, 0, 0, -1, 0.5, 0], "goal": {"position": [0.1, 0.5, 0]}, "shortest_path_m": 1.1}]}
"""
together: Callable[..., Any] = partial(gymnasium.make_vec, vectorization_mode="vector_entry_point")
one_by_one: Callable[..., Any] = partial(gymnasium.make_vec, vectorization_mode="sync")


@pytest.fixture(autouse=True)
def _hall(plugin_factory: PluginFactory) -> None:
    robot = {**ROBOT, "name": "disc", "type": "hall", "imu": IMU}
    plugin_factory.make(
        "hall-robots",
        PLUGIN,
        {
            "robots/disc.yaml": yaml.safe_dump(robot),
            "environments/hall.yaml": yaml.safe_dump({**HALL, "object_labels": ["chair"]}),
            "episodes/hall.json": EPISODES,
        },
    )


GOAL: dict[str, Any] = {"task": "sample:goal", "robot": "disc", "env": "hall:1"}
SEEN: dict[str, Any] = {"task": "sample:active", "robot": "disc", "env": "hall:1"}
NOISY: dict[str, Any] = {"task": "sample:noisy", "robot": "disc", "env": "hall:1"}
FORWARD = {"action": np.array([0, 1, 0]), "argument": np.array([[1.0], [0.4], [-0.7]], np.float32)}


@pytest.mark.parametrize(
    ("choices", "reward"),
    [
        (SEEN, "coverage"),
        (NOISY, None),
        (GOAL, {"point_goal": 1, "collision": 10}),
    ],
)
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_arrays_are_the_same_as_one_by_one(choices: dict[str, Any], reward: Any, mode: AutoresetMode) -> None:
    told = []
    for make, more in (
        (together, {"autoreset_mode": mode}),
        (one_by_one, {"vector_kwargs": {"autoreset_mode": mode}}),
    ):
        envs = make("benchbot/Task-v0", 3, reward=reward, max_episode_steps=4, **{**choices, **more})
        assert isinstance(envs, ArrayVectorEnv) is (make is together)
        told.append([plain(envs.reset(seed=[5, 1, 5]))])
        told[-1] += [plain(envs.step(FORWARD)) for _ in range(6)]
        told[-1] += [plain(envs.reset()), plain(envs.step(FORWARD))]
        envs.close()
    for here, there in zip(*told, strict=True):
        assert here == there


def test_discrete_moves_are_numbers() -> None:
    told = []
    wrapped = together("benchbot/Task-v0", 2, env_wrappers=[partial(DiscreteMoves, turn_deg=30)], **GOAL)
    apart = one_by_one("benchbot/Task-v0", 2, wrappers=[partial(DiscreteMoves, turn_deg=30)], **GOAL)
    assert isinstance(wrapped, ArrayVectorEnv)
    for envs in (wrapped, apart):
        told.append([plain(envs.reset(seed=1)), plain(envs.step(np.array([0, 2])))])
        envs.close()
    assert told[0] == told[1]
    with pytest.raises(BenchbotError, match="no move 7"):
        wrapped.step(np.array([0, 7]))


@pytest.mark.parametrize("count", [1, 5])
def test_a_seed_gives_the_same_bytes_among_any_number(count: int) -> None:
    envs = together("benchbot/Task-v0", count, moves=MOVES, **NOISY)
    alone = gymnasium.make("benchbot/Task-v0", moves=MOVES, **NOISY)
    observation, _ = alone.reset(seed=3)
    observations, _ = envs.reset(seed=3)
    for number in (0, 1, 0):
        assert {name: rows[0].tobytes() for name, rows in observations.items()} == {
            name: row.tobytes() for name, row in observation.items()
        }
        observation, *_ = alone.step(number)
        observations, *_ = envs.step(np.full(count, number))
    envs.close()


def test_disabled_autoreset_waits_for_a_reset_of_those_that_ended() -> None:
    envs = together("benchbot/Task-v0", 2, moves=MOVES, autoreset_mode=AutoresetMode.DISABLED, **GOAL)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.DISABLED
    envs.reset(seed=[0, 0], options={"episode": 0})
    ahead_and_left = np.array([0, 1])
    for _ in range(3):
        *_, terminated, truncated, infos = envs.step(ahead_and_left)
    assert (terminated.tolist(), infos["is_success"].tolist()) == ([True, False], [True, False])
    with pytest.raises(BenchbotError, match="autoreset is disabled"):
        envs.step(ahead_and_left)
    before = envs._observations["laser"][1].copy()
    observations, infos = envs.reset(options={"reset_mask": terminated | truncated, "episode": 1})
    assert (infos["episode"].tolist(), infos["_episode"].tolist()) == ([1, 0], [True, False])
    assert observations["laser"][1].tobytes() == before.tobytes()
    *_, infos = envs.step(ahead_and_left)
    assert infos["steps"].tolist() == [1, 4]


def test_arriving_is_worth_more_than_the_way_there() -> None:
    env = gymnasium.make("benchbot/Task-v0", moves=MOVES, reward="point_goal", episode=0, **GOAL)
    _, info = env.reset(seed=0)
    rewards, terminated = [], False
    left_m = [info["distance_to_goal_m"]]
    while not terminated:
        _, reward, terminated, _, info = env.step(0)
        rewards.append(reward)
        left_m.append(info["distance_to_goal_m"])
    assert left_m[0] == 0.9
    assert left_m[-1] <= 0.36 < left_m[-2]
    assert rewards == pytest.approx([*(-np.diff(left_m[:-1]) - 0.01), left_m[-2] - left_m[-1] - 0.01 + 2.5])


def test_episodes_are_drawn_by_the_seed() -> None:
    env = gymnasium.make("benchbot/Task-v0", **GOAL)
    drawn = [env.reset(seed=seed)[1]["episode"] for seed in range(8)]
    assert set(drawn) == {0, 1}
    assert drawn == [env.reset(seed=seed)[1]["episode"] for seed in range(8)]
    assert env.reset(seed=0, options={"episode": 1})[1]["episode"] == 1
    with pytest.raises(BenchbotError, match="no episode 5"):
        env.reset(options={"episode": 5})


@pytest.mark.parametrize(
    ("choices", "one_by_one"),
    [
        ({}, False),
        ({"reward": lambda transition: 1.0}, True),
        ({"env_wrappers": [gymnasium.wrappers.FlattenObservation]}, True),
    ],
)
def test_what_is_asked_of_each_by_itself_is_stepped_by_itself(choices: dict[str, Any], one_by_one: bool) -> None:
    envs = together("benchbot/Task-v0", 2, **GOAL, **choices)
    assert isinstance(envs, TaskVectorEnv if one_by_one else ArrayVectorEnv)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    envs.close()


@pytest.mark.parametrize(
    ("choices", "why"),
    [
        ({"tensors": "jax"}, "no tensors of 'jax'"),
        ({"tensors": "torch"}, "makes no tensors"),
        ({"tensors": "torch", "reward": lambda transition: 1.0}, "cannot be stepped as tensors"),
    ],
)
def test_tensors_that_cannot_be_are_refused(choices: dict[str, Any], why: str) -> None:
    with pytest.raises(BenchbotError, match=why):
        together("benchbot/Task-v0", 2, **GOAL, **choices)


def test_what_stable_baselines_needs_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.delitem(sys.modules, "benchbot.plugins.gymnasium.stable_baselines", raising=False)
    with pytest.raises(BenchbotError, match="Stable-Baselines3 is not installed"):
        importlib.import_module("benchbot.plugins.gymnasium.stable_baselines")


@pytest.mark.parametrize("wrong", [{"seed": [1]}, {"options": {"reset_mask": np.ones(3, bool)}}])
def test_a_malformed_reset_is_refused(wrong: dict[str, Any]) -> None:
    envs = together("benchbot/Task-v0", 2, **GOAL)
    with pytest.raises(BenchbotError, match="not reset"):
        envs.step(envs.action_space.sample())
    with pytest.raises(BenchbotError, match="first reset"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ValueError, match="2"):
        envs.reset(**wrong)


def test_pictures_are_quick_unless_others_are_asked_for() -> None:
    assert TaskEnv(**SEEN).quality == "fast"
    assert TaskEnv(**SEEN, platform_options={"quality": "realtime"}).quality == "realtime"


def test_nobody_complains_and_masks_are_there() -> None:
    check_env(gymnasium.make("benchbot/Task-v0", moves=MOVES, **GOAL).unwrapped)
    envs = together("benchbot/Task-v0", 3, moves=MOVES, render_mode="rgb_array", **SEEN)
    observations, _ = envs.reset(seed=0)
    assert envs.observation_space.contains(observations)
    assert envs.action_masks().tolist() == [[True] * 3] * 3
    assert envs.render()[2].shape == (16, 24, 3)
    envs.close()


def test_the_registered_ids_say_how_long_episodes_are() -> None:
    specs = {name: gymnasium.spec(f"benchbot/{name}-v0") for name in ("PointGoal", "Exploration")}
    assert {name: spec.max_episode_steps for name, spec in specs.items()} == {"PointGoal": 500, "Exploration": 100}
