"""The one place that imports Taichi, and the one place that starts it (its runtime is global to the process)."""

import contextlib
import importlib
import io
import os
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot.process import processors
from benchbot_sim_taichi import _cuda, _float_mode, _front_end, kernel_cache

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")

RUNTIME = "quadrants" if (sys.platform, platform.machine()) == ("linux", "aarch64") else "taichi"
"""What is installed with this distribution: Taichi has no wheels for Linux on Arm, and its fork has."""
with _front_end.importing():
    ti: Any = importlib.import_module(os.environ.get("BENCHBOT_TAICHI", RUNTIME))
_front_end.hasten(ti)

DEVICES = ("cpu", "cuda")
# Taichi's own passes take five sixths of the time of compiling, and LLVM does that work again: on a processor, pictures
# take no longer without them.
OPT_LEVELS = {"cpu": 0, "cuda": 1}
PIECES = 512
"""A loop is cut into this many, so that a thread whose part of the picture is easy does not wait for the others. It is
part of kernels, and so the same for any number of threads: all workers of a batch then find them in the cache."""
THREADS = "TI_CPU_MAX_NUM_THREADS"
_SHORT_NAMES = {"float32": "f32", "float64": "f64", "int32": "i32", "uint8": "u8", "uint32": "u32"}
_NAMES = {getattr(ti, short): name for name, short in _SHORT_NAMES.items()}
_started: str | None = None


def start(device: str, cache_dir: Path) -> None:
    """Start the runtime once per process; a second start with another `device` raises `BenchbotError`."""
    global _started
    if device not in DEVICES:
        raise BenchbotError(
            f"There is no compute device called {device!r}",
            "The ray tracer runs on one of: " + ", ".join(DEVICES) + ".",
            "Choose one of those.",
        )
    if _started == device:
        return
    if _started is not None:
        raise BenchbotError(
            f"The ray tracer cannot run on {device!r} here",
            f"This process already runs it on {_started!r}, and the runtime is one per process.",
            f"Use {_started!r}, or start another process.",
        )
    kernels = kernel_cache.prepare(cache_dir)
    # By default Taichi starts a thread for each processor of the machine, whatever this process may use of them.
    threads = {} if THREADS in os.environ else {"cpu_max_num_threads": processors()}
    # Vectors stay whole on a processor: see `kernels.lanes`.
    # It prints a banner whatever the log level, and has this thread take tiny numbers for zero from then on.
    with contextlib.redirect_stdout(io.StringIO()), _float_mode.kept():
        ti.init(
            arch=getattr(ti, device),
            offline_cache=True,
            offline_cache_file_path=str(kernels),
            log_level=ti.ERROR,
            opt_level=OPT_LEVELS[device],
            real_matrix_scalarize=device != "cpu",
            enable_fallback=False,
            **threads,
        )
    _front_end.shorten_launches(ti)
    # The threads themselves are started by then; from here on, it is the number of pieces.
    ti.lang.impl.current_cfg().cpu_max_num_threads = PIECES
    _started = device


def save_kernels() -> None:
    """Write what was compiled to disk now, so that a process that is killed has not compiled in vain.

    On a processor and Linux; elsewhere a process cannot be copied for it, and writes when it ends.
    """
    if _started == "cpu" and sys.platform == "linux":
        kernel_cache.save(ti.lang.impl.get_runtime().prog)


_front_end.compile_before_launch(ti, save_kernels)


@contextlib.contextmanager
def exact_arithmetic() -> Iterator[None]:
    """Compile kernels that are launched here for the first time as written: no sum or product is fused or reordered."""
    config = ti.lang.impl.current_cfg()
    config.fast_math = False
    try:
        yield
    finally:
        config.fast_math = True


def device_kind() -> str:
    """Return the kind of device that kernels run on; empty before the runtime is started."""
    return _started or ""


def is_on_processor() -> bool:
    """Return whether kernels run on the processor; false before the runtime is started."""
    return _started == "cpu"


def is_on_gpu() -> bool:
    """Return whether kernels run on a GPU."""
    return _started == "cuda"


def upload(array: npt.NDArray[Any]) -> Any:
    """Return an array that kernels can read repeatedly: the array itself on a CPU, elsewhere a copy on the device."""
    contiguous = np.ascontiguousarray(array)
    if _started == "cpu":
        return contiguous
    device = ti.ndarray(dtype=getattr(ti, _SHORT_NAMES[contiguous.dtype.name]), shape=contiguous.shape)
    write(device, contiguous)
    return device


def write(target: Any, array: npt.NDArray[Any]) -> None:
    """Put contiguous values at the start of an array that `upload` returned, as of the next kernel."""
    if isinstance(target, np.ndarray):
        target[: len(array)] = array
    else:
        _cuda.write(_address(target), array)


class Scratch:
    """Memory by names in which kernels find what changes between their launches; it grows and is used again."""

    def __init__(self) -> None:
        self._kept: dict[str, Any] = {}

    def put(self, name: str, array: npt.NDArray[Any]) -> Any:
        """Return an array that begins with these values: on a CPU a view of them, or a copy if they have gaps."""
        values = np.ascontiguousarray(array).reshape(-1)
        if _started == "cpu":
            return values
        if name not in self._kept or self._kept[name].shape[0] < max(len(values), 1):
            self._kept[name] = upload(values if len(values) else np.zeros(1, values.dtype))
        else:
            write(self._kept[name], values)
        return self._kept[name]


def read(array: Any, into: npt.NDArray[Any]) -> None:
    """Fill a contiguous host array from the start of one that kernels have written."""
    if isinstance(array, np.ndarray):
        if not np.shares_memory(array, into):
            into.reshape(-1)[:] = array[: into.size]
    else:
        _cuda.read(address(array), into)


def empty_words(size: int) -> Any:
    """32-bit integers without a value yet, in the memory that kernels work in."""
    return np.empty(size, np.int32) if _started == "cpu" else ti.ndarray(dtype=ti.i32, shape=size)


def address(array: Any) -> int:
    """Return the address of a device array's first value; kernels that were started before have finished by then."""
    ti.sync()
    return _address(array)


def _address(array: Any) -> int:
    return int(ti.lang.impl.get_runtime().prog.get_ndarray_data_ptr_as_int(array.arr))


def download(array: Any) -> npt.NDArray[Any]:
    """Return the host's view of an array from `upload`: the array itself on a CPU, elsewhere a copy."""
    if isinstance(array, np.ndarray):
        return array
    host = np.empty(array.shape, _NAMES[array.dtype])
    _cuda.read(address(array), host)
    return host
