"""The choice of how many environments are stepped: as arrays, or each by itself with pictures taken together."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, cast

import gymnasium
from gymnasium.vector import AutoresetMode

from benchbot.core.errors import BenchbotError
from benchbot.core.platform import Many
from benchbot.plugins.gymnasium import many_rewards
from benchbot.plugins.gymnasium.arrays import ArrayVectorEnv
from benchbot.plugins.gymnasium.environment import TaskEnv
from benchbot.plugins.gymnasium.wrappers import DiscreteMoves

Wrap = Callable[[gymnasium.Env[Any, Any]], gymnasium.Env[Any, Any]]


def make(
    num_envs: int = 1,
    *,
    env_wrappers: Sequence[Wrap] = (),
    max_episode_steps: int | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    tensors: str | None = None,
    **choices: Any,
) -> gymnasium.vector.VectorEnv[Any, Any, Any]:
    """Return `num_envs` environments of the same choices, the arguments of `TaskEnv`.

    `env_wrappers` go around each environment, as the `wrappers` of `make_vec`, which Gymnasium does not pass on to this
    mode. They are stepped as arrays where that gives the same (see docs/gymnasium.md), else each by itself, with their
    pictures taken together. With `tensors="torch"`, observations, rewards and ends are tensors where pictures are made.
    """
    if tensors not in (None, "torch"):
        raise BenchbotError(
            f"There are no tensors of {tensors!r}.",
            "Observations are arrays of numpy, or tensors of torch; others take those through DLPack without a copy.",
            'Pass tensors="torch", or leave it out.',
        )
    if num_envs < 1:
        raise BenchbotError(
            f"{num_envs} environments are none.", "There must be one at least.", "Pass num_envs=16, for example."
        )
    mode = AutoresetMode(autoreset_mode)
    discrete = _discrete(env_wrappers)
    one = TaskEnv(**choices)
    reward = many_rewards.make(one.reward_choice, num_envs)
    if reward is not None and _moves_only(one) and (not env_wrappers or (discrete and one.moves is None)):
        platform = one.start()
        robots = platform.many(num_envs) if isinstance(platform, Many) else None
        if robots is not None:
            if discrete:
                one = TaskEnv(**{**choices, "moves": discrete(one).moves})
            return ArrayVectorEnv(one, platform, robots, reward, num_envs, max_episode_steps, mode, tensors is not None)
        platform.close()
    if tensors is not None:
        raise BenchbotError(
            "These environments cannot be stepped as tensors.",
            "Something is asked of each of them by itself: a reward, a wrapper, an action, or physics of its own.",
            "See in docs/gymnasium.md what is stepped as arrays, or leave tensors out.",
        )
    from benchbot.plugins.gymnasium.vector import TaskVectorEnv

    return TaskVectorEnv(
        num_envs, env_wrappers=env_wrappers, max_episode_steps=max_episode_steps, autoreset_mode=mode, **choices
    )


def _discrete(wrappers: Sequence[Wrap]) -> Callable[[TaskEnv], DiscreteMoves] | None:
    """Return the only wrapper, if it chooses discrete actions."""
    if len(wrappers) != 1:
        return None
    (wrap,) = wrappers
    kind = wrap.func if isinstance(wrap, partial) else wrap
    return cast(Callable[[TaskEnv], DiscreteMoves], wrap) if kind is DiscreteMoves else None


def _moves_only(env: TaskEnv) -> bool:
    return set(env.action_names) <= {"move_distance", "move_angle"}
