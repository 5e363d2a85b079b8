"""The machine: processors and memory, folders and room, shared memory, the clock, the port."""

import ctypes
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from benchbot.core import resources
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level

LITTLE_DISK_BYTES = 2**30
NO_DISK_BYTES = 50 * 2**20
LITTLE_SHARED_BYTES = 64 * 2**20
LITTLE_MEMORY_BYTES = 2 * 2**30
STALE_LOCK_S = 60.0
EARLIEST = datetime(2025, 1, 1, tzinfo=UTC)
UNSYNCHRONISED = 5
"""What adjtimex(2) returns for a clock that nothing keeps right."""


def processors() -> Iterator[Finding]:
    """Say how many processors and how much memory this process may use."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    detail = f"{count} processor{'s' * (count != 1)}"
    free = _memory_bytes("MemAvailable")
    if free is None:
        yield Finding(Level.OK, "machine", detail)
        return
    detail += f", {free / 2**30:.1f} of {(_memory_bytes('MemTotal') or 0) / 2**30:.1f} GiB of memory free"
    if free < LITTLE_MEMORY_BYTES:
        yield Finding(
            Level.WARNING, "machine", detail, "End other programs: a run in a furnished place needs about 1 GiB."
        )
    else:
        yield Finding(Level.OK, "machine", detail)


def folders() -> Iterator[Finding]:
    """Say whether BenchBot's own folders and that of temporary files can be written, and how much room there is."""
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
            yield _room(subject, folder)


def caches() -> Iterator[Finding]:
    """Say what is kept in the cache, such as compiled kernels, and which locks a killed process has left there."""
    try:
        root = resources.cache_dir()
        kept = sorted(path for path in root.iterdir() if path.is_dir())
    except (OSError, BenchbotError):
        return  # `folders` has said it
    sizes = {path.name: _size_bytes(path) for path in kept}
    detail = (
        ", ".join(f"{name} {size / 2**20:.0f} MiB" for name, size in sizes.items()) or "empty: the first run compiles"
    )
    yield Finding(Level.OK, "cache", detail)
    now_s = time.time()
    for lock in root.rglob("*.lock"):
        with suppress(OSError):
            age_s = now_s - lock.stat().st_mtime
            if age_s > STALE_LOCK_S and lock.name == "ticache.lock":
                detail = f"{lock} is {age_s / 60:.0f} min old: a process was killed while it wrote kernels"
                yield Finding(Level.OK, "cache lock", f"{detail}. The next run takes it away")


def shared_memory(folder: Path = Path("/dev/shm")) -> Iterator[Finding]:  # noqa: S108
    """Say whether there is room for what simulators hand over, picture by picture."""
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


def clock() -> Iterator[Finding]:
    """Say whether the time can be right, and whether something keeps it so."""
    now = datetime.now(UTC)
    detail = f"{now:%Y-%m-%d %H:%M} UTC"
    if now < EARLIEST:
        yield Finding(Level.WARNING, "clock", f"{detail}: that is past", "Set it: sudo timedatectl set-ntp true")
        return
    state = _clock_state()
    if state == UNSYNCHRONISED:
        detail += ", kept right by nothing: only real robots need that (sudo timedatectl set-ntp true)"
    yield Finding(Level.OK, "clock", detail)


def default_port() -> Iterator[Finding]:
    """Say whether benchbot run can listen where it does by default, and who else does."""
    from benchbot.wire import run_state

    subject = f"port {run_state.DEFAULT_PORT}"
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", run_state.DEFAULT_PORT))
        except OSError as error:
            why = error.strerror
        else:
            yield Finding(Level.OK, subject, "free")
            return
    with suppress(OSError, BenchbotError):  # a state folder that cannot be read: `folders` has said it
        for run in run_state.live():
            if (run.connection.url or "").endswith(f":{run_state.DEFAULT_PORT}"):
                yield Finding(Level.OK, subject, f"used by your run of {run.task}; benchbot stop ends it")
                return
    holder = _holder(run_state.DEFAULT_PORT)
    detail = f"cannot be used: {why}{f', by {holder}' if holder else ''}"
    yield Finding(Level.WARNING, subject, detail, "Run with another port: benchbot run --port 0 …")


def _room(subject: str, folder: Path) -> Finding:
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


def _memory_bytes(key: str) -> int | None:
    with suppress(OSError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith(f"{key}:"):
                return int(line.split()[1]) * 1024
    return None


def _clock_state() -> int | None:
    """Return what adjtimex(2) says of the clock; None where there is no such call."""
    adjtimex = getattr(ctypes.CDLL(None), "adjtimex", None)
    # A structure of zeros asks for nothing to be changed; it has 208 bytes where long has 64 bits.
    return None if adjtimex is None else int(adjtimex(ctypes.create_string_buffer(512)))


def _holder(port: int) -> str | None:
    """Return the process that listens on a TCP port, as far as this user may know."""
    wanted = f":{port:04X}"
    inodes = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with suppress(OSError):
            rows = [line.split() for line in Path(table).read_text().splitlines()[1:]]
            inodes |= {f"socket:[{row[9]}]" for row in rows if row[1].endswith(wanted) and row[3] == "0A"}
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if any(os.readlink(handle) in inodes for handle in (process / "fd").iterdir()):  # noqa: PTH115
                words = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
                return f"process {process.name} ({words[:60]})"
    return None
