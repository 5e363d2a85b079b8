"""Run lengths as pycocotools reads them, and what a folder holds."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from pycocotools import mask as coco_mask

from benchbot.plugin import BenchbotError
from benchbot_baselines.coco import run_lengths
from benchbot_baselines.collecting import Settings, begin


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
