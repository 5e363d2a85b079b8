"""The one abstraction over simulated and real robots: what a simulator or a driver implements."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, Self, runtime_checkable

from benchbot.core.channels import Observations
from benchbot.core.documents import EnvironmentDeclaration, RobotDeclaration
from benchbot.core.geometry import Pose

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Localisation = Literal["ground_truth", "noisy"]


@dataclass(frozen=True)
class PlatformSpec:
    """The argument of a simulator's or driver's `create`.

    `robot` is the robot's declaration. `localisation` says whether the `poses` channel reports true poses or
    those of drifting odometry. `options` are the user's settings for the plug-in. `cache_dir` holds what may be
    computed again. `ask` shows the operator a request, such as to carry the robot to its start, and returns when it is
    done; None where there is no operator to ask. `tell` says what the platform waits for in the middle of an action,
    which may be long, and None when it goes on. `note` says what it does where that takes long.
    """

    robot: RobotDeclaration
    localisation: Localisation
    cache_dir: Path
    options: Mapping[str, Any] = field(default_factory=dict)
    ask: Callable[[str], None] | None = None
    tell: Callable[[str | None], None] | None = None
    note: Callable[[str], None] | None = None

    if TYPE_CHECKING:  # What is read from a file is checked by its schema.

        def __init__(
            self,
            robot: Mapping[str, Any],
            localisation: Localisation,
            cache_dir: Path,
            options: Mapping[str, Any] = ...,
            ask: Callable[[str], None] | None = None,
            tell: Callable[[str | None], None] | None = None,
            note: Callable[[str], None] | None = None,
        ) -> None: ...


@dataclass(frozen=True)
class Scene:
    """One environment variant to put the robot into: its declaration and the folder it was read from."""

    environment: EnvironmentDeclaration
    folder: Path

    if TYPE_CHECKING:  # What is read from a file is checked by its schema.

        def __init__(self, environment: Mapping[str, Any], folder: Path) -> None: ...

    @property
    def start_pose(self) -> Pose:
        """The start of the robot's base frame, in the map frame."""
        return Pose.from_wxyz_xyz(self.environment["start_pose"])

    @property
    def trajectory(self) -> tuple[Pose, ...]:
        """The poses that `move_next` visits, in the map frame; empty when none are declared."""
        return tuple(Pose.from_wxyz_xyz(values) for values in self.environment.get("trajectory_poses", ()))


class Platform(Protocol):
    """A robot in a world. Lengths in metres, angles in radians, times in seconds, poses in the map frame.

    A simulator advances its own clock as fast as it can inside `drive`; a driver of a real robot lives in wall time.
    Everything stochastic draws from the seed of the last `load` (up to 256 bits), by
    `benchbot.core.randomness.generator`: same seed, same machine, same bytes.
    """

    @property
    def control_period_s(self) -> float:
        """The duration of one control tick of `drive`."""

    def load(self, scene: Scene, seed: int) -> None:
        """Put robot and world into the clean start state of `scene`, clock at zero, nothing collided."""

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels, all taken at one instant."""

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Apply one control tick: command a velocity along +x and about +z, held for `duration_s`.

        The platform enforces its own velocity and acceleration limits, and stops at contact.
        """

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Say whether holding this command for `horizon_s` and then braking would touch something."""

    def pose(self) -> Pose:
        """Return the true pose of the robot's base, or the best known one on a real robot."""

    def odometry(self) -> Pose:
        """Return where dead reckoning believes the base is, starting from the scene's start pose."""

    @property
    def velocity(self) -> tuple[float, float]:
        """The base's current velocity: linear m/s along +x, angular rad/s about +z."""

    @property
    def collided(self) -> bool:
        """True when the robot has touched something since `load`."""

    def clock(self) -> float:
        """Return the seconds since `load`: simulated time, or wall time on a real robot. Never jumps back."""

    def halt(self, why: str) -> None:
        """Stop a real robot at once and refuse to `drive` it again; called from another thread.

        The action under way, and every later one, raises a BenchbotError that ends the run. A simulated robot moves
        inside `drive` only: a simulator has nothing to do here.
        """

    def close(self) -> None:
        """Stop the robot and release everything. Safe to call twice."""


class Simulation(Platform, Protocol):
    """A platform whose robot can be put anywhere at no cost, as only a simulated one can."""

    def place(self, base: Pose) -> None:
        """Put the robot, at rest, at a pose in the map frame. Its wheels, and so its odometry, do not notice."""


@runtime_checkable
class Traceable(Protocol):
    """A platform that knows what a result on it depends on, beside declarations and software."""

    def provenance(self) -> Mapping[str, Any]:
        """Return it as plain data: of a driver for `provenance.robot.driver` of results (middleware, clocks, …), of a
        simulator for `provenance.machine` (its device); never waits."""


@runtime_checkable
class WholeActions(Protocol):
    """A platform that takes an action as a whole, since nothing is left of the ticks in it: what a robot has recorded.

    Its way ends where the recording does, whatever the trajectory of the environment says.
    """

    @property
    def at_end(self) -> bool:
        """True when no action can follow."""

    @property
    def driven_m(self) -> float | None:
        """The length of the path of the last action, None where it is not known."""

    def act(self, action: str) -> str:
        """Take one action to its end, and return its outcome (`benchbot.core.motion.Outcome`)."""


@runtime_checkable
class TakeOver(Protocol):
    """A platform whose robot a person can drive in the middle of an action, which waits meanwhile."""

    def taken_over_s(self) -> tuple[float, ...]:
        """Return for how long, each time since this was asked last, in seconds."""


@runtime_checkable
class Attended(Protocol):
    """A driver whose robot may move only while the supervisor gives signs of life."""

    @property
    def heartbeat_timeout_s(self) -> float:
        """The longest silence of the supervisor, in wall time; after that the robot is halted."""


class Holonomic(Protocol):
    """A platform whose base can drive sideways too, for `move_sideways`: `drive` brakes that velocity to zero."""

    @property
    def lateral_mps(self) -> float:
        """The base's current velocity in m/s along +y, to its left."""

    def drive_sideways(
        self, lateral_mps: float, angular_radps: float, duration_s: float, linear_mps: float = 0.0
    ) -> None:
        """Apply one control tick, as `drive` does, with a velocity along +y; that along +x is zero by default."""

    def contact_beside(self, lateral_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return whether holding this command for `horizon_s` and then braking would touch something."""


@runtime_checkable
class Manipulator(Protocol):
    """A platform with an arm, whose base stands while the arm moves."""

    def manipulate(self, action: str, arguments: Mapping[str, Any]) -> Iterator[str | None]:
        """Carry out an action of `benchbot.core.channels.MANIPULATION`: yield None after each control tick.

        At rest, yield how it ended (`benchbot.core.motion.Outcome`). Raises BenchbotError (failure `agent`) for an
        argument that the arm does not have, or that is beyond its limits.
        """


@dataclass(frozen=True)
class Witnessed:
    """The truth about the objects that a robot can move, for results alone: solutions are not told.

    `objects` are poses in the map frame of the middles of their boxes, by name: no rotation where a scene begins.
    `held` are those that a gripper touches. `energy_j` and `end_effector_path_m` are sums since `load` of the
    mechanical work of the arm's motors, braking included, and of the way of its end effector.
    """

    objects: Mapping[str, Pose]
    held: tuple[str, ...] = ()
    energy_j: float = 0.0
    end_effector_path_m: float = 0.0


@runtime_checkable
class Witness(Protocol):
    """A simulator that knows where the objects are that a robot can move."""

    def witnessed(self) -> Witnessed | None:
        """Return what it knows now; None where nothing can be moved."""


@runtime_checkable
class ManyCameras(Protocol):
    """A simulator of which many robots of one process can share the scenes and be observed at once."""

    def twin(self) -> Self:
        """Return another simulator of the same spec, not yet loaded, that shares what scenes are made of."""

    def observe_many(self, platforms: Sequence[Self], channels: Iterable[str]) -> list[Observations]:
        """Return what each of this one's twins (itself may be one) would observe now, to the byte."""


class ManyRobots(Protocol):
    """N robots of one simulator, numbered from 0, that are moved and observed as arrays; M of them at a time.

    Each does what one robot alone would do, to the byte on processors: `benchbot.core.session` says what that is.
    """

    outcomes: tuple[str, ...]
    """The ends of actions (`benchbot.core.motion.Outcome`), by the numbers that `execute` returns."""

    @property
    def collided(self) -> "NDArray[np.bool_]":
        """Who has touched something since it was loaded (N,)."""

    @property
    def clock_s(self) -> "NDArray[np.float64]":
        """Simulated seconds since each was loaded (N,)."""

    def load(self, robot: int, scene: Scene, seed: int) -> None:
        """Put a robot into the clean start state of a scene."""

    def execute(
        self, robots: "NDArray[np.intp]", straight: "NDArray[np.bool_]", arguments: "NDArray[np.float64]"
    ) -> "NDArray[np.intp]":
        """Execute move_distance (m) where `straight`, else move_angle (degrees), to its end; return its end (M,)."""

    def hold(
        self,
        robots: "NDArray[np.intp]",
        linear_mps: "NDArray[np.float64]",
        angular_radps: "NDArray[np.float64]",
        duration_s: float,
    ) -> None:
        """Hold velocities (M,) for a while, in whole control ticks; who touches something stays."""

    def poses_xyyaw(self, robots: "NDArray[np.intp]") -> "NDArray[np.float64]":
        """Return the true places and headings (M, 3) of the bases in the map frame."""

    def pose(self, robot: int) -> Pose:
        """Return the true pose of one robot's base."""

    def constants(self, robot: int, channels: Iterable[str]) -> Observations:
        """Return of the channels what does not change within a scene; the rest of them is left out, or empty."""

    def observe(self, robots: "NDArray[np.intp]", channels: Sequence[str]) -> "dict[str, NDArray[Any]]":
        """Return what these robots observe now: arrays with a row for each.

        `image_rgb`, `image_depth`, `class_segment_img`, `instance_segment_img`; `laser` and `lidar`, ranges in metres;
        `imu_…`, its vectors; `pose_FRAME`, positions and quaternions (7,). Values are those of the channels.
        """


@runtime_checkable
class ManyTensors(Protocol):
    """`ManyRobots` whose pictures and scans can stay where they were made, as tensors of torch."""

    def tensor_device(self) -> str:
        """The name of that place, as torch has it."""

    def tensors(self, robots: "NDArray[np.intp]", channels: Sequence[str]) -> dict[str, Any]:
        """Return those of `channels` of which that is true, as `ManyRobots.observe` has them but finite.

        0 is nothing measured, or too near; what is as far as a sensor's range, or farther, has that range.
        """


@runtime_checkable
class Many(Protocol):
    """A simulator whose robots can be moved as arrays."""

    def many(self, count: int) -> ManyRobots | None:
        """Return so many robots like this one, not yet loaded; None where each has to be moved by itself."""
