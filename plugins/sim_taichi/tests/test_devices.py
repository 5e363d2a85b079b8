"""The device is a GPU where there is one and it is free, as a driver says that was compiled for this test."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.plugin import BenchbotError
from benchbot_sim_taichi import devices

CUDA = """
#include <string.h>
int cuInit(unsigned flags) { return INIT; }
int cuDeviceGetCount(int *count) { *count = COUNT; return 0; }
int cuGetErrorName(int code, const char **name) {
    *name = code == 100 ? "CUDA_ERROR_NO_DEVICE" : "CUDA_ERROR_X";
    return 0;
}
int cuDeviceGetName(char *name, int size, int device) { strncpy(name, "Test GPU", size); return 0; }
int cuDeviceGetUuid(void *identity, int device) { memset(identity, 0xab, 16); return 0; }
"""
NVML = """
#include <string.h>
int nvmlInit_v2(void) { return 0; }
int nvmlDeviceGetHandleByUUID(const char *uuid, void **handle) {
    return strcmp(uuid, "GPU-abababab-abab-abab-abab-abababababab") != 0;
}
int nvmlDeviceGetMemoryInfo(void *handle, unsigned long long *sizes) { sizes[1] = FREE_MIB << 20; return 0; }
int nvmlDeviceGetComputeMode(void *handle, int *mode) { *mode = MODE; return 0; }
int nvmlDeviceGetComputeRunningProcesses(void *handle, unsigned *count, void *infos) { *count = RUNNING; return 7; }
"""
RESOLVE = """
import sys
from benchbot.plugin import BenchbotError
from benchbot_sim_taichi import devices
try:
    print(devices.described({"device": sys.argv[1]}))
except BenchbotError as error:
    print("refused:", error.why)
assert "taichi" not in sys.modules
"""


def compiled(folder: Path, library: str, source: str, **values: int) -> None:
    defined = [f"-D{name}={value}ULL" if name == "FREE_MIB" else f"-D{name}={value}" for name, value in values.items()]
    command = ["cc", "-shared", "-fPIC", *defined, "-x", "c", "-", "-o", str(folder / library)]
    subprocess.run(command, input=source, text=True, check=True)


def said(folder: Path, asked: str) -> str:
    """Return what a process says that finds the libraries of a folder."""
    environment = {**os.environ, "LD_LIBRARY_PATH": str(folder)}
    command = [sys.executable, "-c", RESOLVE, asked]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.parametrize(
    ("cuda", "nvml", "auto", "asked"),
    [
        ({"INIT": 0, "COUNT": 1}, (9000, 0, 5), "cuda: Test GPU", "cuda: Test GPU"),
        (
            {"INIT": 0, "COUNT": 1},
            (1536, 0, 0),
            "cpu (Test GPU has 1.5 GiB of memory free, and 2 are needed)",
            "cuda: Test GPU",
        ),
        ({"INIT": 0, "COUNT": 1}, (9000, 3, 1), "cpu (Test GPU belongs to another process alone)", "cuda: Test GPU"),
        ({"INIT": 0, "COUNT": 1}, (9000, 3, 0), "cuda: Test GPU", "cuda: Test GPU"),
        ({"INIT": 0, "COUNT": 1}, None, "cuda: Test GPU", "cuda: Test GPU"),
        ({"INIT": 0, "COUNT": 0}, None, "cpu", "refused: CUDA says: it offers no GPU."),
        ({"INIT": 100, "COUNT": 0}, None, "cpu", "refused: CUDA says: CUDA_ERROR_NO_DEVICE."),
        (
            {"INIT": 999, "COUNT": 0},
            None,
            "cpu (CUDA does not start: CUDA_ERROR_X)",
            "refused: CUDA says: CUDA_ERROR_X.",
        ),
    ],
)
def test_a_gpu_that_is_free_is_used_and_one_that_is_asked_for_must_be_there(
    cuda: dict[str, int], nvml: tuple[int, int, int] | None, auto: str, asked: str, tmp_path: Path
) -> None:
    compiled(tmp_path, "libcuda.so.1", CUDA, **cuda)
    if nvml is not None:
        compiled(tmp_path, "libnvidia-ml.so.1", NVML, **dict(zip(("FREE_MIB", "MODE", "RUNNING"), nvml, strict=True)))

    assert [said(tmp_path, choice) for choice in ("auto", "cuda", "cpu")] == [auto, asked, "cpu"]


def test_a_driver_that_crashes_takes_nothing_with_it(tmp_path: Path) -> None:
    compiled(tmp_path, "libcuda.so.1", "void abort(void); int cuInit(unsigned flags) { abort(); }")

    assert said(tmp_path, "auto").startswith("cpu (CUDA does not start: CalledProcessError: ")


@pytest.mark.parametrize(
    ("options", "fix"),
    [
        ({"arch": "cuda"}, "Choose it by --device cuda, or by 'device' instead of 'arch' among the options."),
        ({"device": "cudda"}, "Choose one of them with --device, or leave it out."),
    ],
)
def test_what_is_no_device_is_refused(options: dict[str, str], fix: str) -> None:
    with pytest.raises(BenchbotError) as refused:
        devices.resolve(options)

    assert refused.value.fix == fix
