"""The track: where the robot really went, whatever the solution says, row by row."""

import itertools
import math
from pathlib import Path
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core import results
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import Platform, PlatformSpec, Scene, Witnessed
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import Selection, select
from benchbot.core.session import Session
from benchbot.core.track import ROW_ANGLE_RAD, ROW_DISTANCE_M, DrivenPath, Track, TrackedPlatform, Waypoint

COLUMNS = ["observation", "time_s", "x_m", "y_m", "yaw_rad"]


def chosen(task: str = "sample:active", environment: str = "arena:1", robot: str = "sample_robot") -> Selection:
    return select(Catalog(load()), RunRequest(task=task, robot=robot, environment=environment, seed=3))


def started(selection: Selection, cache_dir: Path) -> Session:
    robot = selection.robot.data

    def start() -> InProcessHost:
        kind = "simulators" if robot["type"] in load().pool("simulators") else "robot_drivers"
        platform = load().record(kind, robot["type"]).create(PlatformSpec(robot, selection.localisation, cache_dir))
        scenes = [Scene(scene.data, scene.path.parent) for scene in selection.environments]
        return InProcessHost(platform, scenes, MotionConfig.from_robot(robot, selection.localisation))

    session = Session(selection, start)
    session.reset()
    return session


def tracks(session: Session) -> list[dict[str, Any]]:
    document = results.finish(results.empty_result(session.selection), session)
    schema.check(document, "result", Path("result.json"))
    found: list[dict[str, Any]] = document["track"]
    return found


def test_a_drive_straight_ahead_has_a_row_every_five_centimetres(tmp_path: Path) -> None:
    session = started(chosen(), tmp_path)
    session.step("move_distance", {"distance": 1.0})

    (track,) = tracks(session)
    rows = track["rows"]
    assert (track["scene"], track["source"], track["collisions"]) == ("arena:1", "simulation", 0)
    assert track["columns"] == COLUMNS
    assert track["path_length_m"] == pytest.approx(1.0, abs=0.012)
    assert rows[0] == [0, 0.0, -2.0, 0.0, 0.0]
    assert rows[-1][0] == 1
    assert rows[-1][2] == pytest.approx(-1.0, abs=0.012)
    # A control tick may overshoot the five centimetres by what is driven in it: 1.5 m/s for 50 ms.
    steps = [after[2] - before[2] for before, after in itertools.pairwise(rows[:-1])]
    assert all(ROW_DISTANCE_M <= step <= ROW_DISTANCE_M + 0.075 + 1e-6 for step in steps)
    assert [row[1] for row in rows] == sorted(row[1] for row in rows)


def test_a_turn_on_the_spot_has_a_row_every_five_degrees_and_no_length(tmp_path: Path) -> None:
    session = started(chosen(), tmp_path)
    session.step("move_angle", {"angle": 360.0})

    (track,) = tracks(session)
    assert track["path_length_m"] == 0
    assert len(track["rows"]) > 30
    turns = [math.remainder(b[4] - a[4], 2 * math.pi) for a, b in itertools.pairwise(track["rows"][:-1])]
    assert all(ROW_ANGLE_RAD - 1e-6 <= turn <= ROW_ANGLE_RAD + 0.051 for turn in turns)


def test_every_observation_has_a_row_with_its_number(tmp_path: Path) -> None:
    session = started(chosen("sample:two_scenes", "arena:1:2"), tmp_path)
    session.step(None)
    session.step("move_next")
    session.next_scene()
    session.step(None)

    first, second = tracks(session)
    numbers = [[row[0] for row in track["rows"] if row[0] is not None] for track in (first, second)]
    assert numbers == [[0, 1, 2], [3, 4]]
    assert [track["scene"] for track in (first, second)] == ["arena:1", "arena:2"]
    assert second["rows"][0][1] == 0.0


def test_it_is_the_true_way_where_the_solution_sees_a_drifting_one(tmp_path: Path) -> None:
    session = started(chosen("sample:noisy"), tmp_path)
    step = session.step("move_distance", {"distance": 2.0})

    (track,) = tracks(session)
    believed_x = step.observations["poses"]["base_link"]["translation_xyz"][0]
    assert abs(track["rows"][-1][2] - believed_x) > 1e-4
    assert track["rows"][-1][2] == pytest.approx(session.progress.pose_xyyaw[0], abs=1e-6)


def test_a_collision_is_counted_and_a_reset_begins_a_new_track(tmp_path: Path) -> None:
    session = started(chosen(), tmp_path)
    session.step("move_distance", {"distance": 9.0})
    assert tracks(session)[0]["collisions"] == 1

    session.reset()
    (track,) = tracks(session)
    assert (track["collisions"], track["path_length_m"], len(track["rows"])) == (0, 0.0, 1)


def test_the_pose_of_a_real_robot_is_its_own_word(tmp_path: Path) -> None:
    assert tracks(started(chosen(robot="sample_real_robot"), tmp_path))[0]["source"] == "robot"


def test_what_a_solution_claims_of_its_track_is_replaced(tmp_path: Path) -> None:
    session = started(chosen(), tmp_path)
    document = {**results.empty_result(session.selection), "track": [{"scene": "moon:1"}]}

    assert results.finish(document, session)["track"][0]["scene"] == "arena:1"
    assert results.failed(session)["track"][0]["scene"] == "arena:1"


def test_resets_after_moving_are_counted_until_a_result_is_handed_in(tmp_path: Path) -> None:
    session = started(chosen(), tmp_path)
    session.reset()
    assert session.progress.spent.restarts == 0
    for _ in range(2):
        session.step("move_distance", {"distance": 0.1})
        session.reset()
    assert results.finish(results.empty_result(session.selection), session)["provenance"]["restarts"] == 2
    session.step("move_distance", {"distance": 0.1})
    session.reset()
    assert session.progress.spent.restarts == 0


class Rail:
    """A wagon that moves 10 cm a tick, and does not know where it is in a tunnel."""

    def __init__(self, tunnel: set[int]) -> None:
        self.ticks = 0
        self.tunnel = tunnel

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        self.ticks += 1

    def pose(self) -> Pose:
        if self.ticks in self.tunnel:
            raise BenchbotError("The wagon is lost.", "It is dark.", "Drive on.")
        return Pose.planar(self.ticks / 10, 0, 0)

    def clock(self) -> float:
        return float(self.ticks)


def test_a_robot_that_has_lost_its_pose_for_a_moment_drives_on_and_its_path_is_straight() -> None:
    tracked = TrackedPlatform(cast(Platform, Rail({2, 3})))
    tracked.begin()
    for _ in range(5):
        tracked.drive(2.0, 0.0, 0.05)

    path = tracked.take()
    assert path.length_m == pytest.approx(0.5)
    assert [place.x_m for place in path.waypoints] == pytest.approx([0.1, 0.4, 0.5])
    assert tracked.take() == DrivenPath()


places = st.builds(Waypoint, *[st.floats(-50, 50, allow_nan=False)] * 4)


@given(st.lists(places, min_size=1))
def test_without_its_path_a_robot_went_straight(waypoints: list[Waypoint]) -> None:
    track = Track("rail:1")
    for number, here in enumerate(waypoints):
        track.follow(here, None, collided=False)
        track.observed(number)

    written = track.as_dict("simulation")
    straight_m = sum(math.dist(a[1:3], b[1:3]) for a, b in itertools.pairwise(waypoints))
    assert written["path_length_m"] == pytest.approx(straight_m, abs=1e-5)
    assert [row[0] for row in written["rows"]] == list(range(len(waypoints)))
    assert "-0.0" not in str(written["rows"]).replace("-0.0e", "").split(",")


def test_a_place_that_is_observed_from_has_one_row() -> None:
    here = Waypoint(1.0, 0.05, 0.0, 0.0)
    track = Track("rail:1")
    track.follow(here, DrivenPath(0.05, (here,)), collided=False)
    track.observed(0)

    assert track.as_dict("robot")["rows"] == [[0, 1.0, 0.05, 0.0, 0.0]]


def test_objects_have_a_row_where_they_have_moved() -> None:
    track = Track("room:1")
    here = Pose((1.0, 2.0, 0.8))
    for time_s, pose in enumerate((here, Pose((1.0, 2.0005, 0.8)), Pose((1.0, 2.2, 0.8)), Pose((1.0, 2.2, 0.8)))):
        track.witness(Witnessed({"cup": pose}, held=("cup",), energy_j=3.0, end_effector_path_m=0.5), float(time_s))
    document = track.as_dict("simulation")
    assert document["objects"] == [
        {
            "name": "cup",
            "columns": ["time_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"],
            "rows": [[0.0, 1.0, 2.0, 0.8, 0.0, 0.0, 0.0, 1.0], [2.0, 1.0, 2.2, 0.8, 0.0, 0.0, 0.0, 1.0]],
        }
    ]
    assert (document["held"], document["energy_j"], document["end_effector_path_m"]) == (["cup"], 3.0, 0.5)


def test_where_nothing_can_be_moved_a_track_tells_of_no_objects() -> None:
    track = Track("room:1")
    track.witness(None, 1.0)
    assert not track.as_dict("simulation").keys() & {"objects", "held", "energy_j"}


def test_a_base_without_an_arm_is_told() -> None:
    with pytest.raises(BenchbotError, match="no arm for 'move_gripper'") as caught:
        next(TrackedPlatform(cast(Platform, object())).manipulate("move_gripper", {"width": 0.1}))
    assert "connections" in caught.value.fix
