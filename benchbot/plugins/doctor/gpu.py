"""GPUs: is there one, and does the ray tracer get at it?

CUDA's own library is asked, in a child process: a driver that is broken may crash whoever loads it.
https://docs.nvidia.com/cuda/cuda-driver-api/group__CUDA__INITIALIZE.html
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path

from benchbot.core.findings import Finding, Level
from benchbot.plugins.doctor import children

DRIVER = Path("/proc/driver/nvidia/version")
CUDA = """
import ctypes, json
try:
    cuda = ctypes.CDLL("libcuda.so.1")
except OSError:
    print(json.dumps({"library": False}))
    raise SystemExit
code = cuda.cuInit(0)
if code:
    name = ctypes.c_char_p()
    cuda.cuGetErrorName(code, ctypes.byref(name))
    print(json.dumps({"library": True, "error": (name.value or b"").decode() or str(code)}))
    raise SystemExit
version, count = ctypes.c_int(), ctypes.c_int()
cuda.cuDriverGetVersion(ctypes.byref(version))
cuda.cuDeviceGetCount(ctypes.byref(count))
devices = []
for index in range(count.value):
    name, size = ctypes.create_string_buffer(200), ctypes.c_size_t()
    cuda.cuDeviceGetName(name, 200, index)
    cuda.cuDeviceTotalMem_v2(ctypes.byref(size), index)
    devices.append([name.value.decode(), size.value])
print(json.dumps({"library": True, "cuda": version.value, "devices": devices}))
"""
NO_DEVICE = ("CUDA_ERROR_NO_DEVICE", "100")
NONE = "none, and none is needed: the ray tracer runs on the processor"
USE = "for the ray tracer with --set options.arch=cuda"


def gpu(driver: Path = DRIVER, program: str = CUDA) -> Iterator[Finding]:
    """Say which GPUs CUDA offers, or why it offers none."""
    answer = children.ask_python(program, bare=True)
    installed = driver.is_file()
    if answer.problem:
        fix = "Install NVIDIA's driver again, and restart the machine; nvidia-smi then has to answer."
        yield Finding(Level.WARNING, "GPU", f"CUDA does not start: {answer.problem}", fix)
        return
    found = json.loads(answer.said)
    if not found["library"]:
        if not installed:
            yield Finding(Level.OK, "GPU", NONE)
            return
        fix = "Install that driver's library (libcuda1 or libnvidia-compute); start a container with --gpus all."
        yield Finding(
            Level.WARNING, "GPU", "NVIDIA's driver is loaded, and CUDA's library (libcuda.so.1) is missing", fix
        )
    elif "error" in found:
        yield _none_usable(found["error"], installed=installed)
    elif not found["devices"]:
        yield Finding(Level.OK, "GPU", NONE)
    else:
        names = ", ".join(f"{name} ({size / 2**30:.0f} GiB)" for name, size in found["devices"])
        major, minor = divmod(found["cuda"], 1000)
        yield Finding(Level.OK, "GPU", f"{names}, CUDA {major}.{minor // 10}, {USE}")


def _none_usable(error: str, *, installed: bool) -> Finding:
    hidden = os.environ.get("CUDA_VISIBLE_DEVICES")
    if error in NO_DEVICE and hidden is not None:
        fix = "To use one: unset CUDA_VISIBLE_DEVICES, or give it the number of a GPU."
        return Finding(Level.OK, "GPU", f"none to be seen, since CUDA_VISIBLE_DEVICES is '{hidden}'. {fix}")
    if error in NO_DEVICE and not installed:
        return Finding(Level.OK, "GPU", NONE)
    fix = "See what nvidia-smi says: a driver that was updated wants a restart, a container --gpus all."
    return Finding(Level.WARNING, "GPU", f"CUDA's library is there and does not start: {error}", fix)
