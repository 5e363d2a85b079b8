"""The limits of a sandboxed solution: their defaults, and the errors for those that are reached."""

import errno
import os
import signal
from dataclasses import fields, replace

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.submission.modes import ProcessLimits

GIBIBYTE = 2**30
DEFAULTS = ProcessLimits(memory_bytes=8 * GIBIBYTE, processes=512, file_size_bytes=GIBIBYTE)
TEMPORARY_BYTES = GIBIBYTE
OPEN_FILES = 4096
ADDRESSES_PER_BYTE = 4
"""Bytes of address space for each byte of memory: threads reserve much that they never use."""


def with_defaults(limits: ProcessLimits) -> ProcessLimits:
    """Return the limits, those that are not given taken from the defaults."""
    missing = {one.name: getattr(DEFAULTS, one.name) for one in fields(limits) if getattr(limits, one.name) is None}
    return replace(limits, **missing)


def of_each_process(limits: ProcessLimits, *, grouped: bool) -> dict[str, int]:
    """Return the limits of each process, by the names of `resource`.

    Where a control group holds the memory of all of them together, no process has a limit on that of its own.
    """
    found = {"RLIMIT_CORE": 0, "RLIMIT_NOFILE": OPEN_FILES}
    if limits.file_size_bytes is not None:
        found["RLIMIT_FSIZE"] = limits.file_size_bytes
    if limits.processes is not None:
        found["RLIMIT_NPROC"] = limits.processes
    if limits.cpu_time_s is not None:
        found["RLIMIT_CPU"] = max(1, round(limits.cpu_time_s))
    if limits.memory_bytes is not None and not grouped:
        found["RLIMIT_DATA"] = limits.memory_bytes
        found["RLIMIT_AS"] = ADDRESSES_PER_BYTE * limits.memory_bytes
    return found


def explain(limits: ProcessLimits, status: int, last_words: str) -> BenchbotError | None:
    """Return the limit that a solution which ended with `status` and these words has met, as far as they tell."""
    if status == -signal.SIGXCPU:
        return BenchbotError(
            "The solution has used up its CPU time.",
            f"It had {limits.cpu_time_s:g} seconds, and was ended.",
            "Give it more with --cpu-time SECONDS, or look for what it spends them on.",
            failure=FailureClass.TIMEOUT,
        )
    if status == -signal.SIGXFSZ or os.strerror(errno.EFBIG) in last_words:
        return _reached("It wrote a file larger", limits.file_size_bytes, "bytes", "--file-size BYTES", last_words)
    if "MemoryError" in last_words or os.strerror(errno.ENOMEM) in last_words:
        return out_of_memory(limits, last_words)
    if "can't start new thread" in last_words or os.strerror(errno.EAGAIN) in last_words:
        return out_of_processes(limits, last_words)
    if os.strerror(errno.ENOSPC) in last_words:
        return BenchbotError(
            "The solution ran out of room.",
            f"What it writes is kept in memory, and /tmp holds {size(TEMPORARY_BYTES)}.\n{last_words}",
            "Write less, and only what is needed later.",
            failure=FailureClass.AGENT,
        )
    return None


def out_of_memory(limits: ProcessLimits, last_words: str) -> BenchbotError:
    """Return the error of a solution that was killed, or refused, for memory."""
    return _reached("It used more memory", limits.memory_bytes, "bytes", "--memory SIZE", last_words)


def out_of_processes(limits: ProcessLimits, last_words: str) -> BenchbotError:
    """Return the error of a solution that was refused a process or thread."""
    return _reached(
        "It had more processes and threads", limits.processes, "at a time", "--processes NUMBER", last_words
    )


def size(count: int | None) -> str:
    """Return a number of bytes in words: `8 GiB`."""
    for unit, name in ((2**30, "GiB"), (2**20, "MiB"), (2**10, "KiB")):
        if count is not None and count >= unit:
            return f"{count / unit:.4g} {name}"
    return f"{count} bytes"


def _reached(what: str, limit: int | None, unit: str, option: str, last_words: str) -> BenchbotError:
    told = size(limit) if unit == "bytes" else f"{limit} {unit}"
    return BenchbotError(
        "The solution met a limit of its sandbox.",
        f"{what} than it may: {told}.\n{last_words}".strip(),
        f"Give it more with {option}, or have it use less.",
        failure=FailureClass.AGENT,
    )
