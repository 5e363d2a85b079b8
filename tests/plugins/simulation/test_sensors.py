"""Sensors number, cut off and place what they see as documented."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.plugins.simulation.declared import mount
from benchbot.plugins.simulation.sensors import Camera, Frame, Labels, Sightings
from benchbot_scenes.scene import Instance

CAMERA = Camera("camera_left", 2, 2, 1.0, 1.0, 0.5, 0.5, (0.1, 5.0))


def frame(instance: list[list[int]], depth_m: float = 1.0) -> Frame:
    ids = np.array(instance, np.int32)
    return Frame(np.zeros((*ids.shape, 3), np.uint8), np.full(ids.shape, depth_m, np.float32), ids)


OBJECTS = [
    Instance(1, "a", "chair"),
    Instance(2, "wall", None),
    Instance(3, "b", "cup"),
    Instance(4, "c", "chair"),
    Instance(5, "d", "piano"),
    Instance(6, "e", "chair"),
]


def segmented(sightings: Sightings, instance: list[list[int]]) -> list[list[int]]:
    numbers: list[list[int]] = sightings.segment(frame(instance))["instance_segment_img"].tolist()
    return numbers


def test_objects_are_numbered_within_their_class() -> None:
    seen = Sightings(Labels.of(OBJECTS, ["bottle", "cup", "chair"])).segment(frame([[0, 1, 2], [3, 4, 5]]))
    assert seen["instance_segment_img"].tolist() == [[0, 3001, 0], [2001, 3002, 0]]
    assert seen["class_segment_img"].tolist() == [[0, 3, 0], [2, 3, 0]]
    assert seen["instance_segment_img"].dtype == np.uint16
    assert seen["class_segment_img"].dtype == np.uint8


def test_numbers_do_not_tell_of_objects_that_have_not_been_seen() -> None:
    sightings = Sightings(Labels.of(OBJECTS, ["cup", "chair"]))
    assert segmented(sightings, [[6, 6]]) == [[2001, 2001]], "it is the third chair of the scene"
    assert segmented(sightings, [[4, 6], [1, 4]]) == [[2002, 2001], [2003, 2002]], "an object keeps its number"


def test_nor_do_the_numbers_of_classes() -> None:
    """Which classes there are in a place is to be found out; the labels are told anyway."""
    one = Sightings(Labels.of(OBJECTS, ["bottle", "cup", "chair"])).segment(frame([[0]]))
    none = Sightings(Labels.of([], ["bottle", "cup", "chair"])).segment(frame([[0]]))
    assert one["class_ids"] == none["class_ids"] == {"bottle": 1, "cup": 2, "chair": 3}


@given(
    st.lists(st.lists(st.integers(0, 6), min_size=4, max_size=4), min_size=1),
    st.permutations([1, 3, 4, 6]),
)
def test_the_order_of_objects_in_a_scene_cannot_be_told_from_their_numbers(
    pictures: list[list[int]], shuffled: list[int]
) -> None:
    """The same things seen, in scenes that list their objects in different orders, look the same."""
    swapped = {0: 0, 2: 2, 5: 5, **dict(zip([1, 3, 4, 6], shuffled, strict=True))}
    listed = [replace(one, index=swapped[one.index]) for one in OBJECTS]
    here, there = (Sightings(Labels.of(objects, ["cup", "chair"])) for objects in (OBJECTS, listed))
    for picture in pictures:
        assert segmented(here, [picture]) == segmented(there, [[swapped[index] for index in picture]])


def test_a_scene_without_labels_is_all_zero() -> None:
    seen = Sightings(Labels.of([], [])).segment(frame([[0, 0]]))
    assert seen["instance_segment_img"].tolist() == [[0, 0]]
    assert seen["class_ids"] == {}


@pytest.mark.parametrize(
    ("objects", "labels"),
    [
        ([Instance(index, f"cup {index}", "cup") for index in range(1, 1001)], ["cup"]),
        ([Instance(1, "last", "class 69")], [f"class {index}" for index in range(70)]),
    ],
    ids=["objects", "classes"],
)
def test_more_than_sixteen_bits_of_objects_are_refused(objects: list[Instance], labels: list[str]) -> None:
    with pytest.raises(BenchbotError, match="too many"):
        Labels.of(objects, labels)


@pytest.mark.parametrize(
    ("seen_m", "reported_m"), [(1.0, 1.0), (5.0, 5.0), (5.1, math.inf), (math.inf, math.inf), (0.05, -math.inf)]
)
def test_depth_beyond_the_camera_is_infinite(seen_m: float, reported_m: float) -> None:
    depth_m = CAMERA.depth(frame([[0, 0]], seen_m), np.random.default_rng)
    assert depth_m.dtype == np.float32
    assert depth_m == pytest.approx(np.full((1, 2), reported_m))


def test_the_camera_model_is_reported_as_matrices() -> None:
    info = CAMERA.info()
    assert info["matrix_intrinsics"].tolist() == [[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]]
    assert info["matrix_projection"].shape == (3, 4)
    assert (info["frame_id"], info["height"], info["width"]) == ("camera_left", 2, 2)


def test_an_optical_frame_looks_along_the_robot() -> None:
    optical = mount({"xyz": [0.1, 0.2, 1.0], "rpy_deg": [-90, 0, -90]}).matrix()
    right, down, forward, place = optical[:3].T
    assert forward == pytest.approx([1, 0, 0])
    assert right == pytest.approx([0, -1, 0])
    assert down == pytest.approx([0, 0, -1])
    assert place == pytest.approx([0.1, 0.2, 1.0])


def test_roll_pitch_and_yaw_are_about_static_axes() -> None:
    pose = mount({"xyz": [0, 0, 0], "rpy_deg": [10, 20, 30]})
    assert np.degrees(pose.rpy_rad) == pytest.approx([10, 20, 30])
