"""Copies between the host and a CUDA device, by the driver itself: `to_numpy` of the runtime takes four times as long.

Driver API: https://docs.nvidia.com/cuda/cuda-driver-api/group__CUDA__MEM.html
"""

import ctypes
import functools
from typing import Any

import numpy.typing as npt

from benchbot.plugin import BenchbotError


def read(address: int, array: npt.NDArray[Any]) -> None:
    """Fill a contiguous host `array` from device memory; kernels started before have finished when this returns."""
    _do("cuMemcpyDtoH_v2", ctypes.c_void_p(array.ctypes.data), ctypes.c_uint64(address), ctypes.c_size_t(array.nbytes))


def write(address: int, array: npt.NDArray[Any]) -> None:
    """Fill device memory from a contiguous host `array`, before kernels that are started after."""
    _do("cuMemcpyHtoD_v2", ctypes.c_uint64(address), ctypes.c_void_p(array.ctypes.data), ctypes.c_size_t(array.nbytes))


def _do(function: str, *arguments: Any) -> None:
    driver, context = _driver()
    code = driver.cuCtxSetCurrent(context) or getattr(driver, function)(*arguments)
    if code:
        raise BenchbotError(
            "The GPU's memory could not be copied",
            f"CUDA's driver answers {function} with error {code}.",
            "See what else uses the GPU (nvidia-smi), or run on the processor: --device cpu",
        )


@functools.cache
def _driver() -> tuple[ctypes.CDLL, ctypes.c_void_p]:
    """The library, and the first device's primary context, in which the runtime allocates."""
    driver = ctypes.CDLL("libcuda.so.1")
    context = ctypes.c_void_p()
    driver.cuDevicePrimaryCtxRetain(ctypes.byref(context), 0)
    return driver, context
