"""Many environments in one process: each robot moves by itself, and all of them look together.

Each call of an environment runs in a greenlet of its own until it asks for observations. When all have asked, the
simulator works out everybody's at once, and each call goes on to its end. So rewards, wrappers and the session know
nothing of it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.vector import SyncVectorEnv
from gymnasium.vector.utils import iterate
from gymnasium.wrappers import TimeLimit
from numpy.typing import NDArray

from benchbot.core.digest import ObservationDigest
from benchbot.core.errors import BenchbotError
from benchbot.core.host import InProcessHost
from benchbot.core.platform import ManyCameras, Platform, PlatformSpec
from benchbot.core.selection import Selection
from benchbot.plugins.gymnasium.environment import Info, TaskEnv
from benchbot.plugins.gymnasium.spaces import Arrays

try:
    from greenlet import getcurrent, greenlet
except ModuleNotFoundError as missing:
    raise BenchbotError(
        "greenlet is not installed.",
        f"Environments that run together need it: {missing}.",
        "Install it: pip install 'benchbot[gym]', or pass vectorization_mode=\"sync\".",
    ) from missing

Wrap = Callable[[gymnasium.Env[Any, Any]], gymnasium.Env[Any, Any]]
Call = Callable[[], Any]


class TaskVectorEnv(SyncVectorEnv):
    """`num_envs` environments whose robots share one loaded scene, and whose pictures are rendered together.

    Steps, resets, seeds and infos are those of `gymnasium.vector.SyncVectorEnv`, to the byte; an environment that has
    ended starts again at the next step. `env_wrappers` go around each environment, as the `wrappers` of `make_vec`,
    which Gymnasium does not pass on to this mode. `choices` are the arguments of `TaskEnv`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        env_wrappers: Sequence[Wrap] = (),
        max_episode_steps: int | None = None,
        **choices: Any,
    ) -> None:
        if num_envs < 1:
            raise BenchbotError(
                f"{num_envs} environments are none.", "There must be one at least.", "Pass num_envs=16, for example."
            )
        fleet: list[_SharingEnv] = []
        self._ended = np.zeros(num_envs, bool)

        def make() -> gymnasium.Env[Any, Any]:
            env: gymnasium.Env[Any, Any] = _SharingEnv(fleet, **choices)
            if max_episode_steps is not None:
                env = TimeLimit(env, max_episode_steps)
            for wrap in env_wrappers:
                env = wrap(env)
            return _Ahead(env)

        super().__init__([make] * num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, Info]:
        """Start an episode in every environment, or where `options` {"reset_mask": (num_envs,) bool} says so."""
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        each = None if options is None else {name: value for name, value in options.items() if name != "reset_mask"}
        chosen = np.asarray((options or {}).get("reset_mask", np.ones(self.num_envs, bool)))
        # What is malformed is refused below, in Gymnasium's words.
        if len(seeds) == self.num_envs and chosen.shape == (self.num_envs,) and chosen.dtype == np.bool_:
            resets = zip(self._ahead(), seeds, chosen, strict=True)
            self._run(
                {env: partial(env.env.reset, seed=own, options=each) for env, own, is_reset in resets if is_reset}
            )
        observations, infos = super().reset(seed=seed, options=options)
        self._ended = self._ended & ~chosen
        return observations, infos

    def step(self, actions: Any) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Take every environment's action to its end, then observe all of them."""
        taken = zip(self._ahead(), self._ended, iterate(self.action_space, actions), strict=True)
        self._run({env: env.env.reset if ended else partial(env.env.step, action) for env, ended, action in taken})
        observations, rewards, terminated, truncated, infos = super().step(actions)
        self._ended = terminated | truncated
        return observations, rewards, terminated, truncated, infos

    def _ahead(self) -> list["_Ahead"]:
        return [env for env in self.envs if isinstance(env, _Ahead)]

    def _run(self, calls: Mapping["_Ahead", Call]) -> None:
        for env, result in zip(calls, _side_by_side(list(calls.values())), strict=True):
            env.result = result


class _Ahead(gymnasium.Wrapper[Arrays, Any, Arrays, Any]):
    """Answers a call with the result that was worked out ahead of it."""

    result: Any = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        result, self.result = self.result, None
        return super().reset(seed=seed, options=options) if result is None else result

    def step(self, action: Any) -> Any:
        result, self.result = self.result, None
        return super().step(action) if result is None else result


@dataclass(frozen=True)
class _Question:
    platform: Platform
    channels: tuple[str, ...]


class _Turn(greenlet):
    """A call that stops wherever it asks a `_Question`."""


def _side_by_side(calls: Sequence[Call]) -> list[Any]:
    """Return what calls return; what they wait for at the same time is observed together."""
    turns = [_Turn(call) for call in calls]
    said = [turn.switch() for turn in turns]
    while waiting := [i for i, turn in enumerate(turns) if not turn.dead]:
        for i, answer in zip(waiting, _observe([said[i] for i in waiting]), strict=True):
            said[i] = turns[i].switch(answer)
    return said


def _observe(questions: Sequence[_Question]) -> list[dict[str, Any]]:
    first, channels = questions[0].platform, questions[0].channels
    if isinstance(first, ManyCameras):
        twins: list[Any] = [question.platform for question in questions]
        return first.observe_many(twins, channels)
    return [question.platform.observe(channels) for question in questions]


class _AskingHost(InProcessHost):
    def observe(self, channels: Iterable[str]) -> dict[str, Any]:
        turn = getcurrent()
        if not isinstance(turn, _Turn) or turn.parent is None:
            return super().observe(channels)
        observations: dict[str, Any] = turn.parent.switch(_Question(self._platform, tuple(channels)))
        return observations


class _NoDigest(ObservationDigest):
    def update(self, observations: Mapping[str, Any]) -> None:
        pass

    def hexdigest(self) -> NoReturn:
        raise BenchbotError(
            "This episode has no digest of its observations.",
            "It is one of many that run together, where digests would take longer than the pictures.",
            'Run the episode that counts in an environment of gymnasium.make("benchbot/…").',
        )


class _SharingEnv(TaskEnv):
    """One of a fleet of environments, of the same choices, that share what a scene needs."""

    _host_type = _AskingHost
    _digest_type = _NoDigest

    def __init__(self, fleet: list["_SharingEnv"], **choices: Any) -> None:
        super().__init__(**choices)
        self._fleet = fleet
        fleet.append(self)

    def _start(self, selection: Selection, spec: PlatformSpec) -> Platform:
        for other in self._fleet:
            if isinstance(other._platform, ManyCameras):
                return other._platform.twin()
        return super()._start(selection, spec)
