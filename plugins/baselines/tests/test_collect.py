"""Run lengths as pycocotools reads them, and what a folder holds."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from pycocotools import mask as coco_mask

from benchbot.mapping import CLASS_LIST
from benchbot.plugin import BenchbotError
from benchbot_baselines.coco import run_lengths
from benchbot_baselines.collecting import Settings, begin, telling


@given(arrays.arrays(bool, st.tuples(st.integers(1, 9), st.integers(1, 9))))
def test_pycocotools_reads_the_run_lengths(mask: np.ndarray) -> None:
    height, width = mask.shape
    rle = coco_mask.frPyObjects({"size": [height, width], "counts": run_lengths(mask)}, height, width)

    assert (coco_mask.decode(rle) == mask).all()


def test_a_folder_of_other_settings_is_refused(tmp_path: Path) -> None:
    begin(tmp_path, Settings(views=3))
    begin(tmp_path, Settings(views=3))

    with pytest.raises(BenchbotError, match="other settings"):
        begin(tmp_path, Settings(views=4))


def test_views_of_objects_come_first_and_those_before_a_wall_last() -> None:
    classes = np.array([len(CLASS_LIST) - 1, len(CLASS_LIST) - 1, 3], np.uint8)
    shown = [1, 2, 2, 2]
    instance = np.stack([np.full((4, 4), number) for number in shown])
    depth_m = np.stack([np.full((4, 4), far) for far in (3.0, 0.4, 3.0, np.inf)])

    assert telling(instance, depth_m, classes) == [2, 0, 1, 3]
