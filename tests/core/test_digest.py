from concurrent.futures import ThreadPoolExecutor

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from benchbot.core.digest import BackgroundDigest, ObservationDigest


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


@given(st.lists(st.tuples(st.integers(0, 9), st.booleans()), max_size=5))
def test_the_background_makes_no_difference(steps: list[tuple[int, bool]]) -> None:
    shown: list[dict[str, object]] = [{"image": np.full((40, 40), value), "name": {"of": value}} for value, _ in steps]
    with ThreadPoolExecutor(1) as executor:
        running = BackgroundDigest(executor)
        for observations, (_, at_once) in zip(shown, steps, strict=True):
            running.update(observations)
            if at_once:
                running.begin()
        assert running.hexdigest() == digest(*shown)


def test_what_was_shown_may_be_overwritten_once_one_has_waited() -> None:
    memory = np.zeros(100_000)
    with ThreadPoolExecutor(1) as executor:
        running = BackgroundDigest(executor)
        for value in range(3):
            running.wait()
            memory[:] = value
            running.update({"memory": memory})
            running.begin()
        shown: list[dict[str, object]] = [{"memory": np.full(100_000, float(value))} for value in range(3)]
        assert running.hexdigest() == digest(*shown)
