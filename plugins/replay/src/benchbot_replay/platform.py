"""The robot `replay`: it has been where its recording says, and sees what was seen there."""

from collections.abc import Iterable
from contextlib import ExitStack
from typing import Any, cast

from benchbot.plugin import BenchbotError, ExitCode, FailureClass, Observations, PlatformSpec, Pose, Scene
from benchbot_record_mcap.reading import observations
from benchbot_replay import source
from benchbot_replay.recordings import Moment, base_pose, file_sha256, opened, refused


class ReplayedRobot:
    """A platform that takes whole actions: each is the one that was recorded, and leads to what was seen after it.

    A look without an action shows the next one that was recorded there, or the last one again. Raises BenchbotError
    for recordings that do not fit what is asked.
    """

    control_period_s = 0.1
    velocity = (0.0, 0.0)

    def __init__(self, spec: PlatformSpec) -> None:
        self._recordings = source.in_use()
        self._robot_frame = str(spec.robot["robot_frame"])
        self._stack = ExitStack()
        self._reader: Any = None
        self._start = Pose()
        self._moments: tuple[Moment, ...] = ()
        self._here = 0
        self._looked = False
        self._began_s = 0.0
        self._driven_m: float | None = 0.0
        for recorded in self._recordings:
            recorded.require_localisation(spec.localisation)
            known = spec.robot["replay"]
            if any(known.get(scene.name, {}).get("sha256") != recorded.sha256 for scene in recorded.scenes):
                raise refused(recorded.path, "It was changed since the run was chosen.", "Start the run again.")

    def load(self, scene: Scene, seed: int) -> None:
        """Go back to the first observation in a scene."""
        name = f"{scene.environment['name']}:{scene.environment['variant']}"
        recorded, found = next((one, each) for one in self._recordings for each in one.scenes if each.name == name)
        recorded.require_same(name, scene.environment)
        if file_sha256(recorded.path) != recorded.sha256:
            raise refused(recorded.path, "It was changed since the run was chosen.", "Start the run again.")
        self._stack.close()
        self._reader = self._stack.enter_context(opened(recorded.path))
        before = recorded.scenes[: recorded.scenes.index(found)]
        self._began_s = (before[-1].moments[-1].time_s or 0.0) if before else 0.0
        self._start = scene.start_pose
        self._moments = found.moments
        self._here, self._looked, self._driven_m = 0, False, 0.0

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels as they were seen."""
        following = self._here + 1
        if self._looked and following < len(self._moments) and self._moments[following].action is None:
            self._here = following
        self._looked = True
        stamp_ns = self._moments[self._here].stamp_ns
        seen = observations(self._reader.iter_messages(start_time=stamp_ns, end_time=stamp_ns + 1))
        return cast(Observations, {channel: seen[channel] for channel in channels})

    @property
    def at_end(self) -> bool:
        """True when no other action was recorded in this scene."""
        return self._next() is None

    @property
    def driven_m(self) -> float | None:
        """The length of the path of the last action, None where the task hid it."""
        return self._driven_m

    def act(self, action: str) -> str:
        """Take the recorded action that is next, and return its outcome."""
        following = self._next()
        if following is None or self._moments[following].action != action:
            raise BenchbotError(
                f"'{action}' was not recorded here.",
                "A recording shows what followed from its own actions, and from no others.",
                "Take move_next, as long as it is among the actions.",
                exit_code=ExitCode.SUBMISSION_FAILED,
                failure=FailureClass.AGENT,
            )
        before, after = self._moments[self._here].path_m, self._moments[following].path_m
        self._driven_m = None if before is None or after is None else after - before
        self._here, self._looked = following, False
        return str(self._moments[following].outcome)

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Refuse: nothing is left of the velocities."""
        raise BenchbotError(
            "A recording cannot be driven.",
            "It shows what followed from its own actions, and holds no velocity.",
            "Replay a passive task, with move_next.",
        )

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return False: nothing moves."""
        return False

    def pose(self) -> Pose:
        """Return the recorded pose of the base: the true one, or that of the start where the task hid it."""
        return (base_pose(self._moments[self._here]) if self._moments else None) or self._start

    def odometry(self) -> Pose:
        """Return the same."""
        return self.pose()

    @property
    def collided(self) -> bool:
        """True when the recorded robot had touched something."""
        return bool(self._moments) and self._moments[self._here].collided

    def clock(self) -> float:
        """Return the recorded seconds since the scene was entered; 0 where the task hid them."""
        time_s = self._moments[self._here].time_s if self._moments else None
        return 0.0 if time_s is None else max(0.0, time_s - self._began_s)

    def halt(self, why: str) -> None:
        """Do nothing: nothing moves."""

    def close(self) -> None:
        """Close the file."""
        self._stack.close()

    def _next(self) -> int | None:
        after = range(self._here + 1, len(self._moments))
        return next((number for number in after if self._moments[number].action is not None), None)
