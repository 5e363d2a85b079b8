"""The policy that drives to a point, from its ONNX file, in rooms that are drawn."""

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from benchbot.api import ActionResult, Observations
from benchbot.plugin import BenchbotError
from benchbot_baselines import navigation
from benchbot_baselines.examples.point_goal_policy import MOVES, PATIENCE_MOVES, SHARPER, PointGoalPolicy
from benchbot_baselines.navigation import BEAMS, COLUMNS, ROWS, Navigator, Rig

ROOM_M = 4.0
ANGLES_RAD = np.linspace(-math.pi, math.pi, 900, endpoint=False)
OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
MATRIX = np.array([[160.0, 0.0, 160.0], [0.0, 160.0, 90.0], [0.0, 0.0, 1.0]])


def room(x: float, y: float, yaw_rad: float, goal: tuple[float, float]) -> Observations:
    """Return what a robot observes in an empty square room, whose middle it started in."""
    headings = ANGLES_RAD + yaw_rad
    with np.errstate(divide="ignore"):
        east = np.where(np.cos(headings) > 0, ROOM_M - x, ROOM_M + x) / np.abs(np.cos(headings))
        north = np.where(np.sin(headings) > 0, ROOM_M - y, ROOM_M + y) / np.abs(np.sin(headings))
    scans = np.stack([np.minimum(east, north), ANGLES_RAD], 1)

    def pose(x: float, y: float, z: float, yaw_rad: float, optical: bool = False) -> dict[str, Any]:
        xyzw = np.array([0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)])
        if optical:
            half = np.array([-0.5, 0.5, -0.5, 0.5])
            (x1, y1, z1, w1), (x2, y2, z2, w2) = xyzw, half
            xyzw = np.array(
                [
                    w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
                    w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
                    w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
                    w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
                ]
            )
        return {"translation_xyz": np.array([x, y, z]), "rotation_xyzw": xyzw}

    observed: dict[str, Any] = {
        "laser": {"scans": scans, "range_min": 0.1, "range_max": 20.0},
        "image_depth": np.full((180, 320), np.inf, np.float32),
        "image_depth_info": {"matrix_intrinsics": MATRIX},
        "goal": np.array(goal),
        "poses": {
            "base_link": pose(x, y, 0.0, yaw_rad),
            "initial_pose": pose(0.0, 0.0, 0.0, 0.0),
            "lidar": pose(x, y, 0.6, yaw_rad),
            "camera": pose(x, y, 1.0, yaw_rad, optical=True),
        },
    }
    return cast(Observations, observed)


def drive(goal: tuple[float, float], seed: int) -> tuple[list[str], float]:
    """Have the shipped policy drive in the room; return its actions, and how far from the goal it has stopped."""
    agent, (x, y, yaw_rad) = PointGoalPolicy(Navigator(), seed), (0.0, 0.0, 0.0)
    actions = []
    while not agent.is_done(ActionResult.SUCCESS):
        action, arguments = agent.pick_action(room(x, y, yaw_rad, goal), [])
        actions.append(action)
        distance_m = arguments.get("distance", 0.0)
        x, y = x + distance_m * math.cos(yaw_rad), y + distance_m * math.sin(yaw_rad)
        yaw_rad += math.radians(arguments.get("angle", 0.0))
    return actions, math.dist((x, y), goal)


@pytest.mark.parametrize("goal", [(2.0, 0.5), (-1.5, 1.5), (0.5, -2.0)])
def test_it_drives_to_its_goal_in_an_empty_room(goal: tuple[float, float]) -> None:
    actions, left_m = drive(goal, seed=0)

    assert left_m <= 0.2
    assert len(actions) < 60


def test_the_same_seed_draws_the_same_moves() -> None:
    assert drive((2.0, 0.5), seed=3)[0] == drive((2.0, 0.5), seed=3)[0]


def test_moves_are_drawn_more_sharply_as_long_as_it_gets_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Navigator, "act", lambda *_: np.array([1.0, 0.0, 0.0], np.float32))
    ahead, navigator, here = np.zeros(PATIENCE_MOVES + 10), Navigator(), room(0.0, 0.0, 0.0, (3.0, 0.0))
    for seed in range(300):
        agent = PointGoalPolicy(navigator, seed)
        # It stays where it is, whatever it draws.
        drawn = [agent.pick_action(here, [])[0] for _ in ahead]
        ahead += [action == "move_distance" for action in drawn]

    likely = np.exp([SHARPER, 1.0]) / (np.exp([SHARPER, 1.0]) + 2)
    assert ahead[:PATIENCE_MOVES].mean() / 300 == pytest.approx(likely[0], abs=0.02)
    assert ahead[PATIENCE_MOVES:].mean() / 300 == pytest.approx(likely[1], abs=0.04)


def test_ends_of_beams_and_pixels_are_in_the_frame_of_the_robot() -> None:
    observed = room(1.0, 0.0, math.pi / 2, (2.0, 0.0))
    frames = {name: navigation.placed(observed["poses"][name]) for name in ("base_link", "lidar", "camera")}
    frames = {"base": frames["base_link"], "laser": frames["lidar"], "camera": frames["camera"]}
    rig = navigation.rig(ANGLES_RAD, MATRIX, (180, 320), frames)

    ahead = int(np.argmax(rig.beams[:, 0]))
    assert rig.beams[ahead] == pytest.approx([1, 0], abs=0.04)
    depth_m = np.zeros((ROWS, COLUMNS), np.float32)
    depth_m[0, 0] = 2.0
    _, _, low, stops = rig.points(np.zeros(BEAMS, np.float32), depth_m)
    # The pixel at the upper left looks 45 degrees to the left; two metres deep it is above the robot.
    assert low[0] == pytest.approx([2.0, 2.0], abs=0.1)
    assert not stops.any()


def test_the_floor_is_no_obstacle_and_what_stands_on_it_is(ground_rig: Rig) -> None:
    depth_m = np.zeros((ROWS, COLUMNS), np.float32)
    down = float(-ground_rig.rays[-1, 32, 2])
    depth_m[-1, 32] = 1.0 / down
    assert not ground_rig.points(np.zeros(BEAMS, np.float32), depth_m)[3].any()
    depth_m[-1, 32] *= 0.8
    _, _, low, stops = ground_rig.points(np.zeros(BEAMS, np.float32), depth_m)
    assert stops.sum() == 1
    assert low[stops][0, 0] == pytest.approx(0.8 / down)


@pytest.fixture
def ground_rig() -> Rig:
    poses = room(0.0, 0.0, 0.0, (1.0, 0.0))["poses"]
    frames = {
        "base": navigation.placed(poses["base_link"]),
        "laser": navigation.placed(poses["lidar"]),
        "camera": navigation.placed(poses["camera"]),
    }
    return navigation.rig(ANGLES_RAD, MATRIX, (180, 320), frames)


def test_another_network_is_refused_with_what_would_fit(tmp_path: Path) -> None:
    (tmp_path / "broken.onnx").write_bytes(b"no network")
    with pytest.raises(BenchbotError, match=r"broken\.onnx cannot be run"):
        Navigator(tmp_path / "broken.onnx")
    with pytest.raises(BenchbotError, match="no policy that drives to a point"):
        Navigator(Path(navigation.__file__).parent / "weights" / "segmenter.onnx")
    with pytest.raises(BenchbotError, match=r"nothing\.onnx cannot be run"):
        Navigator(tmp_path / "nothing.onnx")


def test_a_robot_that_is_stopped_notices_it() -> None:
    navigator = Navigator()
    navigator.act(room(0.0, 0.0, 0.0, (3.0, 0.0)))
    navigator.chose(0)
    before = navigator.act(room(0.25, 0.0, 0.0, (3.0, 0.0)))
    navigator.chose(0)
    after = navigator.act(room(0.25, 0.0, 0.0, (3.0, 0.0)))

    # Ahead is less likely than before it was stopped there.
    assert after[0] - after[1:].max() < before[0] - before[1:].max()
    assert len(before) == len(MOVES)
