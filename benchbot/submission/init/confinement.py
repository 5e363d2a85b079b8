"""The confinement of a solution before it starts: its user, resource limits, files and system calls."""

import base64
import ctypes
import errno
import os
import resource
import struct
from pathlib import Path
from typing import Any

from benchbot.submission.init import landlock

PR_SET_DUMPABLE = 4
PR_SET_SECCOMP = 22
PR_CAPBSET_DROP = 24
CAPABILITY_VERSION = 0x20080522
PR_SET_NO_NEW_PRIVS = 38
SECCOMP_MODE_FILTER = 2
FILTER_STEP_BYTES = 8


class _Program(ctypes.Structure):
    """`struct sock_fprog` (linux/filter.h)."""

    _fields_ = (("length", ctypes.c_ushort), ("filter", ctypes.c_char_p))


def of_init_process(wanted: dict[str, Any] | None) -> None:
    """Give up root and all capabilities where a `user` is named, and forbid the solution to trace this process.

    Raises OSError when the kernel refuses.
    """
    if wanted is None:
        return
    user = wanted["user"]
    if user is not None:
        for capability in range(int(Path("/proc/sys/kernel/cap_last_cap").read_text()) + 1):
            _prctl(PR_CAPBSET_DROP, capability)
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
        # The inheritable ones outlast that (capabilities(7)); effective, permitted, inheritable: twice 32 bits of each.
        if ctypes.CDLL(None).capset(struct.pack("=Ii", CAPABILITY_VERSION, 0), bytes(24)) != 0:
            raise OSError(errno.EPERM, "its capabilities cannot be given up")
    _prctl(PR_SET_DUMPABLE, 0)


def of_solution(wanted: dict[str, Any] | None) -> None:
    """Set `limits` (by the names of `resource`), forbid new privileges, restrict it to `files`, load the call `filter`.

    Called in the solution's process. Raises OSError when the kernel refuses: then it must not be started.
    """
    if wanted is None:
        return
    for name, limit in wanted["limits"].items():
        number = getattr(resource, name)
        _, hard = resource.getrlimit(number)
        most = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        # One second more, so that it ends by SIGXCPU, which names the cause, instead of SIGKILL.
        resource.setrlimit(number, (most, most + 1 if name == "RLIMIT_CPU" and hard != most else most))
    os.umask(0o077)
    _prctl(PR_SET_NO_NEW_PRIVS, 1)
    if wanted["files"] is not None:
        landlock.restrict(wanted["files"])
    program = base64.b64decode(wanted["filter"])
    loaded = _Program(len(program) // FILTER_STEP_BYTES, program)
    _prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.addressof(loaded))


def _prctl(option: int, first: int, second: int = 0) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    words = (ctypes.c_ulong(word) for word in (first, second, 0, 0))
    if libc.prctl(option, *words) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
