"""Arithmetic on whole vectors, beside numpy's."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_sim_taichi import _ti

pytestmark = pytest.mark.xdist_group("renderer")


@pytest.fixture(scope="module", autouse=True)
def runtime(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-100, 100, width=32, allow_subnormal=False), min_size=16, max_size=16))
def test_lanes_are_what_numpy_says(values: list[float]) -> None:
    from plugins.sim_taichi.tests.lane_values import work_out

    array = np.array(values, np.float32)
    negatives, magnitudes = np.empty(8, np.float32), np.empty(4, np.float32)
    greatest, masks = np.empty(1, np.float32), np.empty(2, np.int32)
    work_out(array, negatives, magnitudes, greatest, masks)
    assert np.array_equal(negatives, -array[:8])
    assert np.array_equal(magnitudes, np.abs(array[8:12]))
    assert greatest[0] == array.max()
    is_set = (masks[:, None] >> (30 - np.arange(8))) & 1 == 1
    assert np.array_equal(is_set, [array[:8] > 0, (array[8:] > 0) & (array[8:] < 10)])
