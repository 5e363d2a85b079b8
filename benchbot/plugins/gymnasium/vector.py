"""Many environments in one process: each robot moves separately, and all of them are observed together.

Each call of an environment runs in a greenlet of its own until it requests observations. When all calls have requested
theirs, the simulator computes them at once, and each call continues to its end. So rewards, wrappers and the session
need not know that environments run together.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import iterate
from gymnasium.wrappers import TimeLimit
from numpy.typing import NDArray

from benchbot.core.channels import Observations
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
Request = tuple[Platform, tuple[str, ...]]
"""A platform, and the channels that are requested of it."""


class TaskVectorEnv(SyncVectorEnv):
    """`num_envs` environments whose robots share one loaded scene, and whose pictures are rendered together.

    Steps, resets, seeds and infos are those of `gymnasium.vector.SyncVectorEnv`, to the byte. `env_wrappers` go around
    each environment, as the `wrappers` of `make_vec`, which Gymnasium does not pass on to this mode.
    `choices` are the arguments of `TaskEnv`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        env_wrappers: Sequence[Wrap] = (),
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        **choices: Any,
    ) -> None:
        siblings: list[_SharingEnv] = []
        self._ended = np.zeros(num_envs, bool)

        def make() -> gymnasium.Env[Any, Any]:
            env: gymnasium.Env[Any, Any] = _SharingEnv(siblings, **choices)
            if max_episode_steps is not None:
                env = TimeLimit(env, max_episode_steps)
            for wrap in env_wrappers:
                env = wrap(env)
            return _Precomputed(env)

        super().__init__([make] * num_envs, autoreset_mode=autoreset_mode)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, Info]:
        """Start an episode in every environment, or where `options` {"reset_mask": (num_envs,) bool} says so."""
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        each = None if options is None else {name: value for name, value in options.items() if name != "reset_mask"}
        chosen = np.asarray((options or {}).get("reset_mask", np.ones(self.num_envs, bool)))
        # Malformed arguments are refused below, in Gymnasium's words.
        if len(seeds) == self.num_envs and chosen.shape == (self.num_envs,) and chosen.dtype == np.bool_:
            resets = zip(self._outermost(), seeds, chosen, strict=True)
            self._run(
                {env: partial(env.env.reset, seed=own, options=each) for env, own, is_reset in resets if is_reset}
            )
        observations, infos = super().reset(seed=seed, options=options)
        self._ended = self._ended & ~chosen
        return observations, infos

    def step(self, actions: Any) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Execute every environment's action to its end, then observe all of them."""
        taken = zip(self._outermost(), self._ended, iterate(self.action_space, actions), strict=True)
        self._run({env: env.env.reset if ended else partial(env.env.step, action) for env, ended, action in taken})
        observations, rewards, terminated, truncated, infos = super().step(actions)
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            self._ended = terminated | truncated
        return observations, rewards, terminated, truncated, infos

    def _outermost(self) -> list["_Precomputed"]:
        return [env for env in self.envs if isinstance(env, _Precomputed)]

    def _run(self, calls: Mapping["_Precomputed", Call]) -> None:
        for env, result in zip(calls, _run_together(list(calls.values())), strict=True):
            env.result = result


class _Precomputed(gymnasium.Wrapper[Arrays, Any, Arrays, Any]):
    """Returns a result that was computed ahead of the call."""

    result: Any = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        result, self.result = self.result, None
        return super().reset(seed=seed, options=options) if result is None else result

    def step(self, action: Any) -> Any:
        result, self.result = self.result, None
        return super().step(action) if result is None else result


class _CallGreenlet(greenlet):
    """A call that pauses wherever it requests observations."""


def _run_together(calls: Sequence[Call]) -> list[Any]:
    """Return the results of calls; observations that they wait for at the same time are made together."""
    greenlets = [_CallGreenlet(call) for call in calls]
    results = [each.switch() for each in greenlets]
    while waiting := [i for i, each in enumerate(greenlets) if not each.dead]:
        for i, observations in zip(waiting, _observe([results[i] for i in waiting]), strict=True):
            results[i] = greenlets[i].switch(observations)
    return results


def _observe(requests: Sequence[Request]) -> list[Observations]:
    first, channels = requests[0]
    if isinstance(first, ManyCameras):
        twins: list[Any] = [platform for platform, _ in requests]
        return first.observe_many(twins, channels)
    return [platform.observe(wanted) for platform, wanted in requests]


class _RequestingHost(InProcessHost):
    def observe(self, channels: Iterable[str]) -> Observations:
        current = getcurrent()
        if not isinstance(current, _CallGreenlet) or current.parent is None:
            return super().observe(channels)
        observations: Observations = current.parent.switch((self._platform, tuple(channels)))
        return observations


class _NoDigest(ObservationDigest):
    def update(self, observations: Mapping[str, object]) -> None:
        pass

    def hexdigest(self) -> NoReturn:
        raise BenchbotError(
            "This episode has no digest of its observations.",
            "It is one of many that run together, where digests would take longer than the pictures.",
            'Run the episode that counts in an environment of gymnasium.make("benchbot/…").',
        )


class _SharingEnv(TaskEnv):
    """One of several environments of the same choices, whose simulators share the loaded scenes."""

    _host_type = _RequestingHost
    _digest_type = _NoDigest

    def __init__(self, siblings: list["_SharingEnv"], **choices: Any) -> None:
        super().__init__(**choices)
        self._siblings = siblings
        siblings.append(self)

    def _start(self, selection: Selection, spec: PlatformSpec) -> Platform:
        for sibling in self._siblings:
            if isinstance(sibling._platform, ManyCameras):
                return sibling._platform.twin()
        return super()._start(selection, spec)
