"""A task on a simulated robot as a Gymnasium environment, in the caller's own process."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from benchbot.core import plugin_manager, resources
from benchbot.core.channels import ACTIONS
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.digest import ObservationDigest
from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean
from benchbot.core.host import InProcessHost, Status
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import Platform, PlatformSpec, Scene
from benchbot.core.progress import State, Step
from benchbot.core.records import Simulator
from benchbot.core.request import Limits, RunRequest
from benchbot.core.selection import Selection, select
from benchbot.core.session import Session
from benchbot.plugins.gymnasium import commands, rewards
from benchbot.plugins.gymnasium.commands import NEXT_SCENE, Command, Move, Velocity
from benchbot.plugins.gymnasium.spaces import Arrays, constants, encode, observation_space, resized

Info = dict[str, Any]
UNAVAILABLE = "unavailable"
QUALITY = "fast"


class TaskEnv(gymnasium.Env[Arrays, Any]):
    """A task on a simulated robot, in one environment or in several, of which a reset chooses one.

    `task`, `robot` and `env` are names as of `benchbot list`; `env` is `name:variant[:variant…]` or a list of such.
    `reward` is a name, names with weights, a function of a `Transition`, or a class of such (see
    `benchbot.plugins.gymnasium.rewards`). `image_size` is (width, height) of other pictures than the robot's own. An
    `argument` of 1 is `largest_distance_m` or `largest_angle_deg`. `max_simulated_time_s` truncates an episode, as do
    the limits of the task. `platform_options` are the simulator's settings, such as {"device": "cuda"}; `quality` is
    "fast" unless they or the environment say otherwise. `settings` change what the environments declare, as
    `benchbot run --set` does: {"lighting.time": "21:30"}. `episode` is the number of one, in a task that has a list;
    by default each reset draws one. `moves` are discrete actions in place of the parameterised ones.

    A task with a point to go to terminates where the robot rests within the task's distance of it.

    Observations and actions: docs/gymnasium.md. Raises BenchbotError for a choice that is impossible.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012
    _host_type: type[InProcessHost] = InProcessHost
    _digest_type: type[ObservationDigest] = ObservationDigest

    def __init__(
        self,
        *,
        task: str,
        robot: str,
        env: str | Sequence[str],
        reward: rewards.RewardChoice = None,
        render_mode: str | None = None,
        image_size: tuple[int, int] | None = None,
        largest_distance_m: float = 1.0,
        largest_angle_deg: float = 90.0,
        max_simulated_time_s: float | None = None,
        platform_options: Mapping[str, Any] | None = None,
        settings: Mapping[str, Any] | None = None,
        episode: int | None = None,
        moves: Sequence[Move] | None = None,
    ) -> None:
        self.render_mode = render_mode
        self._image_size = image_size
        self._platform_options = dict(platform_options or {})
        self._largest = {
            "move_distance": largest_distance_m,
            "move_sideways": largest_distance_m,
            "move_angle": largest_angle_deg,
        }
        self.reward_choice = reward
        self._reward = rewards.make(reward)
        self._catalog = Catalog(plugin_manager.load())
        limits = Limits(simulated_time_s=max_simulated_time_s)
        self._request = RunRequest(task, robot, "", settings=dict(settings or {}), limits=limits, episode=episode)
        self._selections: dict[tuple[str, int | None], Selection] = {}
        self.environments: tuple[str, ...] = (env,) if isinstance(env, str) else tuple(env)
        if not self.environments:
            raise BenchbotError("There is no environment.", "The list of environments is empty.", "Name one: env=…")
        self._first, *_ = [self._selection(name) for name in self.environments]
        self.action_names = commands.action_names(self._first)
        """The action of each number of `action_space["action"]`."""
        self.moves = None if moves is None else tuple(commands.known(move, self.action_names) for move in moves)
        """The action of each number where actions are discrete, else None."""
        self.action_space = commands.action_space(self.action_names) if moves is None else spaces.Discrete(len(moves))
        self._space = observation_space(self._first.observations, self._first.robot.data)
        self.observation_space = cast(gymnasium.Space[Arrays], self._space)
        self._platform: Platform | None = None
        self._session: Session | None = None
        self._last: Step | None = None
        self._steps = 0
        self._goal: commands.Goal | None = None

    @property
    def robot(self) -> Mapping[str, Any]:
        """The robot's declaration, with the pictures' size that was asked for."""
        return self._first.robot.data

    @property
    def numbered(self) -> tuple[str, ...]:
        """The task's action behind each discrete action."""
        return self.action_names if self.moves is None else tuple(move.action for move in self.moves)

    @property
    def quality(self) -> str | None:
        """The quality of the pictures that learning is given; None where the environment declares it."""
        return self._options().get("quality")

    @property
    def session(self) -> Session:
        """The episode under way: `benchbot.core.results.finish` makes a result of it."""
        return self._under_way()[0]

    @property
    def motion(self) -> MotionConfig:
        """The robot's limits and tolerances."""
        return MotionConfig.from_robot(self._first.robot.data, self._first.localisation)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Arrays, Info]:
        """Start an episode in a clean scene.

        With a `seed` it is that of the episode, as of `benchbot run --seed`; without one, the next is drawn.
        `options` {"env": name, "episode": number} chooses the environment and the task's episode; else they are drawn.
        """
        super().reset(seed=seed)
        selection, drawn = self.draw(self.np_random, seed, options or {})
        if self._session is not None and self._session.progress.state is State.FAILED:
            self._platform = None  # the failed session has closed it
        self._goal = commands.Goal.of(selection)
        self._session = Session(selection, lambda: self._host(selection), digest=self._digest_type)
        self._steps = 0
        step = self._last = self._session.reset()
        self._reward(self._transition(step, None))
        info = {**drawn, **constants(step.observations), **self._info(step)}
        return encode(step.observations, self._space), info

    def step(self, action: Any) -> tuple[Arrays, float, bool, bool, Info]:
        """Execute one action to its end, observe, and compute the reward.

        `action` is an element of `action_space`, or a `Move` or `Velocity` in physical units. An action that is not
        available now (`action_mask` in the info) moves nothing. Raises BenchbotError after the end of an episode.
        """
        session, last = self._under_way()
        if self._terminated(last) or self._truncated(session):
            raise BenchbotError(
                "The episode is over.",
                f"It was {'terminated' if self._terminated(last) else 'truncated'}.",
                "Call reset() first.",
                failure=FailureClass.AGENT,
            )
        command = self.decode(action)
        step, outcome = self._execute(session, command)
        self._last = step
        self._steps += 1
        reward = float(self._reward(self._transition(step, command)))
        info = {"outcome": outcome, **self._info(step)}
        if command == Move(NEXT_SCENE) and outcome != UNAVAILABLE:
            info |= constants(step.observations)
        observation = encode(step.observations, self._space)
        return observation, reward, self._terminated(step), self._truncated(session), info

    def decode(self, action: Any) -> Command:
        """Return the command that an element of the action space stands for; a command stands for itself."""
        return commands.decode(action, self.action_names, self._largest, self.moves)

    def draw(
        self, random: np.random.Generator, seed: int | None, options: Mapping[str, Any]
    ) -> tuple[Selection, dict[str, Any]]:
        """Return the selection of an episode, drawn but for what is given, and what of it the info of a reset says."""
        unknown = [name for name in options if name not in ("env", "episode")]
        if unknown:
            raise BenchbotError(
                f"reset() has no option '{unknown[0]}'.",
                f"Known: env, episode.{did_you_mean(unknown[0], ['env', 'episode'])}",
                'Call it like this: env.reset(options={"env": "miniroom:1"})',
            )
        drawn = int(random.integers(len(self.environments))) if len(self.environments) > 1 else 0
        name = str(options.get("env", self.environments[drawn]))
        selection = self._selection(name, options.get("episode", self._request.episode))
        listed = selection.episode
        if listed is not None and self._request.episode is None and "episode" not in options:
            number = int(random.integers(len(listed.listed.data["episodes"])))
            selection = self._selection(name, number)
        episode_seed = int(random.integers(2**31)) if seed is None else seed
        told = {"env": name, "seed": episode_seed}
        if selection.episode is not None:
            told["episode"] = selection.episode.number
        return replace(selection, seed=episode_seed), told

    def start(self) -> Platform:
        """Return the simulator that runs the first environment, not yet loaded."""
        return self._start(self._first, self._spec())

    def render(self) -> NDArray[np.uint8] | None:
        """Return the image of the robot's camera, uint8 (H, W, 3), when `render_mode` is "rgb_array"; else None."""
        if self.render_mode is None:
            return None
        _, last = self._under_way()
        if "image_rgb" in last.observations:
            return last.observations["image_rgb"].copy()
        return cast(Platform, self._platform).observe(["image_rgb"])["image_rgb"]

    def close(self) -> None:
        """Release the simulator. Safe to call twice; a reset starts it anew."""
        platform, self._platform, self._session, self._last = self._platform, None, None, None
        if platform is not None:
            platform.close()

    def _selection(self, name: str, episode: int | None = None) -> Selection:
        """Return the selection for an environment; the environments of one object share task and robot."""
        key = name, episode
        if key not in self._selections:
            chosen = self._request.episode if episode is None else episode
            selection = select(self._catalog, replace(self._request, environment=name, episode=chosen))
            robot = selection.robot
            if robot.data["type"] not in self._catalog.plugins.pool("simulators"):
                raise BenchbotError(
                    f"The robot '{robot.name}' is a real one.",
                    "An environment for learning resets and crashes robots as it likes; real ones would not take that.",
                    "Train on a simulated robot; drive the real one with benchbot.api and the policy that was learnt.",
                )
            if self._image_size is not None:
                robot = replace(robot, data=resized(robot.data, *self._image_size))
            # Wall time would make an episode depend on how busy the machine is.
            limits = replace(selection.limits, wall_time_s=None)
            self._selections[key] = replace(selection, robot=robot, limits=limits)
        return self._selections[key]

    def _options(self) -> dict[str, Any]:
        """Return the simulator's settings: quick pictures, since learning takes millions, unless others are asked."""
        declared = [scene.data.get("options", {}) for scene in self._first.environments]
        given = any("quality" in options for options in declared)
        return self._platform_options if given else {"quality": QUALITY, **self._platform_options}

    def _spec(self) -> PlatformSpec:
        first = self._first
        return PlatformSpec(first.robot.data, first.localisation, resources.cache_dir(), self._options())

    def _host(self, selection: Selection) -> InProcessHost:
        if self._platform is None:
            self._platform = self._start(selection, self._spec())
        scenes = [Scene(declaration.data, declaration.path.parent) for declaration in selection.environments]
        return self._host_type(self._platform, scenes, self.motion)

    def _start(self, selection: Selection, spec: PlatformSpec) -> Platform:
        simulator: Simulator = self._catalog.plugins.record("simulators", selection.robot.data["type"])
        return simulator.create(spec)

    def _execute(self, session: Session, command: Command) -> tuple[Step, str]:
        if isinstance(command, Velocity):
            return session.move_by("drive", asdict(command), lambda: self._drive(command)), "driven"
        if command.action == NEXT_SCENE:
            entered = session.next_scene()
            return (session.step(None), UNAVAILABLE) if entered is None else (entered, "entered")
        if command.action in session.selection.actions and command.action not in session.actions:
            return session.step(None), UNAVAILABLE
        argument = ACTIONS[command.action].argument if command.action in ACTIONS else None
        step = session.step(command.action, {} if argument is None else {argument: float(command.argument)})
        return step, "" if step.outcome is None else step.outcome.value

    def _drive(self, velocity: Velocity) -> Status:
        platform = cast(Platform, self._platform)
        ticks = max(1, round(velocity.duration_s / platform.control_period_s))
        for _ in range(ticks):
            if not platform.collided:
                platform.drive(velocity.linear_mps, velocity.angular_radps, velocity.duration_s / ticks)
        return Status(platform.pose(), platform.clock(), platform.collided)

    def _under_way(self) -> tuple[Session, Step]:
        if self._session is None or self._last is None:
            raise BenchbotError(
                "No episode is under way.",
                "The environment was not reset, or has been closed.",
                "Call reset() first.",
                failure=FailureClass.AGENT,
            )
        return self._session, self._last

    def _terminated(self, step: Step) -> bool:
        last_scene = step.scene_number + 1 == len(self._first.environments)
        ended = step.state is State.COLLIDED or (step.state is State.FINISHED and last_scene)
        return ended or self._arrived(step)

    def _arrived(self, step: Step) -> bool:
        """Return whether the robot rests at its goal, after it has done something."""
        at_goal = self._goal is not None and self._goal.reached(self._goal_m())
        return at_goal and self._steps > 0 and step.state is not State.COLLIDED

    def _goal_m(self) -> float:
        """Return the straight distance from the robot to the goal."""
        goal, platform = self._goal, self._platform
        if goal is None or platform is None:
            return math.nan
        x, y, _ = platform.pose().translation_xyz
        return goal.distance_m(x, y)

    def _truncated(self, session: Session) -> bool:
        limits = session.selection.limits
        out_of_steps = limits.steps is not None and self._steps >= limits.steps
        simulated_s = session.progress.simulated_time_s
        return out_of_steps or (limits.simulated_time_s is not None and simulated_s >= limits.simulated_time_s)

    def _transition(self, step: Step, command: Command | None) -> rewards.Transition:
        platform = cast(Platform, self._platform)
        return rewards.Transition(
            step=self._steps,
            scene_number=step.scene_number,
            command=command,
            outcome=step.outcome,
            collided=step.state is State.COLLIDED,
            base=platform.pose(),
            observations=step.observations,
            observe=platform.observe,
            robot=self._first.robot.data,
            distance_to_goal_m=self._goal_m(),
            arrived=self._arrived(step),
        )

    def _info(self, step: Step) -> Info:
        session, collided = self.session, step.state is State.COLLIDED
        available = set(step.actions)
        if step.scene_number + 1 < len(session.selection.environments) and not collided:
            available.add(NEXT_SCENE)
        info = {
            "result": step.result.value,
            "state": step.state.value,
            "collided": collided,
            "steps": self._steps,
            "scene_number": step.scene_number,
            "simulated_time_s": session.progress.simulated_time_s,
            "action_mask": np.array([name in available for name in self.numbered], np.int8),
        }
        if "poses" in session.selection.observations and session.selection.localisation == "ground_truth":
            info["pose_xyyaw"] = np.array(session.progress.pose_xyyaw)
        if self._goal is not None:
            info["distance_to_goal_m"] = self._goal_m()
            info["is_success"] = self._arrived(step)
        return info
