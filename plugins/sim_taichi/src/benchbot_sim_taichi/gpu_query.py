"""A program of its own, since a broken driver may crash it: says which GPU CUDA uses first, and whether it is free.

It prints JSON: `{"problem": …}`, or `{"name", "free_bytes", "is_taken"}`; `free_bytes` is null where nobody can tell.
Run it as `python -I -S gpu_query.py`, which takes no longer than the driver does.

https://docs.nvidia.com/cuda/cuda-driver-api and https://docs.nvidia.com/deploy/nvml-api
"""

import ctypes
import json
from typing import Any

EXCLUSIVE, PROHIBITED = 3, 2
"""Compute modes in which one process, or none, may use the GPU."""


def first_gpu() -> dict[str, Any]:
    """Return what is known of the first GPU that CUDA offers to this process (CUDA_VISIBLE_DEVICES)."""
    cuda = ctypes.CDLL("libcuda.so.1")
    code, count = cuda.cuInit(0), ctypes.c_int()
    code = code or cuda.cuDeviceGetCount(ctypes.byref(count))
    if code:
        said = ctypes.c_char_p()
        cuda.cuGetErrorName(code, ctypes.byref(said))
        return {"problem": (said.value or b"").decode() or f"error {code}"}
    if not count.value:
        return {"problem": "it offers no GPU"}
    name, identity = ctypes.create_string_buffer(200), ctypes.create_string_buffer(16)
    cuda.cuDeviceGetName(name, len(name), 0)
    cuda.cuDeviceGetUuid(identity, 0)
    return {"name": name.value.decode(), **_use(identity.raw.hex())}


def _use(identity: str) -> dict[str, Any]:
    """Return how much memory of a GPU is free, and whether it is another process's alone, as its driver says."""
    try:
        nvml = ctypes.CDLL("libnvidia-ml.so.1")
    except OSError:
        return {"free_bytes": None, "is_taken": False}
    handle, mode, running = ctypes.c_void_p(), ctypes.c_int(), ctypes.c_uint()
    total_free_used = (ctypes.c_ulonglong * 3)()
    parts = [identity[start:end] for start, end in ((0, 8), (8, 12), (12, 16), (16, 20), (20, 32))]
    found = not nvml.nvmlInit_v2()
    found = found and not nvml.nvmlDeviceGetHandleByUUID(f"GPU-{'-'.join(parts)}".encode(), ctypes.byref(handle))
    found = found and not nvml.nvmlDeviceGetMemoryInfo(handle, total_free_used)
    if not found:
        return {"free_bytes": None, "is_taken": False}
    nvml.nvmlDeviceGetComputeMode(handle, ctypes.byref(mode))
    nvml.nvmlDeviceGetComputeRunningProcesses(handle, ctypes.byref(running), None)  # it says how many there are
    is_taken = mode.value == PROHIBITED or (mode.value == EXCLUSIVE and running.value > 0)
    return {"free_bytes": total_free_used[1], "is_taken": is_taken}


if __name__ == "__main__":
    print(json.dumps(first_gpu()))
