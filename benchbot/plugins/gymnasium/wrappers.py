"""Other choices of actions: a handful of fixed moves, and velocities."""

import math
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from benchbot.core.errors import BenchbotError
from benchbot.plugins.gymnasium.commands import NEXT_SCENE, Move, Velocity
from benchbot.plugins.gymnasium.environment import Info, TaskEnv
from benchbot.plugins.gymnasium.spaces import Arrays


class DiscreteMoves(gymnasium.ActionWrapper[Arrays, int, Any], RecordConstructorArgs):
    """Discrete actions: forward, turn left, turn right, next pose, next scene, as far as the task has them.

    `moves` says what each number does; `action_mask` in the info says which are available now.
    """

    def __init__(self, env: gymnasium.Env[Arrays, Any], forward_m: float = 0.25, turn_deg: float = 15.0) -> None:
        RecordConstructorArgs.__init__(self, forward_m=forward_m, turn_deg=turn_deg)
        super().__init__(env)
        offered = (
            Move("move_distance", forward_m),
            Move("move_angle", turn_deg),
            Move("move_angle", -turn_deg),
            Move("move_next"),
            Move(NEXT_SCENE),
        )
        names = _task_env(env).action_names
        self.moves = tuple(move for move in offered if move.action in names)
        self._numbers = np.array([names.index(move.action) for move in self.moves])
        self.action_space = cast(gymnasium.Space[int], spaces.Discrete(len(self.moves)))

    def action(self, action: int) -> Move:
        """Return the move of that number; raises BenchbotError when there is none."""
        number = int(action)
        if not 0 <= number < len(self.moves):
            raise BenchbotError(
                f"There is no move {number}.",
                f"The moves: {', '.join(f'{i} {move.action} {move.argument:g}' for i, move in enumerate(self.moves))}.",
                "Take an element of env.action_space.",
            )
        return self.moves[number]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Arrays, Info]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, self._masked(info)

    def step(self, action: int) -> tuple[Arrays, Any, bool, bool, Info]:
        """Take the move of that number."""
        observation, reward, terminated, truncated, info = super().step(action)
        return observation, reward, terminated, truncated, self._masked(info)

    def _masked(self, info: Info) -> Info:
        return {**info, "action_mask": info["action_mask"][self._numbers]}


class VelocityControl(gymnasium.ActionWrapper[Arrays, NDArray[np.float32], Any], RecordConstructorArgs):
    """Continuous actions [m/s along +x, rad/s about +z], held for `period_s`, within the robot's limits.

    The robot does not stop between steps, nor before it touches something. It is no action that a task offers: what is
    learnt this way drives the simulator, not a scored run. `gymnasium.wrappers.RescaleAction` brings it to [-1, 1].
    """

    def __init__(self, env: gymnasium.Env[Arrays, Any], period_s: float = 0.2) -> None:
        RecordConstructorArgs.__init__(self, period_s=period_s)
        super().__init__(env)
        task_env = _task_env(env)
        if "move_distance" not in task_env.action_names:
            raise BenchbotError(
                "This task does not let the robot drive freely.",
                f"Its actions: {', '.join(task_env.action_names)}.",
                "Choose an active task.",
            )
        if not 0 < period_s < math.inf:
            raise BenchbotError(
                f"The period is {period_s!r}.", "It must be a positive number of seconds.", "Pass period_s=0.2"
            )
        self._period_s = period_s
        motion = task_env.motion
        backwards_mps, forwards_mps = (limit * motion.speed_factor for limit in motion.linear_limits_mps)
        turn_radps = motion.angular_limit_radps * motion.speed_factor
        self.action_space = spaces.Box(
            np.array([backwards_mps, -turn_radps], np.float32), np.array([forwards_mps, turn_radps], np.float32)
        )

    def action(self, action: NDArray[np.float32]) -> Velocity:
        """Return the velocity to hold; raises BenchbotError when it is not two finite numbers."""
        values = np.asarray(action, np.float64)
        if values.shape != (2,) or not np.isfinite(values).all():
            raise BenchbotError(
                f"{action!r} is not a velocity.",
                "It must be two finite numbers: m/s along +x, rad/s about +z.",
                "Take an element of env.action_space.",
            )
        return Velocity(float(values[0]), float(values[1]), self._period_s)


def _task_env(env: gymnasium.Env[Any, Any]) -> TaskEnv:
    inner = env.unwrapped
    if not isinstance(inner, TaskEnv):
        raise BenchbotError(
            f"{env} is not an environment of BenchBot.",
            "Its actions mean something else.",
            'Wrap one that was made by gymnasium.make("benchbot/…").',
        )
    return inner
