"""Evidence: what stands before an object is noticed, by recorded depth and without it, and what does not is not."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from benchbot.core.geometry import Pose
from benchbot.evaluation.breakdown import breakdown
from benchbot.evaluation.evidence import Boxes, Camera, Scene, View, views_of
from benchbot.evaluation.frames import DEPTH, Frame
from benchbot.evaluation.occupancy_map import OccupancyMap

# One metre up, looking forward (optical frame: x right, y down, z forward).
CAMERA = Camera.of(
    {
        "frames": {"eye": {"xyz": [0, 0, 1.0], "rpy_deg": [-90, 0, -90]}},
        "camera": {"frame": "eye", "width": 640, "height": 360, "fx": 320, "fy": 320, "cx": 320, "cy": 180},
    }
)
assert CAMERA is not None
CUP = ((3.0, 0.0, 1.0), (0.3, 0.3, 0.3))
SCREEN = ((1.5, 0.0, 1.0), (0.1, 2.0, 2.0))
WALL = ((5.0, 0.0, 1.0), (0.2, 20.0, 4.0))
PICTURE = ((4.89, 0.0, 1.2), (0.02, 0.6, 0.4))
BEHIND = ((5.6, 0.0, 1.0), (0.4, 0.4, 0.4))
Thing = tuple[tuple[float, float, float], tuple[float, float, float]]


def recorded(folder: Path, *things: Thing, x: float = 0.0) -> Frame:
    """Return a frame of a scene with these boxes, its depth as the recorder keeps it, half as large as the picture."""
    assert CAMERA is not None
    frame = Frame(folder / f"{x}.jpg", 0, Pose.planar(x, 0.0, 0.0), 7)
    columns, rows = np.meshgrid(np.arange(1.0, 640, 2), np.arange(1.0, 360, 2))
    rays = CAMERA.rays(frame.base, np.stack([columns, rows], -1).reshape(-1, 2))
    first, last = Boxes.of(things).spans(np.array([x, 0.0, 1.0]), rays)
    depth_m = np.where((first < last) & (first > 0), first, np.inf).min(axis=0)
    millimetres = np.where(np.isfinite(depth_m), np.rint(depth_m * 1000), 65535).astype(np.uint16)
    Image.fromarray(millimetres.reshape(180, 320)).save(frame.path.with_name(frame.path.stem + DEPTH))
    return frame


def seen(thing: Thing, frame: Frame, *, is_true: bool = True, scene: Scene | None = None) -> View | None:
    assert CAMERA is not None
    (views,) = views_of(Boxes.of([thing]), [frame], CAMERA, scene or Scene(Boxes.of([])), np.array([is_true]))
    return views[0] if views else None


def test_an_object_in_the_open_is_seen_whole(tmp_path: Path) -> None:
    view = seen(CUP, recorded(tmp_path, CUP, WALL))

    assert view is not None
    assert view.visible == 1.0
    assert view.distance_m == pytest.approx(3.0)
    assert view.document()["observation"] == 7
    assert view.pixels == pytest.approx((320 - 48 / 2.85, 180 - 48 / 2.85, 320 + 48 / 2.85, 180 + 48 / 2.85), abs=0.1)


def test_what_stands_behind_something_is_not_seen(tmp_path: Path) -> None:
    assert seen(CUP, recorded(tmp_path, CUP, SCREEN, WALL)) is None
    assert seen(BEHIND, recorded(tmp_path, BEHIND, WALL)) is None
    assert seen(BEHIND, recorded(tmp_path, WALL), is_true=False) is None


def test_a_picture_on_a_wall_is_seen_and_what_is_not_there_is_shown_where_it_would_be(tmp_path: Path) -> None:
    assert seen(PICTURE, recorded(tmp_path, PICTURE, WALL)) is not None
    ghost = recorded(tmp_path, WALL)
    assert seen(CUP, ghost, is_true=False) is not None
    assert seen(CUP, ghost) is None  # true objects have a surface


def test_a_box_half_behind_something_is_half_visible(tmp_path: Path) -> None:
    half = ((1.5, 1.0, 1.0), (0.1, 2.0, 2.0))

    view = seen(CUP, recorded(tmp_path, CUP, half, WALL))

    assert view is not None
    assert view.visible == pytest.approx(0.5, abs=0.1)


def test_who_stands_at_a_bed_sees_it_though_a_part_of_it_is_behind_the_camera(tmp_path: Path) -> None:
    bed = ((1.0, 0.0, 0.25), (3.0, 2.0, 0.5))

    assert seen(bed, recorded(tmp_path, bed, WALL)) is not None


@given(st.floats(0.0, 1.4), st.floats(0.05, 0.4), st.booleans())
def test_without_depth_true_boxes_and_walls_hide_what_is_behind_them(x: float, size: float, is_true: bool) -> None:
    thing: Thing = ((3.0, 0.0, 1.0), (size, size, size))
    frame = Frame(Path("none.jpg"), 0, Pose.planar(x, 0.0, 0.0))
    occupied = np.zeros((80, 80), bool)
    occupied[:, 20:22] = True  # at x = 2.0 to 2.2
    walls = OccupancyMap(occupied, ~occupied, 0.1, (0.0, -4.0, 0.0))

    assert seen(thing, frame, is_true=is_true, scene=Scene(Boxes.of([thing]))) is not None
    assert seen(thing, frame, is_true=is_true, scene=Scene(Boxes.of([thing, SCREEN]))) is None
    assert seen(thing, frame, is_true=is_true, scene=Scene(Boxes.of([thing]), walls)) is None


def test_an_object_is_no_wall_though_the_map_has_its_cells() -> None:
    occupied = np.zeros((80, 80), bool)
    occupied[38:42, 29:32] = True  # where the cup's table stands
    walls = OccupancyMap(occupied, ~occupied, 0.1, (0.0, -4.0, 0.0))
    table = ((3.05, 0.0, 0.4), (0.3, 0.4, 0.8))

    assert seen(CUP, Frame(Path("none.jpg"), 0, Pose()), scene=Scene(Boxes.of([CUP, table]), walls)) is not None


def test_objects_are_grouped_by_what_may_be_the_reason() -> None:
    near = {"times_seen": 3, "nearest_m": 0.8, "visible": 1.0, "brightness": 0.1, "views": []}
    things = [
        ("match", 0.6, near),
        ("false_negative", 0.4, near),
        ("false_negative", 0.0, {"times_seen": 0, "views": []}),
    ]
    objects = [
        {"verdict": verdict, "truth_extent": [0.3, 0.1, 0.1], "factors": {"overall": value}, "evidence": evidence}
        for verdict, value, evidence in things
    ]

    told = {item["by"]: item["groups"] for item in breakdown(objects)}

    assert told["size"] == [{"label": "0.2 to 0.5 m", "objects": 3, "found": 1, "quality": pytest.approx(0.2)}]
    assert [(row["label"], row["objects"], row["quality"]) for row in told["nearest_view"]] == [
        ("below 1 m", 2, pytest.approx(0.3)),
        ("never seen", 1, 0.0),
    ]
    assert [row["label"] for row in told["light"]] == ["dark: below 0.15"]
    assert breakdown([{**objects[0], "evidence": None} | {}])[0]["by"] == "size"
