from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import RescaleAction

from benchbot.core.errors import BenchbotError
from benchbot.gymnasium import DiscreteMoves, Move, VelocityControl

Make = Callable[..., gymnasium.Env[Any, Any]]


def test_discrete_moves_go_forward_and_turn(make: Make) -> None:
    env = DiscreteMoves(make(), forward_m=0.5, turn_deg=90)
    assert env.action_space == gymnasium.spaces.Discrete(3)
    _, info = env.reset(seed=0)
    assert list(info["action_mask"]) == [1, 1, 1]
    for action in (1, 0, 2, 0):
        info = env.step(action)[4]
    assert info["pose_xyyaw"] == pytest.approx([-1.5, 0.5, 0.0], abs=0.05)


def test_discrete_moves_are_those_of_the_task(make: Make) -> None:
    env = DiscreteMoves(make(task="sample:two_scenes", env="arena:1:2"))
    assert env.moves == (Move("move_next"), Move("next_scene"))
    env.reset()
    for _ in range(3):
        info = env.step(0)[4]
    assert list(info["action_mask"]) == [0, 1]
    with pytest.raises(BenchbotError, match="There is no move 2"):
        env.step(2)


def test_time_limits_count_moves(make: Make) -> None:
    env = DiscreteMoves(make(max_episode_steps=2))
    env.reset()
    assert [env.step(1)[3] for _ in range(2)] == [False, True]


def test_velocities_are_held_for_a_period(make: Make) -> None:
    env = VelocityControl(make(), period_s=0.5)
    assert env.action_space == gymnasium.spaces.Box(
        np.array([-0.6, -1.0], np.float32), np.array([1.5, 1.0], np.float32)
    )
    env.reset()
    for _ in range(2):
        _, _, terminated, _, info = env.step(np.array([0.4, 0.0], np.float32))
    assert (terminated, info["outcome"], info["steps"]) == (False, "driven", 2)
    # Accelerating at 2 m/s² costs v² / 2a of the way.
    assert info["pose_xyyaw"][0] == pytest.approx(-2 + 0.4 - 0.04, abs=0.01)
    assert info["simulated_time_s"] == pytest.approx(1.0)


def test_velocities_can_be_rescaled_and_end_in_a_collision(make: Make) -> None:
    env = RescaleAction(VelocityControl(make(reward="collision")), np.float32(-1), np.float32(1))
    env.reset()
    for _ in range(30):
        _, reward, terminated, _, _ = env.step(np.array([1.0, 0.0], np.float32))
        if terminated:
            break
    assert (terminated, reward) == (True, -1.0)


@pytest.mark.parametrize("action", [[0.1], [np.nan, 0.0], [0.1, 0.2, 0.3]])
def test_a_wrong_velocity_is_refused(make: Make, action: list[float]) -> None:
    env = VelocityControl(make())
    env.reset()
    with pytest.raises(BenchbotError, match="is not a velocity"):
        env.step(np.array(action))


def test_wrappers_refuse_what_they_cannot_drive(make: Make) -> None:
    with pytest.raises(BenchbotError, match="does not let the robot drive freely"):
        VelocityControl(make(task="sample:passive"))
    with pytest.raises(BenchbotError, match="period"):
        VelocityControl(make(), period_s=0.0)
    with pytest.raises(BenchbotError, match="is not an environment of BenchBot"):
        DiscreteMoves(gymnasium.make("CartPole-v1"))
