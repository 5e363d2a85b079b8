import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchbot.api import BenchbotError
from benchbot.mapping import VoxelMap, clusters

CLASSES = ("chair", "table", "background")
Clouds = arrays.arrays(np.float32, st.tuples(st.integers(0, 30), st.just(3)), elements=st.floats(-4, 4, width=32))


def filled(points: np.ndarray, *, by: int = 1) -> VoxelMap:
    """Return a map of points whose colours and classes depend on where they are, added in so many parts."""
    made = VoxelMap(CLASSES, resolution_m=0.25)
    for part in np.array_split(points, by):
        colors = np.clip(np.abs(part) * 60, 0, 255).astype(np.uint8)
        made.add(part, colors, np.eye(3)[(part[:, 0] > 0).astype(int)])
    return made


@given(Clouds, st.randoms(use_true_random=False), st.integers(1, 4))
def test_the_order_and_the_frames_are_of_no_account(cloud: np.ndarray, chance: st.DataObject, parts: int) -> None:
    shuffled = cloud.tolist()
    chance.shuffle(shuffled)  # type: ignore[attr-defined]
    one, other = filled(cloud).voxels, filled(np.array(shuffled, np.float32).reshape(-1, 3), by=parts).voxels

    np.testing.assert_array_equal(one.centers, other.centers)
    np.testing.assert_array_equal(one.counts, other.counts)
    np.testing.assert_array_equal(one.colors, other.colors)
    np.testing.assert_allclose(one.label_probs, other.label_probs)


@given(Clouds)
def test_every_point_is_in_a_voxel_and_seeing_it_again_adds_none(cloud: np.ndarray) -> None:
    made = filled(cloud)
    voxels = made.voxels
    made.add(cloud)

    assert voxels.counts.sum() == len(cloud)
    for point in cloud:
        assert np.abs(voxels.centers - point).max(axis=1).min() <= 0.125 + 1e-5
    np.testing.assert_array_equal(made.voxels.centers, voxels.centers)


def test_points_that_are_none_are_left_out() -> None:
    made = VoxelMap()
    made.add([[np.nan, 0, 0], [np.inf, 0, 0], [1e9, 0, 0], [0.01, 0.01, 0.01]])

    np.testing.assert_allclose(made.voxels.centers, [[0.025, 0.025, 0.025]])
    assert made.objects() == []


def test_objects_are_neighbours_of_one_class() -> None:
    block = np.stack(np.meshgrid(*3 * [np.arange(0.02, 0.5, 0.04)]), -1).reshape(-1, 3)
    made = VoxelMap(CLASSES)
    for offset, label in (((0, 0, 0), 0), ((1, 0, 0), 0), ((0, 0.5, 0), 1), ((3, 3, 0), 2)):
        made.add(block + offset, label_probs=np.tile(np.eye(3)[label], (len(block), 1)))
    made.add([[9.0, 9, 9]], label_probs=[[1.0, 0, 0]])
    made.add(block + np.array([5, 5, 0]))  # of no known class
    chairs, table = made.objects()[:2], made.objects()[2]

    assert len(made.objects()) == 3, "neither the background, nor the unknown, nor a lone point"
    assert [item.label for item in (*chairs, table)] == ["chair", "chair", "table"]
    np.testing.assert_allclose(chairs[1].lower, block.min(axis=0) + np.array([1, 0, 0]))
    np.testing.assert_allclose(table.upper, block.max(axis=0) + np.array([0, 0.5, 0]))
    assert table.label_probs == {"table": 1.0}


def test_labels_of_other_points_are_refused() -> None:
    with pytest.raises(BenchbotError, match="The label_probs do not belong to the points") as caught:
        VoxelMap(CLASSES).add(np.zeros((5, 3)), label_probs=np.zeros((4, 3)))

    assert "(4, 3), for 5 points it must be (5, 3)" in caught.value.why


@given(st.lists(st.integers(0, 40), max_size=15))
def test_clusters_end_where_a_gap_is_wider(places: list[int]) -> None:
    points = np.array([[place, 0, 0] for place in places], np.float32).reshape(-1, 3)
    numbers = clusters(points, 1.5)
    ordered = sorted(set(places))
    expected = dict(zip(ordered, np.cumsum(np.diff(ordered, prepend=ordered[:1]) > 1.5).tolist(), strict=True))

    for i, one in enumerate(places):
        for j, other in enumerate(places):
            assert (numbers[i] == numbers[j]) == (expected[one] == expected[other])
    firsts = [int(numbers[i]) for i in range(len(places)) if numbers[i] not in numbers[:i]]
    assert firsts == list(range(len(firsts)))
