import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from benchbot.core.digest import ObservationDigest


def digest(*observations: dict[str, object]) -> str:
    running = ObservationDigest()
    for observation in observations:
        running.update(observation)
    return running.hexdigest()


@given(hnp.arrays(np.float32, hnp.array_shapes(max_dims=3, max_side=4), elements=st.floats(-1, 1, width=32)))
def test_memory_layout_does_not_matter_but_every_value_does(array: np.ndarray) -> None:
    assert digest({"a": array}) == digest({"a": np.asfortranarray(array)})
    changed = array.copy()
    changed.flat[0] += 1
    assert digest({"a": array}) != digest({"a": changed})


def test_order_of_keys_does_not_matter_but_order_of_steps_does() -> None:
    assert digest({"a": 1, "b": {"c": 2, "d": 3}}) == digest({"b": {"d": 3, "c": 2}, "a": 1})
    assert digest({"a": 1}, {"a": 2}) != digest({"a": 2}, {"a": 1})


def test_shape_and_dtype_are_part_of_it() -> None:
    zeros = np.zeros(4, np.uint8)
    assert len({digest({"a": zeros}), digest({"a": zeros.reshape(2, 2)}), digest({"a": zeros.astype(bool)})}) == 3
