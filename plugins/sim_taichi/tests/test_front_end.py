# mypy: ignore-errors
"""What is left out of Taichi's front end is missed by nobody: errors say where they are, and classes are known."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_sim_taichi import _ti

ti = _ti.ti
FAULTY_LINE = "        x + nowhere  # noqa: F821"
floats = ti.types.ndarray(dtype=ti.f32, ndim=1)


@ti.func
def broken(x):
    return (
        x + nowhere  # noqa: F821
    )


@ti.kernel
def calls_what_is_broken(values: floats):
    values[0] = broken(values[1])


@ti.data_oriented
class Counter:
    def __init__(self, step):
        self.step = step

    @ti.func
    def next(self, value):
        return value + self.step

    @ti.kernel
    def count(self, values: floats):
        for i in range(3):
            values[i] = self.next(values[i])


@pytest.mark.xdist_group("renderer")
def test_an_error_in_a_kernel_says_where_it_is(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)
    with pytest.raises(ti.TaichiNameError) as raised:
        calls_what_is_broken(np.zeros(2, np.float32))
    message = str(raised.value)
    number = 1 + Path(__file__).read_text().splitlines().index(FAULTY_LINE)
    assert f'File "{__file__}", line {number}, in broken:\n{FAULTY_LINE}\n' in message
    assert "in calls_what_is_broken" in message


@pytest.mark.xdist_group("renderer")
def test_kernels_of_classes_know_their_object(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)
    values = np.zeros(3, np.float32)
    Counter(2).count(values)
    Counter(5).count(values)
    assert values.tolist() == [7.0, 7.0, 7.0]
