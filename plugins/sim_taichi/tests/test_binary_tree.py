"""Both ways to split nodes: everything stays, boxes hold what is in them, and neither tree is the better one."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_sim_taichi import _ti, binary_tree
from benchbot_sim_taichi.binary_tree import BinaryTree, FloatArray

pytestmark = pytest.mark.xdist_group("renderer")

LEAF_SIZE = 4
both_ways = pytest.mark.parametrize("compiled", [False, True])


@pytest.fixture(autouse=True, scope="module")
def kernels(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)


def boxes(count: int, seed: int, spread: float = 1.0) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    low = (rng.normal(size=(count, 3)) * spread).astype(np.float32)
    return low, low + rng.exponential(0.05, (count, 3)).astype(np.float32)


def cost(tree: BinaryTree) -> float:
    """What a ray costs that meets the root: its chance to meet each leaf, times the blocks of triangles there."""
    leaves = tree.left < 0
    return float((tree.area()[leaves] * np.ceil(tree.count[leaves] / LEAF_SIZE)).sum() / tree.area()[0])


@both_ways
@settings(max_examples=25, deadline=None)
@given(count=st.integers(1, 400), seed=st.integers(0, 2**31), spread=st.sampled_from([0.0, 1e-6, 1.0, 1e5]))
def test_children_share_out_what_their_parent_has(compiled: bool, count: int, seed: int, spread: float) -> None:
    low, high = boxes(count, seed, spread)
    tree = binary_tree.grow(low, high, LEAF_SIZE, compiled=compiled)
    assert sorted(tree.order.tolist()) == list(range(count))
    for node, left in enumerate(tree.left):
        items = tree.order[tree.start[node] : tree.start[node] + tree.count[node]]
        np.testing.assert_array_equal(tree.low[node], low[items].min(0))
        np.testing.assert_array_equal(tree.high[node], high[items].max(0))
        if left < 0:
            assert 1 <= tree.count[node] <= LEAF_SIZE
        else:
            assert tree.start[left] == tree.start[node]
            assert tree.start[left + 1] == tree.start[left] + tree.count[left]
            assert tree.count[left] + tree.count[left + 1] == tree.count[node]


@both_ways
def test_boxes_that_are_all_the_same_are_halved(compiled: bool) -> None:
    low = np.zeros((1000, 3), np.float32)
    tree = binary_tree.grow(low, low + 1, LEAF_SIZE, compiled=compiled)
    assert tree.count[tree.left < 0].max() <= LEAF_SIZE
    assert len(tree.left) < 1000


def test_the_trees_are_as_good_and_always_the_same() -> None:
    low, high = boxes(20_000, 5)
    numpy_tree, first, second = (
        binary_tree.grow(low, high, LEAF_SIZE, compiled=compiled) for compiled in (False, True, True)
    )
    assert cost(first) < 1.01 * cost(numpy_tree)
    for name in ("low", "high", "left", "start", "count", "order"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
