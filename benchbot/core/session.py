"""The session: one solution's run through the scenes of a selection, as a state machine."""

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from typing import Any, TypeVar, cast

from benchbot.core import randomness
from benchbot.core.budget import LIMITED, Spent
from benchbot.core.channels import GIVEN_BY_EPISODES, Observations, check_argument
from benchbot.core.digest import ActionLog, ObservationDigest
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass, did_you_mean
from benchbot.core.geometry import Pose
from benchbot.core.host import Host, Status
from benchbot.core.motion import Outcome
from benchbot.core.platform import Scene
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.core.recording import Recording
from benchbot.core.selection import Selection
from benchbot.core.track import Track, waypoint

T = TypeVar("T")
OutcomeT = TypeVar("OutcomeT", bound=Outcome | None)

log = logging.getLogger("benchbot.session")


class Session:
    """Runs a selection on a host. Not thread-safe: the caller serialises `reset`, `step` and `next_scene`.

    `start_host` makes the host at the first `reset`, and anew at the `reset` that follows a dead one. `digest` makes
    that of an episode. `before_observing` is called when arrays that were observed before may change.
    """

    def __init__(
        self,
        selection: Selection,
        start_host: Callable[[], Host],
        recordings: Sequence[Recording] = (),
        digest: Callable[[], ObservationDigest] = ObservationDigest,
        before_observing: Callable[[], None] = lambda: None,
    ) -> None:
        self.selection = selection
        self.recordings = tuple(recordings)
        self.progress = Progress(time_is_simulated=selection.time_is_simulated)
        self.tracks: list[Track] = []
        """The true tracks, scene by scene; solutions do not see them before they have handed in a result."""
        self.log = ActionLog()
        """The solution's actions since the last reset."""
        self.driven_by_hand = 0
        """Number of steps taken by a person at the host, since a result was last handed in."""
        self.robot: Mapping[str, Any] | None = None
        """What the driver of a real robot has said of it last, for the provenance; None of a simulated one."""
        self.machine: Mapping[str, Any] = {}
        """What the simulator has said of what it runs on."""
        self.taken_over_s: list[float] = []
        """For how long a person beside the robot has had it, each time since a result was last handed in."""
        self.handed_in = False
        self.one_episode = False
        """Whether all attempts are of one episode, also those after a result was handed in."""
        self.digest = digest()
        self.scenes = tuple(Scene(declaration.data, declaration.path.parent) for declaration in selection.environments)
        self._start_host = start_host
        self._new_digest = digest
        self._before_observing = before_observing
        self._host: Host | None = None
        self._trajectory: tuple[Pose, ...] = ()
        self._simulated_before_s = 0.0
        self._begins_episode = True
        self._safety_stop: BenchbotError | None = None
        self._halted: str | None = None

    @property
    def actions(self) -> tuple[str, ...]:
        """The actions that may be taken now: none after a collision, the end of the trajectory or a failure."""
        usable = self.progress.state in (State.CLEAN, State.DIRTY)
        return self.selection.actions if usable else ()

    @property
    def result(self) -> ActionResult:
        """The current state as solutions are told of it."""
        if self.progress.state is State.COLLIDED:
            return ActionResult.COLLISION
        return ActionResult.FINISHED if self.progress.state is State.FINISHED else ActionResult.SUCCESS

    def prepare(self) -> None:
        """Start the host before the first `reset` needs it, so that no solution waits, and look at a real robot."""
        self._guarded(lambda: self._running_host().prepare())

    def begin_episode(self) -> None:
        """Begin an episode with the next reset: what was before was another solution's, or the host's."""
        self._begins_episode = True
        if self._safety_stop is None:
            self.digest.wait()
            self._forget(Spent())

    def reset(self) -> Step:
        """Start anew in the first scene and observe; also the way back after a collision or a dead platform.

        What was spent before counts on, in most runs until a result is handed in. Raises BenchbotError when the limits
        allow no other attempt. There is no way back from a safety stop: it is raised again.
        """
        if self._safety_stop is not None:
            raise self._safety_stop
        is_new = self.handed_in and not self.one_episode
        before = Spent() if is_new or self._begins_episode else self._spent_before_another_attempt()
        self._begins_episode = False
        self.digest.wait()
        self.driven_by_hand = 0 if is_new else self.driven_by_hand
        self.taken_over_s = [] if is_new else self.taken_over_s
        self.handed_in = False
        self._forget(before)
        self._tell_recordings(lambda recording: recording.reset())
        return self._enter(0)

    def _forget(self, before: Spent) -> None:
        self.progress = Progress(before=before, time_is_simulated=self.selection.time_is_simulated)
        self.tracks = []
        self.log = ActionLog()
        self.digest = self._new_digest()
        self._simulated_before_s = 0.0

    def next_scene(self) -> Step | None:
        """Advance to the next scene and observe, or return None when there is none. Never goes back.

        Raises BenchbotError after a collision.
        """
        self._require_started()
        if self.progress.state is State.COLLIDED:
            raise BenchbotError(
                "The next scene is out of reach after a collision.",
                "A collision ends the whole episode.",
                "Call reset() to start again in the first scene.",
                failure=FailureClass.COLLISION,
            )
        self._check_limits("wall_time_s")
        following = self.progress.scene_number + 1
        if following >= len(self.scenes):
            return None
        self._simulated_before_s = self.progress.simulated_time_s
        return self._enter(following)

    def step(self, action: str | None, arguments: Mapping[str, Any] | None = None, *, by_hand: bool = False) -> Step:
        """Take one action to its end and observe; None only observes. `by_hand` says that it is not the solution's.

        Raises BenchbotError for an action that is unknown, unavailable now or wrongly used, for a limit that is
        reached (failure `timeout`) and for a platform that died (failure `platform`).
        """
        host = self._require_started()
        arguments = dict(arguments or {})
        if action is None:
            self._check_limits("wall_time_s")
            self.progress.looks += 1
            return self._observe(host, None)
        self._check_action(action, arguments)
        self._check_limits(*LIMITED)
        goal = None
        if action == "move_next":
            goal = next(iter(self._trajectory[self.progress.trajectory_index :]), None)
        self.driven_by_hand += by_hand
        outcome, status = self._moved(action, lambda: host.act(action, arguments, goal))
        if action == "move_next":
            self.progress.trajectory_index += 1
            if not status.collided and self._is_over(status):
                self.progress.state = State.FINISHED
        return self._observe(host, outcome, action, arguments, by_hand=by_hand)

    def move_by(self, name: str, arguments: Mapping[str, Any], move: Callable[[], Status]) -> Step:
        """Move the robot by other means than an action of the task, and observe; it counts as a step.

        `move` moves it and says where it ended up: for velocity control in training, which no task offers. The caller
        sees to limits. Raises BenchbotError when no action could be taken either.
        """
        host = self._require_started()
        if not self.actions:
            raise BenchbotError(
                f"The robot cannot move any more: {self.result}.",
                f"The scene is {self.progress.state}.",
                "Go on with next_scene() or reset().",
                failure=FailureClass.AGENT,
            )
        self._moved(name, lambda: (None, move()))
        return self._observe(host, None, name, arguments)

    def _moved(self, name: str, move: Callable[[], tuple[OutcomeT, Status]]) -> tuple[OutcomeT, Status]:
        """Move the robot by a step of this name, and note where that has led."""
        self.progress.last_action = name
        self.progress.steps += 1
        outcome, status = self._guarded(move)
        self._note(status)
        if status.collided:
            self._end(State.COLLIDED, FailureClass.COLLISION, f"The robot hit something during {name}.")
        else:
            self.progress.state = State.DIRTY
        return outcome, status

    def fail(self, failure: FailureClass, why: str) -> None:
        """Record that the episode ended badly for a reason outside the robot: the first one stays."""
        self._end(State.FAILED, failure, why)

    def halt(self, why: str) -> None:
        """Stop a real robot in the middle of an action, for good; called from another thread than the action's."""
        self._halted = why
        host = self._host
        if host is not None:
            host.halt(why)

    def release(self) -> Host | None:
        """Give away the host, which is idle, to a session that comes after this one; None when there is none."""
        self.digest.wait()
        host, self._host = self._host, None
        return host

    def join(self, recording: Recording) -> None:
        """Record from the next observation on. May be called from another thread."""
        self.recordings = (*self.recordings, recording)

    def leave(self, recording: Recording) -> None:
        """Tell a recording nothing more, once it has been told of what is under way."""
        self.recordings = tuple(other for other in self.recordings if other is not recording)

    def close(self) -> None:
        """Stop the robot, release the host and finish the recordings."""
        with ExitStack() as stack:
            for recording in self.recordings:
                stack.callback(_finish, recording)
            self._close_host()

    def _enter(self, scene_index: int) -> Step:
        self.tracks.append(Track(self.selection.environments[scene_index].name))
        self.log.entered(self.selection.environments[scene_index].name)
        host = self._guarded(self._running_host)
        # Each scene has its own stream of random numbers, so that scene 2 does not depend on what happened in scene 1.
        seed = randomness.scene_seed(self.selection.secret, self.selection.seed, scene_index)
        status = self._guarded(lambda: host.load(scene_index, seed))
        self._trajectory = self.scenes[scene_index].trajectory
        self.progress.state = State.FINISHED if status.at_end else State.CLEAN
        self.progress.scene_number = scene_index
        self.progress.trajectory_index = 0
        self.progress.trajectory_length = len(self._trajectory)
        self._note(status)
        return self._observe(host, None)

    def _is_over(self, status: Status) -> bool:
        if status.at_end is not None:
            return status.at_end
        return self.progress.trajectory_index >= len(self._trajectory)

    def _running_host(self) -> Host:
        host = self._host
        if host is None:
            host = self._host = self._start_host()
            if self._halted is not None:
                host.halt(self._halted)
        return host

    def _require_started(self) -> Host:
        if self._host is None or not self.progress.frames or self.progress.state is State.FAILED:
            raise BenchbotError(
                "The episode is not running.",
                self.progress.failure_why or "It has not been started yet.",
                "Call reset() first.",
                failure=self.progress.failure,
            )
        return self._host

    def _observe(
        self,
        host: Host,
        outcome: Outcome | None,
        action: str | None = None,
        arguments: Mapping[str, Any] | None = None,
        *,
        by_hand: bool = False,
    ) -> Step:
        self.digest.wait()
        self._before_observing()
        observations = self._guarded(lambda: self._look(host))
        self.tracks[-1].observed(self.progress.frames)
        self.progress.frames += 1
        self.digest.update(observations)
        self.log.observed(action, arguments or {}, by_hand=by_hand)
        step = Step(observations, self.result, self.actions, self.progress.state, self.progress.scene_number, outcome)
        self._tell_recordings(lambda recording: recording.step(action, arguments or {}, step, self.progress))
        return step

    def _look(self, host: Host) -> Observations:
        """Return what the robot senses, and the goal of the episode where the task shows one."""
        episode, wanted = self.selection.episode, self.selection.observations
        if episode is None:
            return host.observe(wanted)
        shown: Mapping[str, object] = host.observe([name for name in wanted if name not in GIVEN_BY_EPISODES]) | {
            "goal": episode.goal
        }
        return cast(Observations, {name: shown[name] for name in wanted})

    def _tell_recordings(self, tell: Callable[[Recording], None]) -> None:
        for recording in self.recordings:
            try:
                tell(recording)
            except BenchbotError as error:
                # What ends is the recording: an episode may have taken hours, and its result does not need it.
                log.warning("A recording ended early: %s", error)
                self.leave(recording)
                with suppress(BenchbotError):
                    recording.close()

    def _check_action(self, action: str, arguments: dict[str, Any]) -> None:
        allowed = self.selection.actions
        if action not in allowed:
            raise BenchbotError(
                f"'{action}' is not an action of the task '{self.selection.task.name}'.",
                f"Its actions: {', '.join(allowed)}.{did_you_mean(action, list(allowed))}",
                "Use one of the actions in the action list.",
                failure=FailureClass.AGENT,
            )
        if action not in self.actions:
            raise BenchbotError(
                f"Action '{action}' is unavailable due to: {self.result}.",
                f"The scene is {self.progress.state}, so no action can be taken in it.",
                "Check the action list or the action result before each step; go on with next_scene() or reset().",
                failure=FailureClass.AGENT,
            )
        if action == "move_next" and not self._trajectory:
            raise BenchbotError(
                "There is no trajectory to follow.",
                f"The scene '{self.selection.environments[self.progress.scene_number].name}' declares none.",
                "Choose an environment that declares trajectory_poses.",
            )
        check_argument(action, arguments)

    def _check_limits(self, *names: str) -> None:
        why = self.progress.spent.used_up(self.selection.limits, *names)
        if why is not None:
            self._end(State.FAILED, FailureClass.TIMEOUT, why)
            raise BenchbotError(
                "The episode has reached its limit.",
                why,
                "Save the results that you have, or run again with a higher limit.",
                exit_code=ExitCode.SUBMISSION_FAILED,
                failure=FailureClass.TIMEOUT,
            )

    def _spent_before_another_attempt(self) -> Spent:
        """Return what the episode has spent before a reset; it is a restart when the robot has moved."""
        progress, limit = self.progress, self.selection.limits.restarts
        if not progress.steps and not progress.scene_number:
            return progress.spent
        self._check_limits(*LIMITED)
        if limit is not None and progress.before.restarts >= limit:
            raise BenchbotError(
                "The robot may not be put back again.",
                f"It has moved since the last time, and the limit of {limit} restarts is used up.",
                "Go on from where it is, or save the results that you have.",
                exit_code=ExitCode.SUBMISSION_FAILED,
                failure=FailureClass.AGENT,
            )
        return replace(progress.spent, restarts=progress.before.restarts + 1)

    def _note(self, status: Status) -> None:
        x, y, _ = status.pose.translation_xyz
        self.progress.pose_xyyaw = (x, y, status.pose.yaw_rad)
        self.robot, self.machine = status.robot, status.machine
        self.progress.simulated_time_s = self._simulated_before_s + status.clock_s
        self.taken_over_s += status.taken_over_s
        self.tracks[-1].follow(waypoint(status.pose, status.clock_s), status.path, collided=status.collided)
        self.tracks[-1].witness(status.witnessed, status.clock_s)
        self.progress.collisions = sum(track.collided for track in self.tracks)
        self.progress.path_length_m = sum(track.length_m for track in self.tracks)

    def _end(self, state: State, failure: FailureClass, why: str, fix: str | None = None) -> None:
        self.progress.state = state
        if self.progress.failure is None:
            self.progress.failure = failure
            self.progress.failure_why, self.progress.failure_fix = why, fix

    def _guarded(self, call: Callable[[], T]) -> T:
        try:
            return call()
        except BenchbotError as error:
            if error.failure is FailureClass.PLATFORM:
                self._end(State.FAILED, FailureClass.PLATFORM, f"{error.title} {error.why}", error.fix)
                self._close_host()
            if error.ends_run:
                self._safety_stop = error
                self.progress.ends_run = True
            raise

    def _close_host(self) -> None:
        # Taken first: another thread may close the session meanwhile.
        host, self._host = self._host, None
        if host is not None:
            host.close()


def _finish(recording: Recording) -> None:
    try:
        recording.close()
    except BenchbotError as error:
        log.warning("A recording is not finished: %s", error)
