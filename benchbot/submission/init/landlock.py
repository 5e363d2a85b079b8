"""Landlock: a process gives up access to files but some, and its ways to other processes, for good (landlock(7))."""

import ctypes
import os
import stat
import struct
from collections.abc import Iterable

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
VERSION_FLAG = 1
PATH_BENEATH = 1
NEEDED_VERSION = 6
"""The first one that keeps a process from sending signals to others."""

# linux/landlock.h
EXECUTE, WRITE_FILE, READ_FILE, READ_DIR, TRUNCATE, IOCTL_DEV = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 14, 1 << 15
EVERYTHING = (1 << 16) - 1
ON_FILES = EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE | IOCTL_DEV
READ = EXECUTE | READ_FILE | READ_DIR
NAMES = READ_DIR
DEVICE = READ_FILE | WRITE_FILE | IOCTL_DEV
ALL_NETWORK = 0b11
ALL_SCOPES = 0b11


def version() -> int:
    """Return the version of Landlock's interface in this kernel; 0 where there is none."""
    found = int(ctypes.CDLL(None, use_errno=True).syscall(CREATE_RULESET, None, 0, VERSION_FLAG))
    return max(0, found)


def restrict(rules: Iterable[tuple[str, int]]) -> None:
    """Restrict this process to what lies at and below the paths of `rules`, each with the rights to it.

    No TCP is left, no signal to others, no abstract socket of others. Raises OSError when the kernel cannot do it.
    """
    # A newer version knows rights that this one does not: they stay as they are.
    wanted = struct.pack("=QQQ", EVERYTHING, ALL_NETWORK, ALL_SCOPES)
    ruleset = _call(CREATE_RULESET, wanted, len(wanted), 0)
    for path, rights in rules:
        _allow(ruleset, path, rights)
    _call(RESTRICT_SELF, ruleset, 0)
    os.close(ruleset)


def _allow(ruleset: int, path: str, rights: int) -> None:
    handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        usable = rights if stat.S_ISDIR(os.fstat(handle).st_mode) else rights & ON_FILES
        if usable:
            _call(ADD_RULE, ruleset, PATH_BENEATH, struct.pack("=Qi", usable, handle), 0)
    finally:
        os.close(handle)


def _call(number: int, *arguments: int | bytes) -> int:
    result = int(ctypes.CDLL(None, use_errno=True).syscall(number, *arguments))
    if result < 0:
        code = ctypes.get_errno()
        raise OSError(code, f"Landlock: {os.strerror(code)}")
    return result
