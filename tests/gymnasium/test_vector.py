from typing import Any

import gymnasium
import numpy as np

from benchbot.gymnasium import DiscreteMoves

SAMPLE: dict[str, Any] = {"task": "sample:noisy", "robot": "sample_robot", "env": "arena:1", "reward": "coverage"}


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
