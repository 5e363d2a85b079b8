"""Motion reaches its goal within 1 cm and 1 degree on anything that drives like a unicycle, and stops before harm."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from benchbot_sample.simulator import SampleSimulator
from benchbot_sample.unicycle import Limits, State, substeps
from hypothesis import example, given, settings
from hypothesis import strategies as st

from benchbot.core.channels import Observations
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Platform, PlatformSpec, Scene
from benchbot.core.track import TrackedPlatform

SAMPLE = Path(__file__).parent.parent / "sample_plugin" / "benchbot_sample"

PERFECT = Limits((-0.6, 1.5), 1.0)
SLUGGISH = Limits((-0.6, 1.5), 1.0, linear_acceleration_mps2=1.0, angular_acceleration_radps2=2.0)
drives = pytest.mark.parametrize("limits", [PERFECT, SLUGGISH], ids=["perfect", "sluggish"])


class OpenFloor:
    """A unicycle with nothing to bump into; its odometry scales every motion by `odometry_scale`."""

    control_period_s = 0.05
    collided = False

    def __init__(self, limits: Limits, start: State, odometry_scale: float = 1.0) -> None:
        self.limits = limits
        self.state = self.believed = start
        self.odometry_scale = odometry_scale
        self.commands: list[tuple[float, float]] = []

    def load(self, scene: Scene, seed: int) -> None:
        raise NotImplementedError

    def observe(self, channels: Iterable[str]) -> Observations:
        raise NotImplementedError

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        self.commands.append((linear_mps, angular_radps))
        for state in substeps(self.state, linear_mps, angular_radps, duration_s, self.limits):
            turn_rad = state.yaw_rad - self.state.yaw_rad
            way_m = math.copysign(math.dist((state.x, state.y), (self.state.x, self.state.y)), state.linear_mps)
            self.believed = self.believed.moved(way_m * self.odometry_scale, turn_rad * self.odometry_scale, 1.0)
            self.state = state

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        return False

    def pose(self) -> Pose:
        return Pose.planar(self.state.x, self.state.y, self.state.yaw_rad)

    def odometry(self) -> Pose:
        return Pose.planar(self.believed.x, self.believed.y, self.believed.yaw_rad)

    @property
    def velocity(self) -> tuple[float, float]:
        return self.state.linear_mps, self.state.angular_radps

    def clock(self) -> float:
        return len(self.commands) * self.control_period_s

    def halt(self, why: str) -> None:
        pass

    def close(self) -> None:
        pass


def arena(environment: str = "arena_1", robot: str = "sample_robot") -> tuple[SampleSimulator, MotionConfig]:
    """The sample robot at (-2, 0) heading along +x: a wall 5 m ahead and 1 m behind, and its motion as declared."""
    declaration = schema.read(SAMPLE / "robots" / f"{robot}.yaml")
    path = SAMPLE / "environments" / f"{environment}.yaml"
    platform = SampleSimulator(PlatformSpec(declaration, "ground_truth", SAMPLE))
    platform.load(Scene(schema.read(path), path.parent), seed=0)
    return platform, MotionConfig.from_robot(declaration, "ground_truth")


def assert_stands_at(platform: Platform, goal: Pose, pose: Pose | None = None) -> None:
    pose = pose or platform.pose()
    assert math.dist(pose.translation_xyz, goal.translation_xyz) <= 0.01
    assert abs(math.degrees(wrap_angle_rad(pose.yaw_rad - goal.yaw_rad))) <= 1.0
    assert platform.velocity == pytest.approx((0.0, 0.0), abs=1e-9)


# No subnormal numbers: some libraries that other tests load make the processor round them to zero, for good.
angles_rad = st.floats(-math.pi, math.pi, allow_subnormal=False)
metres = st.floats(-3.0, 3.0, allow_subnormal=False)
states = st.builds(State, metres, metres, angles_rad)


@drives
@settings(deadline=None)
@given(start=states, distance_m=metres)
def test_move_distance_ends_at_the_goal(limits: Limits, start: State, distance_m: float) -> None:
    platform = OpenFloor(limits, start)
    goal = platform.pose() @ Pose((distance_m, 0.0, 0.0))
    outcome = execute(platform, "move_distance", {"distance": distance_m}, None, MotionConfig())
    assert outcome is Outcome.REACHED
    assert_stands_at(platform, goal)


@drives
@settings(deadline=None)
@given(start=states, angle_deg=st.floats(-1080.0, 1080.0))
def test_move_angle_turns_by_the_whole_angle_on_the_spot(limits: Limits, start: State, angle_deg: float) -> None:
    platform = OpenFloor(limits, start)
    assert execute(platform, "move_angle", {"angle": angle_deg}, None, MotionConfig()) is Outcome.REACHED
    assert math.degrees(platform.state.yaw_rad - start.yaw_rad) == pytest.approx(angle_deg, abs=1.0)
    assert (platform.state.x, platform.state.y) == (start.x, start.y)
    assert platform.velocity == pytest.approx((0.0, 0.0), abs=1e-9)


@drives
@settings(deadline=None)
@given(start=states, goal=st.builds(Pose.planar, metres, metres, angles_rad))
def test_move_next_ends_at_the_goal(limits: Limits, start: State, goal: Pose) -> None:
    platform = OpenFloor(limits, start)
    assert execute(platform, "move_next", {}, goal, MotionConfig()) is Outcome.REACHED
    assert_stands_at(platform, goal)


class LateFloor(OpenFloor):
    """A floor on which commands take effect some ticks late, and poses are noisy; it sums up how much is turned."""

    def __init__(self, start: State, late_ticks: int, noise: float, seed: int) -> None:
        super().__init__(SLUGGISH, start)
        self.noise = noise
        self.turned_rad = 0.0
        self._on_their_way = [(0.0, 0.0)] * late_ticks
        self._random = np.random.default_rng(seed)

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        self._on_their_way.append((linear_mps, angular_radps))
        before_rad = self.state.yaw_rad
        super().drive(*self._on_their_way.pop(0), duration_s)
        self.turned_rad += abs(self.state.yaw_rad - before_rad)

    def pose(self) -> Pose:
        x, y, yaw_rad = self._random.normal((self.state.x, self.state.y, self.state.yaw_rad), self.noise)
        return Pose.planar(float(x), float(y), float(yaw_rad))


@settings(deadline=None)
@given(
    distance_m=st.floats(0.015, 0.095),
    bearing_rad=angles_rad,
    yaw_rad=st.floats(-0.5, 0.5),
    late_ticks=st.integers(0, 1),
    noise=st.sampled_from([0.0, 0.001]),
    seed=st.integers(0, 1000),
)
@example(distance_m=0.015, bearing_rad=0.0, yaw_rad=0.5, late_ticks=1, noise=0.001, seed=0)
def test_a_goal_nearby_is_reached_without_swinging(
    distance_m: float, bearing_rad: float, yaw_rad: float, late_ticks: int, noise: float, seed: int
) -> None:
    start = State(-distance_m * math.cos(bearing_rad), -distance_m * math.sin(bearing_rad), yaw_rad)
    platform = LateFloor(start, late_ticks, noise, seed)
    assert execute(platform, "move_next", {}, Pose(), MotionConfig()) is Outcome.REACHED
    # By the noisy pose it is within the tolerances.
    assert math.hypot(platform.state.x, platform.state.y) <= 0.01 + 5 * noise
    assert abs(platform.state.yaw_rad) <= math.radians(1.0) + 5 * noise
    # A turn to the goal or away from it, by hardly more than a right angle, and one to its heading.
    assert platform.turned_rad <= 1.05 * math.pi + abs(yaw_rad) + 0.4


@pytest.mark.parametrize("late_ticks", [0, 1, 2])
@pytest.mark.parametrize(("x", "y"), [(-0.012, 0.0), (-0.012, 0.004), (0.02, -0.003)])
def test_a_centimetre_and_half_a_radian_off_need_no_swinging(x: float, y: float, late_ticks: int) -> None:
    platform = LateFloor(State(x, y, 0.5), late_ticks, 0.0, 0)
    assert execute(platform, "move_next", {}, Pose(), MotionConfig()) is Outcome.REACHED
    assert platform.turned_rad <= 1.6


@settings(deadline=None)
@given(distance_m=st.floats(0.0, 1.0), bearing_rad=angles_rad, yaw_rad=angles_rad, late_ticks=st.integers(0, 1))
def test_from_anywhere_within_a_metre_little_is_turned(
    distance_m: float, bearing_rad: float, yaw_rad: float, late_ticks: int
) -> None:
    start = State(distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad), yaw_rad)
    platform = LateFloor(start, late_ticks, 0.0, 0)
    assert execute(platform, "move_next", {}, Pose(), MotionConfig()) is Outcome.REACHED
    assert math.hypot(platform.state.x, platform.state.y) <= 0.01
    assert abs(wrap_angle_rad(platform.state.yaw_rad)) <= math.radians(1.0)
    assert platform.turned_rad <= 3 * math.pi


@settings(deadline=None)
@given(start=states, distance_m=metres)
def test_acceleration_limits_cause_no_overshoot(start: State, distance_m: float) -> None:
    platform = OpenFloor(SLUGGISH, start)
    execute(platform, "move_distance", {"distance": distance_m}, None, MotionConfig())
    assert all(math.copysign(1.0, distance_m) * linear_mps >= 0 for linear_mps, _ in platform.commands)


@pytest.mark.parametrize("declared", [1.1, 1.3, 1.5, 2.0, 3.0])
def test_a_robot_weaker_than_declared_still_arrives(declared: float) -> None:
    config = MotionConfig(linear_acceleration_mps2=declared, angular_acceleration_radps2=2.0 * declared)
    for action, arguments, goal in (
        ("move_distance", {"distance": 2.0}, Pose.planar(2.0, 0.0, 0.0)),
        ("move_angle", {"angle": 90.0}, Pose.planar(0.0, 0.0, math.pi / 2)),
        ("move_next", {}, Pose.planar(2.0, 1.0, math.pi / 2)),
    ):
        platform = OpenFloor(SLUGGISH, State(0.0, 0.0, 0.0))
        assert execute(platform, action, arguments, goal, config) is Outcome.REACHED
        assert math.dist((platform.state.x, platform.state.y), goal.translation_xyz[:2]) <= 0.01


def test_nothing_to_do_is_done_at_once() -> None:
    platform = OpenFloor(PERFECT, State(1.0, 2.0, 0.5))
    for action in ("move_distance", "move_angle"):
        assert execute(platform, action, {}, None, MotionConfig()) is Outcome.REACHED
    assert execute(platform, "move_next", {}, platform.pose(), MotionConfig()) is Outcome.REACHED
    assert platform.clock() == 0.0


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("bearing_deg", "direction"), [(0, 1), (45, 1), (90, 1), (94, 1), (95, -1), (174, -1)])
def test_a_goal_behind_is_approached_in_reverse(bearing_deg: float, direction: int, side: int) -> None:
    platform = OpenFloor(PERFECT, State(0.0, 0.0, 0.0))
    bearing_rad = math.radians(side * bearing_deg)
    execute(platform, "move_next", {}, Pose.planar(math.cos(bearing_rad), math.sin(bearing_rad), 0.0), MotionConfig())
    assert all(direction * linear_mps >= 0.0 for linear_mps, _ in platform.commands)


def test_a_robot_that_is_pushed_off_its_line_returns_to_it_within_its_limits() -> None:
    class Gust(OpenFloor):
        def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
            super().drive(linear_mps, angular_radps, duration_s)
            if len(self.commands) == 10:
                self.state = self.believed = replace(self.state, y=self.state.y + 0.3)

    platform = Gust(PERFECT, State(0.0, 0.0, 0.0))
    config = MotionConfig(angular_limit_radps=0.6, speed_factor=0.5)
    assert execute(platform, "move_distance", {"distance": 4.0}, None, config) is Outcome.REACHED
    assert_stands_at(platform, Pose((4.0, 0.0, 0.0)))
    fastest_radps = max(abs(angular_radps) for _, angular_radps in platform.commands)
    assert fastest_radps == pytest.approx(0.6 * 0.5)


def test_a_robot_that_never_comes_to_rest_is_waited_for_no_more_than_five_seconds() -> None:
    class Creeping(OpenFloor):
        velocity = (0.01, 0.0)

    platform = Creeping(PERFECT, State(0.0, 0.0, 0.0))
    assert execute(platform, "move_angle", {"angle": 0.0}, None, MotionConfig()) is Outcome.REACHED
    assert platform.clock() == pytest.approx(5.0)


@settings(deadline=None)
@given(start=states, goal=st.builds(Pose.planar, metres, metres, angles_rad), factor=st.floats(0.3, 1.5))
def test_commands_keep_the_limits(start: State, goal: Pose, factor: float) -> None:
    platform = OpenFloor(PERFECT, start)
    execute(platform, "move_next", {}, goal, MotionConfig(speed_factor=factor))
    for linear_mps, angular_radps in platform.commands:
        assert -0.6 * factor - 1e-9 <= linear_mps <= 1.5 * factor + 1e-9
        assert abs(angular_radps) <= 1.0 * factor + 1e-9


@pytest.mark.parametrize("turn_deg", [90.0, 180.0, -120.0])
def test_how_a_robot_drives_does_not_depend_on_where_the_map_begins(turn_deg: float) -> None:
    def driven(origin: Pose) -> list[tuple[float, float]]:
        start, goal = origin @ Pose.planar(0.5, -0.5, 0.4), origin @ Pose.planar(2.0, 1.0, 1.5)
        platform = OpenFloor(SLUGGISH, State(*start.translation_xyz[:2], start.yaw_rad))
        assert execute(platform, "move_next", {}, goal, MotionConfig()) is Outcome.REACHED
        return platform.commands

    here, there = driven(Pose.planar(0.0, 0.0, 0.0)), driven(Pose.planar(7.0, -4.0, math.radians(turn_deg)))
    assert np.array(there) == pytest.approx(np.array(here), abs=1e-6)


def test_a_curve_ends_nearly_in_the_direction_of_its_goal() -> None:
    platform, goal = OpenFloor(PERFECT, State(0.0, 0.0, 0.0)), Pose.planar(2.0, 1.0, math.radians(60))
    execute(platform, "move_next", {}, goal, MotionConfig())
    turned_on_the_spot_rad = sum(angular * 0.05 for linear, angular in platform.commands if linear == 0.0)
    assert abs(math.degrees(turned_on_the_spot_rad)) < 10.0


@pytest.mark.parametrize("acceleration_mps2", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(("distance_m", "fastest_mps"), [(3.0, 1.5), (-3.0, -0.6)])
def test_a_robot_drives_as_fast_as_it_can_still_brake(
    acceleration_mps2: float, distance_m: float, fastest_mps: float
) -> None:
    platform = OpenFloor(PERFECT, State(0.0, 0.0, 0.0))
    config = MotionConfig(linear_acceleration_mps2=acceleration_mps2)
    execute(platform, "move_distance", {"distance": distance_m}, None, config)

    remaining_m = abs(distance_m)
    speeds_mps = [linear_mps for linear_mps, _ in platform.commands if linear_mps]
    assert speeds_mps[0] == pytest.approx(fastest_mps)
    for linear_mps in speeds_mps:
        # Another tick at this speed and braking with 80 % of the acceleration end at the goal: v t + v² / 2a.
        stopping_m = abs(linear_mps) * 0.05 + linear_mps**2 / (2 * 0.8 * acceleration_mps2)
        assert linear_mps == pytest.approx(fastest_mps) or stopping_m == pytest.approx(remaining_m)
        assert stopping_m <= remaining_m + 1e-9
        remaining_m -= abs(linear_mps) * 0.05


@pytest.mark.parametrize("acceleration_radps2", [0.5, 2.0])
def test_a_robot_turns_as_fast_as_it_can_still_brake(acceleration_radps2: float) -> None:
    platform = OpenFloor(PERFECT, State(0.0, 0.0, 0.0))
    config = MotionConfig(angular_acceleration_radps2=acceleration_radps2)
    execute(platform, "move_angle", {"angle": -180.0}, None, config)

    remaining_rad = math.pi
    for angular_radps in (angular_radps for _, angular_radps in platform.commands if angular_radps):
        stopping_rad = abs(angular_radps) * 0.05 + angular_radps**2 / (2 * 0.8 * acceleration_radps2)
        assert angular_radps == pytest.approx(-1.0) or stopping_rad == pytest.approx(remaining_rad)
        remaining_rad -= abs(angular_radps) * 0.05


@pytest.mark.parametrize(("action", "goal"), [("fly", Pose.planar(1.0, 0.0, 0.0)), ("move_next", None)])
def test_what_is_no_motion_moves_nothing(action: str, goal: Pose | None) -> None:
    platform = OpenFloor(PERFECT, State(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=f"no such motion: '{action}' with goal"):
        execute(platform, action, {}, goal, MotionConfig())
    assert platform.commands == []


def test_noisy_localisation_steers_by_odometry() -> None:
    platform = OpenFloor(SLUGGISH, State(0.0, 0.0, 0.0), odometry_scale=0.8)
    execute(platform, "move_distance", {"distance": 1.0}, None, MotionConfig(localisation="noisy"))
    assert_stands_at(platform, Pose((1.0, 0.0, 0.0)), platform.odometry())
    assert platform.state.x == pytest.approx(1.25, abs=0.0125)


@pytest.mark.parametrize(("action", "argument"), [("move_distance", "distance"), ("move_angle", "angle")])
def test_a_phase_that_takes_too_long_times_out_at_rest(action: str, argument: str) -> None:
    platform = OpenFloor(SLUGGISH, State(0.0, 0.0, 0.0))
    assert execute(platform, action, {argument: 5000.0}, None, MotionConfig()) is Outcome.TIMEOUT
    assert 30.0 <= platform.clock() <= 32.0
    assert platform.velocity == pytest.approx((0.0, 0.0), abs=1e-9)


class Navigated(OpenFloor):
    """A floor whose robot is navigated: it appears 0.1 m before its goal, and the navigation ends as it is told."""

    def __init__(self, ending: Outcome | None) -> None:
        super().__init__(PERFECT, State(0.0, 0.0, 0.0))
        self.ending = ending

    def navigate(self, goal: Pose) -> Iterator[Outcome | None]:
        if self.ending is not None:
            self.state = replace(self.state, x=goal.translation_xyz[0] / 2)
            yield None
            self.state = replace(self.state, x=goal.translation_xyz[0] - 0.1)
            yield self.ending


def test_what_navigation_leaves_of_the_way_is_driven() -> None:
    platform = Navigated(Outcome.REACHED)
    tracked = TrackedPlatform(platform)
    tracked.begin()
    assert (
        execute(cast(Platform, tracked), "move_next", {}, Pose.planar(2.0, 0.0, 0.3), MotionConfig()) is Outcome.REACHED
    )
    assert_stands_at(platform, Pose.planar(2.0, 0.0, 0.3))
    assert platform.clock() < 3.0
    assert tracked.take().length_m == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("ending", [Outcome.BLOCKED, Outcome.COLLIDED, Outcome.TIMEOUT])
def test_a_navigation_that_does_not_arrive_ends_the_action(ending: Outcome) -> None:
    platform = Navigated(ending)
    assert execute(platform, "move_next", {}, Pose.planar(2.0, 0.0, 0.0), MotionConfig()) is ending
    assert platform.commands == []


def test_other_actions_and_platforms_without_navigation_are_steered() -> None:
    platform = Navigated(Outcome.BLOCKED)
    assert execute(platform, "move_distance", {"distance": 0.5}, None, MotionConfig()) is Outcome.REACHED
    for floor in (Navigated(None), OpenFloor(PERFECT, State(0.0, 0.0, 0.0))):
        tracked = TrackedPlatform(floor)
        tracked.begin()
        assert (
            execute(cast(Platform, tracked), "move_next", {}, Pose.planar(0.5, 0.0, 0.0), MotionConfig())
            is Outcome.REACHED
        )
        assert_stands_at(floor, Pose.planar(0.5, 0.0, 0.0))


def test_driving_into_a_wall_collides_at_contact() -> None:
    platform, config = arena()
    assert execute(platform, "move_distance", {"distance": 6.0}, None, config) is Outcome.COLLIDED
    assert platform.collided
    assert platform.velocity == pytest.approx((0.0, 0.0), abs=1e-9)
    assert platform.pose().translation_xyz[0] == pytest.approx(3.0 - 0.2, abs=0.001)


@pytest.mark.parametrize("distance_m", [6.0, -3.0])
def test_a_careful_robot_stops_before_the_wall(distance_m: float) -> None:
    platform, config = arena(robot="sample_careful_robot")
    assert execute(platform, "move_distance", {"distance": distance_m}, None, config) is Outcome.BLOCKED
    assert not platform.collided
    assert platform.velocity == pytest.approx((0.0, 0.0), abs=1e-9)
    x = platform.pose().translation_xyz[0]
    gap_m = 3.0 - 0.2 - abs(x)
    assert 0.0 < gap_m < 0.1


def test_a_blocked_robot_can_drive_away_again() -> None:
    platform, config = arena(robot="sample_careful_robot")
    execute(platform, "move_distance", {"distance": 6.0}, None, config)
    assert execute(platform, "move_distance", {"distance": -1.0}, None, config) is Outcome.REACHED


def test_a_goal_close_to_a_wall_is_reached_by_a_careful_robot() -> None:
    platform, config = arena(robot="sample_careful_robot")
    # Half a centimetre is left between the wall and the robot.
    assert execute(platform, "move_distance", {"distance": 4.795}, None, config) is Outcome.REACHED


def test_a_whole_trajectory_is_driven_in_the_sample_arena() -> None:
    platform, config = arena(robot="sample_careful_robot")
    scene = schema.read(SAMPLE / "environments" / "arena_1.yaml")
    for values in scene["trajectory_poses"]:
        goal = Pose.from_wxyz_xyz(values)
        assert execute(platform, "move_next", {}, goal, config) is Outcome.REACHED
        assert_stands_at(platform, goal)


@pytest.mark.parametrize(
    "limits",
    [
        {"linear_mps": [0.6, 1.5]},
        {"linear_mps": 1.5},
        {"linear_mps": [-1, 0]},
        {"linear_mps": [-1, math.inf]},
        {"angular_radps": 0},
        {"angular_radps": "fast"},
        {"linear_acceleration_mps2": -1.0},
        {"angular_acceleration_radps2": math.nan},
    ],
)
def test_senseless_limits_are_explained(limits: dict[str, Any]) -> None:
    with pytest.raises(BenchbotError, match=next(iter(limits))):
        MotionConfig.from_robot({"limits": limits}, "ground_truth")


def test_what_a_robot_does_not_declare_is_as_in_v2() -> None:
    config = MotionConfig.from_robot({}, "ground_truth")
    assert config == MotionConfig()
    assert (config.linear_limits_mps, config.angular_limit_radps, config.speed_factor) == ((-0.6, 1.5), 1.0, 1.0)
    assert (config.position_tolerance_m, config.angle_tolerance_rad) == (0.01, math.radians(1.0))
    assert not config.stops_before_contact


def test_a_robot_declares_its_own_tolerances() -> None:
    config = MotionConfig.from_robot({"tolerances": {"position_m": 0.03, "angle_deg": 2.0}}, "ground_truth")
    assert config.position_tolerance_m == 0.03
    assert math.isclose(config.angle_tolerance_rad, math.radians(2.0))
    with pytest.raises(BenchbotError, match=r"tolerances\.position_m is 0"):
        MotionConfig.from_robot({"tolerances": {"position_m": 0}}, "ground_truth")
