"""What a ROS 2 message would round is in the recording as it was."""

from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchbot_record_mcap import exact
from benchbot_record_mcap.recording import McapRecording
from plugins.record_mcap.tests.bags import by_rosbags, sample_session, through_cdr

ARRAYS = arrays.arrays(
    st.sampled_from([np.float64, np.float32, np.uint16]), arrays.array_shapes(min_dims=0, max_dims=3, min_side=0)
)
VALUES = st.recursive(
    st.one_of(ARRAYS, st.floats(), st.integers(-(2**53), 2**53), st.text(st.characters(codec="utf-8")), st.booleans()),
    lambda inner: st.dictionaries(st.text(st.sampled_from("abc_"), min_size=1, max_size=3), inner, max_size=3),
    max_leaves=6,
)


def same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return bool(one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes())
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    return repr(one) == repr(other)


@given(value=VALUES)
def test_values_come_back_to_the_bit(value: Any) -> None:
    order, values = exact.decode(through_cdr(exact.encode({"image_rgb": None, "laser": value})))
    assert order == ["image_rgb", "laser"]
    assert same(values, {"laser": value})


def test_a_laser_that_its_message_rounds_is_exact(tmp_path: Path) -> None:
    session = sample_session(McapRecording(tmp_path / "run"))
    seen = session.reset().observations["laser"]
    session.close()
    bag = by_rosbags(tmp_path / "run")
    ((_, scan),) = bag["/scan"]
    assert not np.array_equal(scan.ranges, seen["scans"][:, 0])
    ((_, message),) = bag["/benchbot/exact"]
    assert same(exact.decode(message)[1]["laser"], dict(seen))
