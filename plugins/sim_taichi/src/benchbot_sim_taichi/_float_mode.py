"""The floating-point mode of a thread (denormal numbers), which libraries change for code that runs in it later."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager

ENVIRONMENT_BYTES = 64
"""Room for a `fenv_t` (C11, 7.6): 32 bytes on x86-64, where it holds the register MXCSR too, 16 on ARM."""


@contextmanager
def kept() -> Iterator[None]:
    """Leave this thread's floating-point environment as it was: numbers below the smallest normal one are none else."""
    library = ctypes.CDLL(None)
    environment = (ctypes.c_uint64 * (ENVIRONMENT_BYTES // 8))()
    library.fegetenv(environment)
    try:
        yield
    finally:
        library.fesetenv(environment)
