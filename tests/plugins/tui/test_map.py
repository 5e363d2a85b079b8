"""Maps from above: what is shown of the world, where it lies, and what it looks like."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.drawing.map_model import Box, MapObject, MapPath, SceneMap
from benchbot.plugins.drawing.palette import DARK, LASER, ROBOT
from benchbot.plugins.tui.map_canvas import RunMap, arrow, cleaned, paint, write
from benchbot.plugins.tui.map_panel import Scenery, endpoints, map_of_run
from tests.plugins.tui.watched import ESTIMATES, PLACE, SEEN, TRUTH, run_view, snapshot, surroundings

DRIVEN = MapPath(((1.2, 1.5), (0.7, 1.4)), recorded=True)

metres = st.floats(-1e9, 1e9) | st.sampled_from([math.inf, -math.inf, math.nan])
points = st.lists(st.tuples(metres, metres), max_size=6).map(tuple)
pose = st.none() | st.tuples(metres, metres, st.floats(-10, 10))


@given(points, pose, st.integers(2, 60), st.integers(1, 20), st.sampled_from([1.0, 8.0]))
def test_whatever_a_robot_says_there_is_a_map_of_the_right_size(
    path: tuple[tuple[float, float], ...],
    pose_xyyaw: tuple[float, float, float] | None,
    columns: int,
    lines: int,
    zoom: float,
) -> None:
    boxes = [Box((x, y, 0.0), (abs(y), 1.0, -x)) for x, y in path]
    objects = tuple(MapObject("chair", "chair", box, box) for box in boxes)
    scene = SceneMap(objects=objects, path=MapPath(path), robot_xyyaw=pose_xyyaw, laser=np.array([[1e300, 0.0]]))
    scene = cleaned(scene)
    transform = RunMap(scene, zoom).transform(columns, 2 * lines)
    assert paint(scene, transform, dark=True, finer=1).shape == (2 * lines, columns, 3)
    assert [len(line) for line in write(scene, transform)] == [columns] * lines


def test_everything_lies_where_it_is_on_the_map() -> None:
    scene = replace(PLACE, robot_xyyaw=(0.7, 1.4, math.pi / 2), path=DRIVEN, objects=ESTIMATES[:3])
    transform = RunMap(scene).transform(90, 90)
    pixels = paint(scene, transform, dark=True)

    def at(x: float, y: float) -> tuple[int, ...]:
        column, row = transform.point(x, y)
        return tuple(int(value) for value in pixels[int(row), int(column)])

    assert at(0.7, 1.4) == ROBOT
    assert at(0.95, 1.45)[2] > 130  # the path is blue
    assert at(1.5, 2.5) == DARK.floor
    assert PLACE.occupancy is not None
    walls = np.argwhere(PLACE.occupancy.occupied)
    low, high = PLACE.occupancy.low, PLACE.occupancy.high
    assert np.mean([max(at(low[0] + (c + 0.5) * 0.05, high[1] - (r + 0.5) * 0.05)) for r, c in walls]) > 100
    assert transform.width_m == pytest.approx(transform.height_m)
    with_truth = replace(scene, objects=(*scene.objects, *TRUTH))
    assert paint(with_truth, transform, dark=True).tolist() != pixels.tolist()
    # Zoomed in, the robot is in the middle.
    near = RunMap(scene, zoom=5.0).transform(90, 90)
    assert near.point(0.7, 1.4) == pytest.approx((45.0, 45.0))


def test_a_laser_hits_what_is_around_the_robot() -> None:
    scans = np.array([[1.0, 0.0], [2.0, math.pi / 2], [30.0, 0.1], [math.inf, 0.2], [math.nan, 0.3], [0.0, 0.4]])
    assert endpoints(scans, 30.0, (1.0, 1.0, math.pi / 2)).round(9).tolist() == [[1.0, 2.0], [-1.0, 1.0]]
    ends = endpoints(SEEN["laser"], 30.0, tuple(SEEN["pose"].tolist()))
    transform = RunMap(PLACE).transform(80, 80)
    painted = paint(replace(PLACE, laser=ends), transform, dark=True).astype(int)
    assert (abs(painted - LASER).sum(2) < 120).sum() > 20


def test_in_characters_walls_robot_and_objects_have_their_own() -> None:
    objects = (*ESTIMATES[2:3], *TRUTH[5:6])
    scene = replace(PLACE, robot_xyyaw=(0.7, 1.4, math.pi), path=DRIVEN, objects=objects)
    text = "\n".join(write(scene, RunMap(scene).transform(60, 60)))
    assert {character for character in text if not character.isspace()} == set("#+o<Bc")


@pytest.mark.parametrize(("degrees", "shown"), [(0, "→"), (44, "↗"), (90, "↑"), (-90, "↓"), (181, "←"), (720, "→")])
def test_a_robot_is_an_arrow_where_it_looks(degrees: float, shown: str) -> None:
    assert arrow(math.radians(degrees), "→↗↑↖←↙↓↘") == shown


def test_names_of_objects_lie_on_the_map_where_there_is_room() -> None:
    from textual.geometry import Size

    run_map = RunMap(replace(PLACE, robot_xyyaw=(0.7, 1.4, 0.0), objects=ESTIMATES))
    lines = run_map.strips(Size(60, 24), colored=True, dark=True)
    text = "\n".join(line.text for line in lines)
    assert all(name in text for name in ("bed", "chair", "sink", "→"))
    small = run_map.strips(Size(30, 10), colored=True, dark=True)
    assert "bed" not in "\n".join(line.text for line in small)


def test_the_laser_is_drawn_from_where_it_was_read_unless_the_task_hides_that() -> None:
    read_at = {"translation_xyz": np.array([2.0, 1.0, 0.2]), "rotation_rpy": np.zeros(3)}
    seen = replace(snapshot(), laser={"scans": np.array([[1.0, 0.0]]), "range_max": 30.0}, poses={"laser": read_at})
    ends = {}
    for localisation in ("ground_truth", "noisy"):
        view = run_view(snapshot=seen, progress={"pose_xyyaw": (0.0, 0.0, math.pi)})
        view = replace(view, session={**view.session, "task": {"localisation": localisation}})
        run_map, _ = map_of_run(view, Scenery(surroundings), 0, truth=True)
        assert run_map.scene.laser is not None
        ends[localisation] = run_map.scene.laser.round(6).tolist()
    assert ends == {"ground_truth": [[3.0, 1.0]], "noisy": [[-1.0, 0.0]]}
