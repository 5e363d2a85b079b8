"""The filter of system calls that a sandboxed solution runs under, as a program of classic BPF (seccomp(2)).

It refuses what a solution does not need and what has broken sandboxes before: sockets other than unix ones, other
processes' memory, namespaces and mounts, the kernel's keys, programs, modules, rings and counters. Everything else
stays as it is: a list of what is allowed would be out of date with every release of the C library.
"""

import errno
import platform
import socket
import struct
from dataclasses import dataclass

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass

# linux/bpf_common.h, linux/filter.h, linux/seccomp.h, linux/audit.h
_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NUMBER_AT, _ARCHITECTURE_AT, _ARGUMENT_AT = 0, 4, 16
_ALLOW, _REFUSE, _KILL = 0x7FFF0000, 0x00050000, 0x80000000
_X32 = 0x40000000
# linux/sched.h: CLONE_NEWTIME, NEWNS, NEWCGROUP, NEWUTS, NEWIPC, NEWUSER, NEWPID, NEWNET
NEW_NAMESPACES = 0x80 | 0x20000 | 0x2000000 | 0x4000000 | 0x8000000 | 0x10000000 | 0x20000000 | 0x40000000
_TIOCSTI, _TIOCLINUX = 0x5412, 0x541C

SOCKETS = ("socket", "socketpair")
"""The calls that make sockets, of which the family comes first: unix ones are allowed."""

# By name: (x86_64, aarch64 and others that use asm-generic/unistd.h)
_LOOKED_AT: dict[str, tuple[int, int]] = {
    "socket": (41, 198),
    "socketpair": (53, 199),
    "clone": (56, 220),
    "ioctl": (16, 29),
    "clone3": (435, 435),
}
REFUSED: dict[str, tuple[int, int | None]] = {
    "ptrace": (101, 117),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "process_madvise": (440, 440),
    "pidfd_getfd": (438, 438),
    "kcmp": (312, 272),
    "unshare": (272, 97),
    "setns": (308, 268),
    "mount": (165, 40),
    "umount2": (166, 39),
    "pivot_root": (155, 41),
    "chroot": (161, 51),
    "open_tree": (428, 428),
    "move_mount": (429, 429),
    "fsopen": (430, 430),
    "fsconfig": (431, 431),
    "fsmount": (432, 432),
    "fspick": (433, 433),
    "mount_setattr": (442, 442),
    "open_tree_attr": (467, 467),
    "add_key": (248, 217),
    "request_key": (249, 218),
    "keyctl": (250, 219),
    "bpf": (321, 280),
    "perf_event_open": (298, 241),
    "userfaultfd": (323, 282),
    "io_uring_setup": (425, 425),
    "io_uring_enter": (426, 426),
    "io_uring_register": (427, 427),
    "kexec_load": (246, 104),
    "kexec_file_load": (320, 294),
    "init_module": (175, 105),
    "finit_module": (313, 273),
    "delete_module": (176, 106),
    "open_by_handle_at": (304, 265),
    "name_to_handle_at": (303, 264),
    "fanotify_init": (300, 262),
    "quotactl": (179, 60),
    "quotactl_fd": (443, 443),
    "swapon": (167, 224),
    "swapoff": (168, 225),
    "reboot": (169, 142),
    "acct": (163, 89),
    "syslog": (103, 116),
    "settimeofday": (164, 170),
    "clock_settime": (227, 112),
    "personality": (135, 92),
    "lookup_dcookie": (212, 18),
    "vhangup": (153, 58),
    "nfsservctl": (180, 42),
    "iopl": (172, None),
    "ioperm": (173, None),
    "modify_ldt": (154, None),
}


@dataclass(frozen=True)
class _Architecture:
    audit: int
    column: int
    has_x32: bool


_ARCHITECTURES = {"x86_64": _Architecture(0xC000003E, 0, True), "aarch64": _Architecture(0xC00000B7, 1, False)}


def filter_program(machine: str | None = None) -> bytes:
    """Return the program as an array of `struct sock_filter`; raises BenchbotError for an unknown kind of machine.

    What is refused fails with EPERM; sockets with EACCES, and `clone3`, whose flags a filter cannot see, with ENOSYS,
    whereupon the C library takes `clone`.
    """
    machine = machine or platform.machine()
    known = _ARCHITECTURES.get(machine)
    if known is None:
        raise BenchbotError(
            f"There is no sandbox for machines of the kind '{machine}'.",
            f"The system calls of these are known: {', '.join(sorted(_ARCHITECTURES))}.",
            "Run the solution in a container: --containerised, or natively, if you trust it: --native.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        )
    number = {name: numbers[known.column] for name, numbers in _LOOKED_AT.items()}
    lines = [
        _step(_LOAD, _ARCHITECTURE_AT),
        _step(_EQUAL, known.audit, 1, 0),
        _step(_RETURN, _KILL),
        _step(_LOAD, _NUMBER_AT),
    ]
    if known.has_x32:
        # The second table of numbers, which the names above do not cover.
        lines += [_step(_AT_LEAST, _X32, 0, 1), _refuse(errno.ENOSYS)]
    for name in SOCKETS:
        lines += _if_number(number[name], [_argument(0), _step(_EQUAL, socket.AF_UNIX, 1, 0), _refuse(errno.EACCES)])
    lines += _if_number(number["clone"], [_argument(0), _step(_ANY_BIT, NEW_NAMESPACES, 0, 1), _refuse(errno.EPERM)])
    typing = [_argument(1)]
    for request in (_TIOCSTI, _TIOCLINUX):
        typing += [_step(_EQUAL, request, 0, 1), _refuse(errno.EPERM)]
    lines += _if_number(number["ioctl"], typing)
    lines += _if_number(number["clone3"], [_refuse(errno.ENOSYS)])
    for numbers in REFUSED.values():
        if (call := numbers[known.column]) is not None:
            lines += [_step(_EQUAL, call, 0, 1), _refuse(errno.EPERM)]
    return b"".join([*lines, _step(_RETURN, _ALLOW)])


def _if_number(number: int, then: list[bytes]) -> list[bytes]:
    """Return the steps for one call, whose arguments are looked at; what they do not refuse is allowed."""
    body = [*then, _step(_RETURN, _ALLOW)]
    return [_step(_EQUAL, number, 0, len(body)), *body]


def _argument(index: int) -> bytes:
    """Load the lower half of an argument; both kinds of machines keep it first."""
    return _step(_LOAD, _ARGUMENT_AT + 8 * index)


def _refuse(number: int) -> bytes:
    return _step(_RETURN, _REFUSE | number)


def _step(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("=HBBI", code, if_true, if_false, value)
