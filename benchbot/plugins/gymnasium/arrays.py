"""Many environments as arrays: the robots, their sensors, rewards and ends of all of them in one pass.

What each environment does is what `TaskEnv` does, to the byte on processors.
"""

from collections.abc import Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from benchbot.core import randomness
from benchbot.core.channels import GIVEN_BY_EPISODES
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.platform import ManyRobots, ManyTensors, Platform, Scene
from benchbot.core.selection import Selection
from benchbot.plugins.gymnasium import commands
from benchbot.plugins.gymnasium.commands import Move
from benchbot.plugins.gymnasium.environment import Info, TaskEnv
from benchbot.plugins.gymnasium.many_rewards import ManyReward, Transitions
from benchbot.plugins.gymnasium.spaces import Arrays, constants, fitted
from benchbot.plugins.gymnasium.tensors import copied, on_host, put, torch_there

Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]
Returned = tuple[Arrays, NDArray[np.float64], Mask, Mask, Info]


class ArrayVectorEnv(gymnasium.vector.VectorEnv[Arrays, Any, Any]):
    """Environments of one task on one kind of robot. `one` is one of them that is never reset: it knows the choices.

    Steps, resets, seeds and infos are those of `gymnasium.vector.SyncVectorEnv` of `TaskEnv`s. Arrays that are returned
    are the caller's to keep.
    """

    def __init__(
        self,
        one: TaskEnv,
        platform: Platform,
        robots: ManyRobots,
        reward: ManyReward,
        num_envs: int,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        as_tensors: bool = False,
    ) -> None:
        self.num_envs = num_envs
        self.metadata = {**one.metadata, "autoreset_mode": autoreset_mode}
        self.autoreset_mode = autoreset_mode
        self.single_observation_space, self.single_action_space = one.observation_space, one.action_space
        self.observation_space = batch_space(one.observation_space, num_envs)
        self.action_space = batch_space(one.action_space, num_envs)
        self.render_mode = one.render_mode
        self._one, self._platform, self._robots, self._reward = one, platform, robots, reward
        self._horizon = max_episode_steps
        self._selections: list[Selection | None] = [None] * num_envs
        self._randoms: list[np.random.Generator | None] = [None] * num_envs
        self._ended = np.zeros(num_envs, bool)
        self._steps = np.zeros(num_envs, np.int64)
        self._goals: list[commands.Goal | None] = [None] * num_envs
        self._goal_rows, self._goal_places = np.zeros((num_envs, 2)), np.full((num_envs, 3), np.nan)
        self._observations: Arrays = {}
        self._as_tensors = as_tensors
        if as_tensors and not isinstance(robots, ManyTensors):
            raise BenchbotError(
                "This simulator makes no tensors.",
                f"Observations of the robot '{one.robot.get('name')}' are arrays of numpy.",
                "Leave tensors out, or choose a robot of sim_taichi.",
            )

    @property
    def quality(self) -> str | None:
        """As of `TaskEnv`."""
        return self._one.quality

    @property
    def action_names(self) -> tuple[str, ...]:
        """As of `TaskEnv`."""
        return self._one.action_names

    @property
    def robots(self) -> ManyRobots:
        """The robots, by the numbers of the environments."""
        return self._robots

    @property
    def moves(self) -> tuple[Move, ...] | None:
        """As of `TaskEnv`."""
        return self._one.moves

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are available now (N, actions), as MaskablePPO of sb3-contrib asks for."""
        free = ~self._robots.collided
        return np.repeat(free[:, None], len(self._one.numbered), 1)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Arrays, Info]:
        """Start episodes in all environments, or in those of `options` {"reset_mask": (N,)}; as of `TaskEnv`."""
        seeds = self._seeds(seed)
        options = dict(options or {})
        chosen = np.flatnonzero(self._mask(options.pop("reset_mask", None)))
        infos = self._begin(chosen, seeds, options)
        if None in self._selections:
            raise BenchbotError(
                "No episode is under way in some environments.",
                "The first reset must be one of all of them.",
                "Call reset() without a reset_mask first.",
                failure=FailureClass.AGENT,
            )
        self._observe(np.arange(self.num_envs))
        self._rewarded(chosen, reset=True)
        self._told(infos, chosen)
        return dict(self._observations), infos

    def _ends(self, rewards: NDArray[np.float64], terminated: Mask, truncated: Mask) -> tuple[Any, Any, Any]:
        """Return these as what the caller is told in."""
        if not self._as_tensors:
            return rewards, terminated, truncated
        return self._tensor(rewards.astype(np.float32)), self._tensor(terminated), self._tensor(truncated)

    def _tensor(self, rows: NDArray[Any]) -> Any:
        return torch_there(rows, cast(ManyTensors, self._robots).tensor_device())

    def step(self, actions: Any) -> Returned:
        """Execute every environment's action to its end, then observe all of them."""
        mode = self.autoreset_mode
        actions = on_host(actions)
        if not self._observations:
            raise BenchbotError(
                "No episode is under way.",
                "The environments were not reset.",
                "Call reset() first.",
                failure=FailureClass.AGENT,
            )
        if mode is AutoresetMode.DISABLED and self._ended.any():
            numbers = ", ".join(map(str, np.flatnonzero(self._ended)[:5].tolist()))
            raise BenchbotError(
                "The episode is over.",
                f"It has ended in the environments {numbers}, and autoreset is disabled.",
                'Call reset(options={"reset_mask": terminated | truncated}) before the next step.',
                failure=FailureClass.AGENT,
            )
        again = np.flatnonzero(self._ended) if mode is AutoresetMode.NEXT_STEP else np.zeros(0, np.intp)
        stepped = np.flatnonzero(~self._ended) if mode is AutoresetMode.NEXT_STEP else np.arange(self.num_envs)
        outcomes = self._act(actions, stepped)
        infos = self._begin(again, [None] * self.num_envs, {})
        self._observe(np.arange(self.num_envs))
        rewards = np.zeros(self.num_envs)
        rewards[stepped] = self._rewarded(stepped, reset=False)
        self._rewarded(again, reset=True)
        terminated, truncated = np.zeros((2, self.num_envs), bool)
        terminated[stepped], truncated[stepped] = self._terminated(stepped), self._truncated(stepped)
        self._ended = terminated | truncated
        finished = np.flatnonzero(self._ended)
        if mode is AutoresetMode.SAME_STEP and len(finished):
            last: Info = {}
            _put(last, self.num_envs, "outcome", stepped, outcomes)
            self._told(last, stepped)
            observations = self._observations
            for number in finished.tolist():
                one = {
                    "final_obs": {name: copied(rows[number]) for name, rows in observations.items()},
                    "final_info": {name: _row(rows, number) for name, rows in last.items() if not name.startswith("_")},
                }
                infos = self._add_info(infos, one, number)
            for name, started in self._begin(finished, [None] * self.num_envs, {}).items():
                infos[name] = started
            self._observe(finished)
            self._rewarded(finished, reset=True)
            kept = np.setdiff1d(stepped, finished)
            _put(infos, self.num_envs, "outcome", kept, outcomes[kept])
        else:
            _put(infos, self.num_envs, "outcome", stepped, outcomes)
        self._told(infos, np.arange(self.num_envs))
        return dict(self._observations), *self._ends(rewards, terminated, truncated), infos

    def close_extras(self, **kwargs: Any) -> None:
        """Release the simulator."""
        self._platform.close()

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return the pictures of all robots' cameras when `render_mode` is "rgb_array"; else None."""
        if self.render_mode is None:
            return None
        pictures = self._observations.get("image_rgb")
        if pictures is None:
            pictures = self._robots.observe(np.arange(self.num_envs), ["image_rgb"])["image_rgb"]
        return tuple(np.array(on_host(picture)) for picture in pictures)

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None or isinstance(seed, int):
            return [None if seed is None else seed + number for number in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"There are {len(seed)} seeds for {self.num_envs} environments: give one for each.")
        return list(seed)

    def _mask(self, chosen: Any) -> Mask:
        if chosen is None:
            return np.ones(self.num_envs, bool)
        mask = np.asarray(chosen)
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise ValueError(
                f"options['reset_mask'] must be {self.num_envs} booleans, one of them True; it is {chosen!r}."
            )
        return mask

    def _begin(self, robots: Indices, seeds: Sequence[int | None], options: dict[str, Any]) -> Info:
        """Draw and load episodes; return what their infos say of them."""
        infos: Info = {}
        for number in robots.tolist():
            random = self._randoms[number]
            if random is None or seeds[number] is not None:
                random = self._randoms[number] = seeding.np_random(seeds[number])[0]
            selection, told = self._one.draw(random, seeds[number], options)
            scene = selection.environments[0]
            seed = randomness.scene_seed(selection.secret, selection.seed, 0)
            self._robots.load(number, Scene(scene.data, scene.path.parent), seed)
            goal = commands.Goal.of(selection)
            self._selections[number], self._goals[number] = selection, goal
            if goal is not None and selection.episode is not None:
                self._goal_places[number] = goal.x, goal.y, goal.success_m
                self._goal_rows[number] = selection.episode.goal
            same = constants(self._robots.constants(number, selection.observations))
            infos = self._add_info(infos, {**told, **same}, number)
        self._steps[robots], self._ended[robots] = 0, False
        return infos

    def _act(self, actions: Any, stepped: Indices) -> NDArray[np.object_]:
        """Have these environments take their actions; return the outcomes (N,)."""
        straight, arguments = self._decoded(actions, stepped)
        outcomes = np.full(self.num_envs, None, object)
        if len(stepped):
            ended = self._robots.execute(stepped, straight, arguments)
            outcomes[stepped] = np.array([str(each) for each in self._robots.outcomes], object)[ended]
        self._steps[stepped] += 1
        return outcomes

    def _decoded(self, actions: Any, stepped: Indices) -> tuple[Mask, NDArray[np.float64]]:
        """Return who drives straight, and the arguments in metres or degrees; raises BenchbotError as `decode` does."""
        one = self._one
        if one.moves is not None:
            numbers = np.asarray(actions)[stepped].astype(np.intp)
            for number in np.unique(numbers[(numbers < 0) | (numbers >= len(one.moves))]).tolist():
                one.decode(number)
            straight = np.array([move.action == "move_distance" for move in one.moves])
            return straight[numbers], np.array([move.argument for move in one.moves])[numbers]
        chosen = [one.decode({name: rows[number] for name, rows in actions.items()}) for number in stepped.tolist()]
        moves = [each for each in chosen if isinstance(each, Move)]
        return (
            np.array([move.action == "move_distance" for move in moves], bool),
            np.array([move.argument for move in moves], np.float64),
        )

    def _observe(self, robots: Indices) -> None:
        """Take the observations of these robots into those of all."""
        if not len(robots):
            return
        selection = cast(Selection, self._selections[int(robots[0])])
        wanted = [name for name in selection.observations if name not in GIVEN_BY_EPISODES]
        there: dict[str, Any] = {}
        if self._as_tensors:
            there = cast(ManyTensors, self._robots).tensors(robots, wanted)
            wanted = [
                name
                for name in wanted
                if name not in there and not (name == "image_segment" and "class_segment_img" in there)
            ]
        seen = self._robots.observe(robots, wanted)
        if "goal" in selection.observations:
            seen["goal"] = self._goal_rows[robots]
        for name, space in cast(gymnasium.spaces.Dict, self.single_observation_space).spaces.items():
            rows = there.get(name)
            if rows is None:
                rows = fitted(name, seen.get(name), space)
                rows = self._tensor(rows) if self._as_tensors else rows
            if len(robots) == self.num_envs:
                self._observations[name] = rows
            else:
                put(self._observations[name], robots, rows)
        self._raw = seen.get("laser"), robots

    def _distances_m(self, robots: Indices) -> NDArray[np.float64]:
        x, y, _ = self._robots.poses_xyyaw(robots).T
        away_x, away_y = x - self._goal_places[robots, 0], y - self._goal_places[robots, 1]
        distances_m: NDArray[np.float64] = np.sqrt(away_x * away_x + away_y * away_y)
        return distances_m

    def _arrived(self, robots: Indices) -> Mask:
        near = self._distances_m(robots) <= self._goal_places[robots, 2]
        arrived: Mask = near & (self._steps[robots] > 0) & ~self._robots.collided[robots]
        return arrived

    def _terminated(self, robots: Indices) -> Mask:
        return self._robots.collided[robots] | self._arrived(robots)

    def _truncated(self, robots: Indices) -> Mask:
        steps, truncated = self._steps[robots], np.zeros(len(robots), bool)
        limits = cast(Selection, self._selections[0]).limits
        for most in (limits.steps, self._horizon):
            if most is not None:
                truncated |= steps >= most
        if limits.simulated_time_s is not None:
            truncated |= self._robots.clock_s[robots] >= limits.simulated_time_s
        return truncated

    def _rewarded(self, robots: Indices, *, reset: bool) -> NDArray[np.float64]:
        if not len(robots):
            return np.zeros(0)
        ranges_m, observed = self._raw

        def scans() -> NDArray[np.float64]:
            places = np.full(self.num_envs, -1)
            places[observed] = np.arange(len(observed))
            if ranges_m is None or (places[robots] < 0).any():
                ranges: NDArray[np.float64] = self._robots.observe(robots, ["laser"])["laser"]
                return ranges
            chosen: NDArray[np.float64] = ranges_m[places[robots]]
            return chosen

        return self._reward(
            Transitions(
                robots,
                self._robots.collided[robots],
                self._distances_m(robots),
                self._arrived(robots),
                scans,
                lambda row: self._robots.pose(int(robots[row])),
                self._one.robot,
            ),
            reset=reset,
        )

    def _told(self, infos: Info, robots: Indices) -> None:
        """Add what every step says of these environments to their infos."""
        collided = self._robots.collided[robots]
        moved = self._steps[robots] > 0
        selection = cast(Selection, self._selections[int(robots[0])])
        masks = np.repeat(~collided[:, None], len(self._one.numbered), 1).astype(np.int8)
        told: dict[str, NDArray[Any]] = {
            "result": _words(np.where(collided, "COLLISION", "SUCCESS")),
            "state": _words(np.where(collided, "collided", np.where(moved, "dirty", "clean"))),
            "collided": collided,
            "steps": self._steps[robots],
            "scene_number": np.zeros(len(robots), np.int64),
            "simulated_time_s": self._robots.clock_s[robots],
            "action_mask": masks,
        }
        if "poses" in selection.observations and selection.localisation == "ground_truth":
            told["pose_xyyaw"] = self._robots.poses_xyyaw(robots)
        if self._goals[int(robots[0])] is not None:
            told["distance_to_goal_m"] = self._distances_m(robots)
            told["is_success"] = self._arrived(robots)
        for name, rows in told.items():
            _put(infos, self.num_envs, name, robots, rows)


def _put(infos: Info, count: int, name: str, robots: Indices, rows: NDArray[Any]) -> None:
    """Put a row for each of these environments into the infos, as `VectorEnv._add_info` does one by one.

    `rows` are those of all environments where there are as many.
    """
    if not len(robots):
        return
    if name not in infos:
        words = rows.dtype.kind == "O"
        infos[name] = np.full(count, None, object) if words else np.zeros((count, *rows.shape[1:]), rows.dtype)
        infos[f"_{name}"] = np.zeros(count, bool)
    infos[name][robots] = rows[robots] if len(rows) == count else rows
    infos[f"_{name}"][robots] = True


def _words(words: NDArray[np.str_]) -> NDArray[np.object_]:
    return words.astype(object)


def _row(rows: Any, number: int) -> Any:
    row = rows[number]
    return row.item() if isinstance(row, np.generic) else row
