"""Many robots moved as arrays do what each would do by itself, to the last bit."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.motion import execute
from benchbot.core.platform import Many, PlatformSpec, Scene
from benchbot.plugin import Pose
from benchbot.plugins.simulation.poses import Poses, matrices
from benchbot.simulation import EXACT, State
from tests.plugins.simulation.test_kinematic import HALL, ROBOT, HallSimulator

IMU = {"imu": {"frame": "lidar", "noise": {"angular_velocity_sigma_radps": 0.01}}}
SENSED = ["image_rgb", "image_depth", "image_segment", "laser", "imu", "poses"]


def spec(localisation: Any, **changes: Any) -> PlatformSpec:
    return PlatformSpec(ROBOT | IMU | changes, localisation, Path("unused"))


def scene(x: float, y: float, yaw_rad: float) -> Scene:
    start = [math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2), x, y, 0.1]
    return Scene({**HALL, "start_pose": start}, Path())


def plain(observations: Any, reported: list[str]) -> dict[str, bytes]:
    """The arrays of one robot's observations, as many robots' are called."""
    seen = {name: observations[name] for name in ("image_rgb", "image_depth")}
    seen |= {name: observations["image_segment"][name] for name in ("class_segment_img", "instance_segment_img")}
    seen |= {"laser": observations["laser"]["scans"][:, 0]}
    seen |= {f"imu_{name}": value for name, value in observations["imu"].items()}
    poses = observations["poses"]
    for frame in reported:
        seen[f"pose_{frame}"] = np.concatenate([poses[frame]["translation_xyz"], poses[frame]["rotation_xyzw"]])
    return {name: array.tobytes() for name, array in seen.items()}


actions = st.tuples(st.booleans(), st.floats(-1.0, 1.0))
starts = st.tuples(st.floats(-2.5, 2.5), st.floats(-1.5, 1.5), st.floats(-4.0, 4.0))


@pytest.mark.parametrize("localisation", ["ground_truth", "noisy"])
@pytest.mark.parametrize("stops", [True, False])
@given(st.lists(st.tuples(starts, st.lists(actions, min_size=2, max_size=2)), min_size=1, max_size=4))
@settings(deadline=None, max_examples=15)
def test_each_of_many_does_what_one_does(localisation: Any, stops: bool, robots: list[Any]) -> None:
    told = spec(localisation, stops_before_contact=stops)
    many = HallSimulator(told).many(len(robots))
    assert many is not None
    ones = [HallSimulator(told) for _ in robots]
    for number, (one, (start, _)) in enumerate(zip(ones, robots, strict=True)):
        one.load(scene(*start), number)
        many.load(number, scene(*start), number)
    everyone = np.arange(len(robots))
    for step in range(2):
        straight = np.array([chosen[step][0] for _, chosen in robots])
        arguments = np.array([chosen[step][1] * (2.0 if chosen[step][0] else 90.0) for _, chosen in robots])
        ended = many.execute(everyone, straight, arguments)
        seen = many.observe(everyone, SENSED)
        for number, one in enumerate(ones):
            name, argument = ("move_distance", "distance") if straight[number] else ("move_angle", "angle")
            outcome = execute(one, name, {argument: float(arguments[number])}, None, one.config)
            assert many.outcomes[ended[number]] == outcome
            states = many._motion.states
            assert one.state == State(
                *(getattr(states, each)[number] for each in ("x", "y", "yaw_rad", "linear_mps", "angular_radps"))
            )
            assert (many.clock_s[number], many.collided[number]) == (one.clock(), one.collided)
            x, y, _ = one.pose().translation_xyz
            assert many.poses_xyyaw(everyone)[number].tolist() == [x, y, one.pose().yaw_rad]
            expected = plain(one.observe(SENSED), [*ROBOT["poses"], "camera"])
            assert {key: rows[number].tobytes() for key, rows in seen.items()} == expected


@pytest.mark.parametrize("count", [1, 3, 70])
def test_a_robot_does_the_same_among_any_number(count: int) -> None:
    many = HallSimulator(spec("noisy")).many(count)
    assert many is not None
    for number in range(count):
        many.load(number, scene(0.0, 0.02 * (number % 50), 0.1 * number), number)
    everyone = np.arange(count)
    for straight, argument in ((True, 1.3), (False, 50.0), (True, -0.4)):
        many.execute(everyone, np.full(count, straight), np.full(count, argument))
    rows = many.poses_xyyaw(everyone[:1])[0]
    alone = HallSimulator(spec("noisy"))
    alone.load(scene(0.0, 0.0, 0.0), 0)
    for name, arguments in (("move_distance", {"distance": 1.3}), ("move_angle", {"angle": 50.0})):
        execute(alone, name, arguments, None, alone.config)
    execute(alone, "move_distance", {"distance": -0.4}, None, alone.config)
    x, y, _ = alone.pose().translation_xyz
    assert rows.tolist() == [x, y, alone.pose().yaw_rad]


def test_velocities_are_held_until_contact() -> None:
    many, one = HallSimulator(spec("ground_truth")).many(2), HallSimulator(spec("ground_truth"))
    assert many is not None
    one.load(scene(2.5, 0.0, 0.0), 0)
    for number, x in enumerate((2.5, -1.0)):
        many.load(number, scene(x, 0.0, 0.0), 0)
    many.hold(np.arange(2), np.array([1.0, 1.0]), np.array([0.0, 0.3]), 1.0)
    for _ in range(20):
        if not one.collided:
            one.drive(1.0, 0.0, 0.05)
    assert many.collided.tolist() == [True, False]
    assert many.poses_xyyaw(np.arange(1))[0, 0] == one.state.x
    assert many.clock_s[0] == one.clock()


def test_what_moves_in_the_world_is_noticed() -> None:
    robot = HallSimulator(spec("ground_truth", stops_before_contact=True))
    many = robot.many(1)
    assert many is not None
    many.load(0, scene(0.0, 0.0, 0.0), 0)
    everyone, ahead = np.arange(1), (np.array([True]), np.array([0.3]))
    assert many.outcomes[many.execute(everyone, *ahead)[0]] == "reached"
    robot.world.clearance_m = lambda x, y: 0.75 - x  # type: ignore[method-assign]
    robot.world.revision += 1
    assert many.outcomes[many.execute(everyone, *ahead)[0]] == "blocked"


def test_physics_of_ones_own_moves_one_at_a_time() -> None:
    class Sliding(HallSimulator):
        def measured(self, before: State) -> tuple[State, State]:
            return before, before

    assert isinstance(HallSimulator(spec("noisy")), Many)
    assert Sliding(spec("noisy")).many(2) is None


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-7, 7)), min_size=1, max_size=5))
@settings(deadline=None, max_examples=30)
def test_many_poses_are_those_of_one(places: list[tuple[float, float, float]]) -> None:
    x, y, yaw_rad = np.array(places).T
    mount = Pose.from_xyz_rpy_deg((0.1, 0.05, 1.0), (-90, 3, -85))
    many = Poses.planar(x, y, yaw_rad, np.full(len(x), 0.2), EXACT) @ mount
    ones = [Pose.planar(*place, 0.2) @ mount for place in places]
    assert list(many) == ones
    assert matrices(many).tobytes() == matrices(ones).tobytes()
    assert many.yaws_rad(EXACT).tolist() == [one.yaw_rad for one in ones]
