from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import RecordEpisodeStatistics

from benchbot.core.errors import BenchbotError
from benchbot.gymnasium import DiscreteMoves, VelocityControl
from benchbot.plugins.gymnasium.arrays import ArrayVectorEnv
from benchbot.plugins.gymnasium.vector import TaskVectorEnv

SAMPLE: dict[str, Any] = {"task": "sample:noisy", "robot": "sample_robot", "env": "arena:1", "reward": "coverage"}
COLLIDE = {"action": np.array([0, 0, 1]), "argument": np.array([[1.0], [0.1], [0.2]], np.float32)}
together: Callable[..., Any] = partial(gymnasium.make_vec, vectorization_mode="vector_entry_point")
one_by_one: Callable[..., Any] = partial(gymnasium.make_vec, vectorization_mode="sync")


def plain(value: Any) -> Any:
    """Everything that a vector environment returns, as something that compares."""
    if isinstance(value, dict):
        return {key: plain(value[key]) for key in sorted(value)}
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value] if value.dtype == object else (value.dtype.str, value.tolist())
    return [plain(item) for item in value] if isinstance(value, tuple) else value


def test_four_environments_step_together() -> None:
    envs = gymnasium.make_vec("benchbot/Task-v0", 4, "sync", **SAMPLE)
    observations, infos = envs.reset(seed=3)
    assert observations["image_rgb"].shape == (4, 32, 48, 3)
    assert list(infos["seed"]) == [3, 4, 5, 6]
    envs.action_space.seed(0)
    for _ in range(3):
        observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
    assert rewards.shape == terminated.shape == truncated.shape == (4,)
    assert envs.observation_space.contains(observations)
    envs.close()


def test_an_environment_that_has_ended_starts_again() -> None:
    envs = gymnasium.make_vec(
        "benchbot/Task-v0", 2, "sync", wrappers=[DiscreteMoves], **{**SAMPLE, "max_episode_steps": 2}
    )
    envs.reset(seed=0)
    steps = [envs.step(np.array([1, 2]))[4]["steps"].tolist() for _ in range(4)]
    assert steps == [[1, 1], [2, 2], [0, 0], [1, 1]]
    envs.close()


def test_processes_of_their_own_see_the_same() -> None:
    seen = []
    for mode, more in (("sync", {}), ("async", {"context": "spawn"})):
        envs = gymnasium.make_vec("benchbot/Task-v0", 2, mode, more, [DiscreteMoves], **SAMPLE)
        envs.reset(seed=3)
        observations, rewards, *_ = envs.step(np.array([0, 1]))
        seen.append((observations["image_depth"].tobytes(), observations["pose_base_link"].tobytes(), rewards.tolist()))
        envs.close()
    assert seen[0] == seen[1]


def test_together_is_the_default() -> None:
    envs = gymnasium.make_vec("benchbot/Task-v0", 2, **SAMPLE)
    assert isinstance(envs, TaskVectorEnv)
    envs.close()


@pytest.mark.parametrize("environments", ["arena:1", ["arena:1", "arena:2"]])
def test_together_is_the_same_as_one_by_one(environments: Any) -> None:
    """Two episodes: one ends by a collision, all end by the time limit, and each starts again by itself."""
    choices = {**SAMPLE, "env": environments, "max_episode_steps": 3, "largest_distance_m": 9.0}
    told = []
    for make in (together, one_by_one):
        envs = make("benchbot/Task-v0", 3, **choices)
        told.append([plain(envs.reset(seed=[5, 1, 5]))])
        told[-1] += [plain(envs.step(COLLIDE)) for _ in range(6)]
        told[-1] += [plain(envs.reset()), plain(envs.step(COLLIDE))]
        envs.close()
    assert told[0] == told[1]
    _, _, terminated, truncated, _ = told[0][1]
    assert (terminated[1], truncated[1]) == ([True, False, False], [False, False, False])


def test_wrappers_go_around_each_environment() -> None:
    wrappers: list[Any] = [partial(DiscreteMoves, turn_deg=30), RecordEpisodeStatistics]
    told = []
    for envs in (
        together("benchbot/Task-v0", 2, env_wrappers=wrappers, max_episode_steps=1, **SAMPLE),
        one_by_one("benchbot/Task-v0", 2, wrappers=wrappers, max_episode_steps=1, **SAMPLE),
    ):
        envs.reset(seed=1)
        *_, infos = envs.step(np.array([0, 2]))
        infos["episode"].pop("t")
        told.append(plain(infos))
        envs.close()
    assert told[0] == told[1]
    assert told[0]["episode"]["l"][1] == [1, 1]


def test_velocities_are_held_side_by_side() -> None:
    envs = together("benchbot/Task-v0", 2, env_wrappers=[VelocityControl], **SAMPLE)
    envs.reset(seed=1)
    *_, infos = envs.step(np.array([[0.2, 0.0], [0.0, 0.5]], np.float32))
    assert infos["outcome"].tolist() == ["driven", "driven"]
    envs.close()


def test_a_mask_chooses_what_is_reset() -> None:
    envs = together("benchbot/Task-v0", 2, env_wrappers=[DiscreteMoves], **SAMPLE)
    envs.reset(seed=1)
    envs.step(np.array([1, 1]))
    envs.reset(options={"reset_mask": np.array([True, False])})
    *_, infos = envs.step(np.array([1, 1]))
    assert infos["steps"].tolist() == [1, 2]
    envs.close()


@pytest.mark.parametrize(
    "wrong", [{"seed": [1]}, {"options": {"reset_mask": np.ones(3, bool)}}, {"options": {"reset_mask": np.zeros(2)}}]
)
def test_a_malformed_reset_is_refused_and_moves_nothing(wrong: dict[str, Any]) -> None:
    envs = together("benchbot/Task-v0", 2, env_wrappers=[DiscreteMoves], **SAMPLE)
    envs.reset(seed=1)
    envs.step(np.array([1, 1]))
    with pytest.raises((ValueError, TypeError, AssertionError)):  # by version of Gymnasium
        envs.reset(**wrong)
    assert envs.step(np.array([1, 1]))[4]["steps"].tolist() == [2, 2]
    envs.close()


def test_a_wrong_action_of_one_is_explained_and_a_reset_goes_on() -> None:
    envs = together("benchbot/Task-v0", 2, **SAMPLE)
    first, _ = envs.reset(seed=1)
    with pytest.raises(BenchbotError, match="is not an action"):
        envs.step({"action": np.array([1, 7]), "argument": np.zeros((2, 1), np.float32)})
    again, _ = envs.reset(seed=1)
    assert plain(first) == plain(again)
    envs.close()


@pytest.mark.parametrize("count", [0, -1])
def test_no_environments_are_refused(count: int) -> None:
    with pytest.raises(BenchbotError, match=f"{count} environments"):
        together("benchbot/Task-v0", count, **SAMPLE)


def test_an_episode_of_many_has_no_digest() -> None:
    envs = together("benchbot/Task-v0", 1, **SAMPLE)
    envs.reset(seed=1)
    with pytest.raises(BenchbotError, match="no digest"):
        envs.envs[0].unwrapped.session.digest.hexdigest()
    envs.close()


@pytest.mark.slow
@pytest.mark.xdist_group("renderer")
def test_pictures_that_are_rendered_together_are_the_same(kernel_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    told = []
    for make in (together, one_by_one):
        envs = make("benchbot/SemanticSlam-v0", 3, image_size=(64, 64), reward="coverage")
        told.append([plain(envs.reset(seed=2))])
        turn = {"action": np.array([0, 1, 1]), "argument": np.array([[0.1], [0.5], [-1.0]], np.float32)}
        told[-1] += [plain(envs.step(turn)) for _ in range(2)]
        assert isinstance(envs, ArrayVectorEnv) is (make is together)
        envs.close()
    assert told[0] == told[1]
