"""Environments that are stepped as arrays, as Stable-Baselines3 takes them (its `VecEnv`)."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from benchbot.core.errors import BenchbotError

try:
    from stable_baselines3.common.vec_env import VecEnv
except ModuleNotFoundError as missing:
    raise BenchbotError(
        "Stable-Baselines3 is not installed.",
        f"Its VecEnv is what these environments are to be: {missing}.",
        "Install it: pip install stable-baselines3",
    ) from missing


class StableBaselinesEnv(VecEnv):  # type: ignore[misc]  # it is not installed where types are checked
    """`envs` of `gymnasium.make_vec`, stepped as arrays, with `AutoresetMode.SAME_STEP`.

    As Stable-Baselines3 has it, the observation of an environment that has ended is already that of its next episode;
    its info has `terminal_observation`, `TimeLimit.truncated`, `episode` (as `Monitor` tells it: return `r`, length
    `l`) and all that it would say otherwise. Infos of environments that go on say only `TimeLimit.truncated`.
    `env_method("action_masks")` is what MaskablePPO of sb3-contrib asks for.
    """

    def __init__(self, envs: gymnasium.vector.VectorEnv[Any, Any, Any]) -> None:
        if envs.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
            raise BenchbotError(
                "Stable-Baselines3 takes environments that start again in the step in which they have ended.",
                f"These have the autoreset mode {envs.metadata.get('autoreset_mode')}.",
                "Make them with gymnasium.make_vec(…, autoreset_mode=AutoresetMode.SAME_STEP).",
            )
        self.envs = envs
        self._returns, self._lengths = np.zeros(envs.num_envs), np.zeros(envs.num_envs, np.int64)
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> dict[str, NDArray[Any]]:
        """Start an episode in every environment, from the seeds that `seed` was told."""
        seeds = None if all(seed is None for seed in self._seeds) else self._seeds
        observations: dict[str, NDArray[Any]] = self.envs.reset(seed=seeds)[0]
        self._reset_seeds()
        self._reset_options()
        self._returns[:], self._lengths[:] = 0.0, 0
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[dict[str, NDArray[Any]], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Execute every environment's action to its end."""
        observations, rewards, terminated, truncated, infos = self.envs.step(self._actions)
        ended = terminated | truncated
        self._returns += rewards
        self._lengths += 1
        told: list[dict[str, Any]] = [{"TimeLimit.truncated": False} for _ in range(self.num_envs)]
        last = {name: rows for name, rows in infos.get("final_info", {}).items() if not name.startswith("_")}
        for number in np.flatnonzero(ended).tolist():
            told[number] = {
                **{name: rows[number] for name, rows in last.items()},
                "TimeLimit.truncated": bool(truncated[number] and not terminated[number]),
                "terminal_observation": infos["final_obs"][number],
                "episode": {"r": float(self._returns[number]), "l": int(self._lengths[number])},
            }
        self._returns[ended], self._lengths[ended] = 0.0, 0
        return observations, rewards.astype(np.float32), ended, told

    def close(self) -> None:
        """Close the environments."""
        self.envs.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return the pictures of all robots' cameras when the `render_mode` is "rgb_array"."""
        pictures: Any = self.envs.render()
        return [None] * self.num_envs if pictures is None else list(pictures)

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute, which is that of all environments, once for each."""
        value = getattr(self.envs, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of all environments."""
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Call a method whose result has a row for each environment; return the rows."""
        rows = getattr(self.envs, method_name)(*method_args, **method_kwargs)
        return [rows[number] for number in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Any = None) -> list[bool]:
        """Say that none has a wrapper, but for what tells the return and length of episodes."""
        return [wrapper_class.__name__ == "Monitor" for _ in self._get_indices(indices)]
