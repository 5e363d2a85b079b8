"""The machine: processors, memory and GPUs, folders and their free space, shared memory, the clock, the port."""

import ctypes
import json
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

import psutil

from benchbot import process
from benchbot.core import resources
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.plugins.doctor import child_process

LITTLE_DISK_BYTES = 2**30
NO_DISK_BYTES = 50 * 2**20
LITTLE_SHARED_BYTES = 64 * 2**20
LITTLE_MEMORY_BYTES = 2 * 2**30
STALE_LOCK_S = 60.0
EARLIEST = datetime(2025, 1, 1, tzinfo=UTC)
UNSYNCHRONISED = 5
"""What adjtimex(2) returns for a clock that is not synchronised."""

NVIDIA_DRIVER = Path("/proc/driver/nvidia/version")
# https://docs.nvidia.com/cuda/cuda-driver-api/group__CUDA__INITIALIZE.html
CUDA_QUERY = """
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
NO_DEVICE_ERRORS = ("CUDA_ERROR_NO_DEVICE", "100")
NO_GPU = "none, and none is needed: the ray tracer runs on the processor"
GPU_USE = "which the ray tracer uses when it is free (--device)"


def processors() -> Finding:
    """Say how many processors and how much memory this process may use."""
    count = process.processors()
    memory = psutil.virtual_memory()
    free, total = (size / 2**30 for size in (memory.available, memory.total))
    detail = f"{count} processor{'s' * (count != 1)}, {free:.1f} of {total:.1f} GiB of memory free"
    if memory.available < LITTLE_MEMORY_BYTES:
        fix = "End other programs: a run in a furnished place needs about 1 GiB."
        return Finding(Level.WARNING, "machine", detail, fix)
    return Finding(Level.OK, "machine", detail)


def gpu(driver: Path = NVIDIA_DRIVER, program: str = CUDA_QUERY) -> Finding:
    """Say which GPUs CUDA offers, or why it offers none; in a child process, which a broken driver may crash."""
    answer = child_process.ask_python(program, bare=True)
    installed = driver.is_file()
    if answer.problem:
        fix = "Install NVIDIA's driver again, and restart the machine; nvidia-smi then has to answer."
        return Finding(Level.WARNING, "GPU", f"CUDA does not start: {answer.problem}", fix)
    found = json.loads(answer.output)
    if not found["library"]:
        if not installed:
            return Finding(Level.OK, "GPU", NO_GPU)
        detail = "NVIDIA's driver is loaded, and CUDA's library (libcuda.so.1) is missing"
        fix = "Install that driver's library (libcuda1 or libnvidia-compute); start a container with --gpus all."
        return Finding(Level.WARNING, "GPU", detail, fix)
    if "error" in found:
        return _no_usable_gpu(found["error"], installed=installed)
    if not found["devices"]:
        return Finding(Level.OK, "GPU", NO_GPU)
    names = ", ".join(f"{name} ({size / 2**30:.0f} GiB)" for name, size in found["devices"])
    major, minor = divmod(found["cuda"], 1000)
    return Finding(Level.OK, "GPU", f"{names}, CUDA {major}.{minor // 10}, {GPU_USE}")


def _no_usable_gpu(error: str, *, installed: bool) -> Finding:
    hidden = os.environ.get("CUDA_VISIBLE_DEVICES")
    if error in NO_DEVICE_ERRORS and hidden is not None:
        fix = "To use one: unset CUDA_VISIBLE_DEVICES, or give it the number of a GPU."
        return Finding(Level.OK, "GPU", f"none to be seen, since CUDA_VISIBLE_DEVICES is '{hidden}'. {fix}")
    if error in NO_DEVICE_ERRORS and not installed:
        return Finding(Level.OK, "GPU", NO_GPU)
    fix = "See what nvidia-smi says: a driver that was updated wants a restart, a container --gpus all."
    return Finding(Level.WARNING, "GPU", f"CUDA's library is there and does not start: {error}", fix)


def folders() -> Iterator[Finding]:
    """Say whether BenchBot's own folders and that of temporary files can be written, and their free space."""
    for subject, variable, find in (
        ("cache folder", "BENCHBOT_CACHE_DIR", resources.cache_dir),
        ("state folder", "BENCHBOT_STATE_DIR", resources.state_dir),
        ("data folder", "BENCHBOT_DATA_DIR", resources.data_dir),
        ("temporary files", "TMPDIR", lambda: Path(tempfile.gettempdir())),
    ):
        try:
            folder = find()
            with tempfile.TemporaryFile(dir=folder):
                pass
        except (OSError, BenchbotError) as error:
            detail = error.why if isinstance(error, BenchbotError) else f"{error.filename}: {error.strerror}"
            yield Finding(Level.BROKEN, subject, detail, f"Make it writable, or name another folder in {variable}.")
        else:
            yield _free_space(subject, folder)


def caches() -> Iterator[Finding]:
    """Say which folders are in the cache, such as compiled kernels, and which locks a killed process has left there."""
    try:
        root = resources.cache_dir()
        kept = sorted(path for path in root.iterdir() if path.is_dir())
    except (OSError, BenchbotError):
        return  # `folders` reports it
    sizes = {path.name: _size_bytes(path) for path in kept}
    detail = (
        ", ".join(f"{name} {size / 2**20:.0f} MiB" for name, size in sizes.items()) or "empty: the first run compiles"
    )
    yield Finding(Level.OK, "cache", detail)
    now_s = time.time()
    for lock in root.rglob("ticache.lock"):
        with suppress(OSError):
            age_s = now_s - lock.stat().st_mtime
            if age_s > STALE_LOCK_S:
                detail = f"{lock} is {age_s / 60:.0f} min old: a process was killed while it wrote kernels"
                yield Finding(Level.OK, "cache lock", f"{detail}. The next run takes it away")


def shared_memory(folder: Path = Path("/dev/shm")) -> Iterator[Finding]:  # noqa: S108
    """Say whether there is space for the pictures that simulators pass on in shared memory."""
    subject = "shared memory"
    if not folder.is_dir():
        return
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        fix = f"Mount it: sudo mount -t tmpfs -o mode=1777 tmpfs {folder}"
        yield Finding(Level.BROKEN, subject, f"{folder}: {error.strerror}", fix)
        return
    free = shutil.disk_usage(folder).free
    detail = f"{folder}, {free / 2**20:,.0f} MiB free"
    if free < LITTLE_SHARED_BYTES:
        fix = "In a container, give it more: --shm-size 512m. Elsewhere, see what is left in there."
        yield Finding(Level.WARNING, subject, detail, fix)
    else:
        yield Finding(Level.OK, subject, detail)


def clock() -> Finding:
    """Say whether the time can be right, and whether it is synchronised."""
    now = datetime.now(UTC)
    detail = f"{now:%Y-%m-%d %H:%M} UTC"
    if now < EARLIEST:
        return Finding(Level.WARNING, "clock", f"{detail}: that is past", "Set it: sudo timedatectl set-ntp true")
    if _clock_state() == UNSYNCHRONISED:
        detail += ", kept right by nothing: only real robots need that (sudo timedatectl set-ntp true)"
    return Finding(Level.OK, "clock", detail)


def default_port() -> Finding:
    """Say whether benchbot run can listen on its default port, and which process does instead."""
    from benchbot.wire import run_state

    subject = f"port {run_state.DEFAULT_PORT}"
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", run_state.DEFAULT_PORT))
        except OSError as error:
            why = error.strerror
        else:
            return Finding(Level.OK, subject, "free")
    with suppress(OSError, BenchbotError):  # a state folder that cannot be read is reported by `folders`
        for run in run_state.live():
            if (run.connection.url or "").endswith(f":{run_state.DEFAULT_PORT}"):
                detail = f"used by your run of {run.task}; benchbot stop --run {run.name} ends it"
                return Finding(Level.OK, subject, detail)
    listener = _listener(run_state.DEFAULT_PORT)
    detail = f"cannot be used: {why}{f', by {listener}' if listener else ''}"
    return Finding(Level.WARNING, subject, detail, "Run with another port: benchbot run --port 0 …")


def _free_space(subject: str, folder: Path) -> Finding:
    free = shutil.disk_usage(folder).free
    detail = f"{folder}, {free / 2**30:.1f} GiB free"
    if free < NO_DISK_BYTES:
        return Finding(Level.BROKEN, subject, detail, "Free some disk space: results cannot be written.")
    if free < LITTLE_DISK_BYTES:
        return Finding(Level.WARNING, subject, detail, "Free some disk space soon.")
    return Finding(Level.OK, subject, detail)


def _size_bytes(folder: Path) -> int:
    total = 0
    for root, _, names in os.walk(folder):
        for name in names:
            with suppress(OSError):
                total += os.lstat(os.path.join(root, name)).st_size  # noqa: PTH118
    return total


def _clock_state() -> int | None:
    """Return the clock's state from adjtimex(2); None where there is no such call."""
    adjtimex = getattr(ctypes.CDLL(None), "adjtimex", None)
    # A structure of zeros asks for nothing to be changed; it has 208 bytes where long has 64 bits.
    return None if adjtimex is None else int(adjtimex(ctypes.create_string_buffer(512)))


def _listener(port: int) -> str | None:
    """Return the process that listens on a TCP port, where this user may know."""
    with suppress(psutil.Error, OSError):
        for found in psutil.net_connections("tcp"):
            if found.status == psutil.CONN_LISTEN and found.laddr.port == port and found.pid is not None:
                command = " ".join(psutil.Process(found.pid).cmdline())
                return f"process {found.pid} ({command[:60]})"
    return None
