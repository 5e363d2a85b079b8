# mypy: ignore-errors
"""What is left out of Taichi's front end is missed by nobody: errors say where they are, and classes are known."""

import inspect
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchbot_sim_taichi import _ti

ti = _ti.ti
OWN_KERNELS = """
import gc
{importing}
from taichi.lang.kernel_impl import Kernel
kernels = [each for each in gc.get_objects() if isinstance(each, Kernel)]
for name, of_class in sorted((each.func.__qualname__, bool(each.classkernel)) for each in kernels):
    print(name, of_class)
"""
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


@ti.kernel
def scale(values: floats, factor: ti.f32, first: ti.i32, seed: ti.u32, is_squared: ti.template()):
    for i in range(first, values.shape[0]):
        if ti.static(is_squared):
            values[i] *= values[i]
        values[i] = values[i] * factor + ti.cast(seed, ti.f32)


@ti.kernel
def sum_of(values: floats) -> ti.f32:
    total = 0.0
    for i in range(values.shape[0]):
        total += values[i]
    return total


def test_taichi_imported_faster_knows_the_same_of_its_own_kernels() -> None:
    told = [
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
        for script in (
            OWN_KERNELS.format(importing="import benchbot_sim_taichi._ti"),
            OWN_KERNELS.format(importing="import taichi"),
        )
    ]
    # The first line is Taichi's own, where nobody has asked it to be silent.
    assert told[0].splitlines() == [line for line in told[1].splitlines() if not line.startswith("[Taichi]")]
    assert len(told[0].splitlines()) > 50
    assert inspect.getframeinfo.__module__ == "inspect"
    assert inspect.getframeinfo(sys._getframe()).code_context is not None


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


@pytest.mark.xdist_group("renderer")
def test_a_kernel_that_has_run_takes_what_it_is_given_now(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)
    for size, factor, first, seed, is_squared in [
        (3, 2.0, 0, 0, False),
        (4, 0.5, 1, 7, False),
        (2, -1, -0, 2**31, True),
    ] * 2:
        values = np.arange(1, size + 1, dtype=np.float32)
        expected = values.copy()
        expected[first:] = expected[first:] ** (2 if is_squared else 1) * factor + seed

        scale(values, factor, np.int64(first), seed, is_squared)

        np.testing.assert_array_equal(values, expected)
        assert sum_of(values) == pytest.approx(expected.sum())


@pytest.mark.xdist_group("renderer")
def test_a_kernel_that_has_run_writes_to_arrays_of_the_device(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)
    for start in (1.0, 5.0, 9.0):
        of_device = ti.ndarray(ti.f32, 3)
        of_device.from_numpy(np.arange(start, start + 3, dtype=np.float32))
        on_host = np.arange(start, start + 3, dtype=np.float32)

        scale(of_device, 2.0, 0, 1, False)
        scale(on_host, 2.0, 0, 1, False)

        np.testing.assert_array_equal(of_device.to_numpy(), on_host)
        np.testing.assert_array_equal(on_host, 2 * np.arange(start, start + 3) + 1)


@pytest.mark.xdist_group("renderer")
@pytest.mark.parametrize(
    "values",
    [np.zeros(4, np.float64), np.zeros((2, 2), np.float32), np.zeros(8, np.float32)[::2]],
    ids=["64 bits", "two axes", "gaps"],
)
def test_a_kernel_that_has_run_refuses_arrays_that_it_cannot_take(kernel_cache: Path, values: np.ndarray) -> None:
    _ti.start("cpu", kernel_cache)
    scale(np.zeros(4, np.float32), 1.0, 0, 0, False)

    with pytest.raises(ValueError, match=r"required array has|Non contiguous"):
        scale(values, 1.0, 0, 0, False)


@pytest.mark.xdist_group("renderer")
def test_a_kernel_that_has_run_refuses_half_a_number_of_pieces(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)
    scale(np.zeros(4, np.float32), 1.0, 0, 0, False)

    with pytest.raises(ti.TaichiRuntimeTypeError):
        scale(np.zeros(4, np.float32), 1.0, 0.5, 0, False)
