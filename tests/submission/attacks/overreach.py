# ruff: noqa: PTH123, PTH208
"""Attacks on the kernel and on limits: more rights, other ways into the kernel, more memory, processes and disk."""

import ctypes
import json
import mmap
import os
import platform
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

from tests.submission.attacks.attempts import TARGETS, ThwartedError, any_of, attack, writable

OFFERS_ITSELF = "open('/proc/self/oom_score_adj', 'w').write('1000')"
"""Whoever runs this is the one to die, should one have to."""
AF_MAX = 46
GETPID_OF_32_BITS = bytes.fromhex("b814000000cd80c3")
"""mov eax, 20; int 0x80; ret: the number of this process, by the system calls of i386."""
GETPID_OF_X32 = 0x40000000 + 39


@attack("become root, mount, unshare, chroot, make devices", harms=True)
def escape() -> str:
    libc = ctypes.CDLL(None, use_errno=True)

    def call(name: str, *arguments: Any) -> Callable[[], str]:
        def attempt() -> str:
            if getattr(libc, name)(*arguments) != 0:
                raise OSError(ctypes.get_errno(), "")
            return name

        return attempt

    calls = (
        call("setuid", 0),
        call("mount", b"none", b"/tmp", b"tmpfs", 0, None),
        call("unshare", 0x10000000),
        call("unshare", 0x00020000),
        call("chroot", b"/tmp"),
        call("mknod", b"/tmp/disk", 0o60666, os.makedev(254, 0)),
        call("setns", os.open("/proc/self/ns/mnt", os.O_RDONLY), 0),
    )
    return any_of(iter(calls))


@attack("have a capability, in any of its five sets")
def have_capability() -> str:
    with open("/proc/self/status", encoding="utf-8") as file:
        sets = dict(line.split() for line in file if line.startswith("Cap"))
    if any(int(bits, 16) for bits in sets.values()):
        return json.dumps(sets)
    raise ThwartedError("all are empty")


@attack("make a socket that is no unix one: vsock, netlink and others")
def make_socket() -> str:
    def made(family: int, kind: int) -> str:
        with socket.socket(family, kind):
            return f"family {family}"

    others = (family for family in range(AF_MAX) if family != socket.AF_UNIX)
    kinds = (socket.SOCK_STREAM, socket.SOCK_DGRAM, socket.SOCK_RAW)
    return any_of((lambda pair=pair: made(*pair)) for pair in product(others, kinds))  # type: ignore[misc]


@attack("use system calls of 32 bits, or of x32", harms=True)
def use_other_table() -> str:
    if platform.machine() != "x86_64":
        raise ThwartedError("there are none")

    def of_32_bits() -> int:
        code = mmap.mmap(-1, mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
        code.write(GETPID_OF_32_BITS)
        return int(ctypes.CFUNCTYPE(ctypes.c_int)(ctypes.addressof(ctypes.c_char.from_buffer(code)))())

    def of_x32() -> int:
        return int(ctypes.CDLL(None).syscall(GETPID_OF_X32))

    return any_of((lambda call=call: in_child(call)) for call in (of_32_bits, of_x32))  # type: ignore[misc]


def in_child(call: Callable[[], int]) -> str:
    """Return the name of a call that tells a child its own number; a filter may kill the child for it."""
    child = os.fork()
    if child == 0:
        os._exit(0 if call() == os.getpid() else 1)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status != 0:
        raise ThwartedError("killed" if status < 0 else "refused")
    return call.__name__


@attack("leave its control group, or raise the limits of it")
def leave_group() -> str:
    def knobs() -> Iterator[Callable[[], str]]:
        for folder, _, files in os.walk("/sys/fs/cgroup"):
            for name in {"cgroup.procs", "memory.max", "memory.limit_in_bytes", "pids.max"}.intersection(files):
                yield lambda path=f"{folder}/{name}": writable(path)  # type: ignore[misc]

    return any_of(knobs())


@attack("find what is hidden in the command lines of what holds it", harms=True)
def read_command_lines() -> str:
    hidden = [TARGETS[name].encode() for name in ("truth", "tree", "state")]
    for name in filter(str.isdigit, os.listdir("/proc")):
        with open(f"/proc/{name}/cmdline", "rb") as file:
            line = file.read()
        if any(path in line for path in hidden) or b"--ro-bind" in line:
            return f"process {name}"
    raise ThwartedError("nothing in them")


@attack("fill the disk with a result", harms=True)
def fill_disk() -> str:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with open(os.environ["BENCHBOT_RESULT"], "wb") as file:
            file.writelines(bytes(TARGETS["file_size_bytes"] // 4) for _ in range(8))
        return "twice the limit"
    finally:
        os.truncate(os.environ["BENCHBOT_RESULT"], 0)


@attack("use more memory than allowed", harms=True)
def balloon() -> str:
    code = f"blocks = [b'x' * 2**24 for _ in range({2 * TARGETS['memory_bytes'] // 2**24})]; print(len(blocks))"
    done = subprocess.run([sys.executable, "-c", f"{OFFERS_ITSELF}; {code}"], capture_output=True, check=False)
    if done.returncode == 0:
        return "twice the limit"
    raise ThwartedError("killed" if done.returncode == -signal.SIGKILL else done.stderr.decode().split()[-1])


@attack("fork without end", harms=True)
def fork_bomb() -> str:
    children: list[int] = []
    try:
        while len(children) < 4 * TARGETS["processes"]:
            child = os.fork()
            if child == 0:
                time.sleep(600)
                os._exit(0)
            children.append(child)
        return f"{len(children)} processes"
    finally:
        for child in children:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


@attack("use more memory than allowed, in eight processes", harms=True)
def balloons() -> str:
    eater = f"{OFFERS_ITSELF}; x = b'x' * {TARGETS['memory_bytes'] // 4}; print(len(x), flush=True); input()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    children = [subprocess.Popen([sys.executable, "-c", eater], **pipes) for _ in range(8)]  # type: ignore[call-overload]
    told = [child.stdout.readline() for child in children]
    alive = sum(child.poll() is None for child in children)
    for child in children:
        child.kill()
        child.communicate()
    if alive == len(children) and all(told):
        return "twice the limit"
    raise ThwartedError(f"{len(children) - alive} killed")


@attack("use more memory than allowed, in files that nobody has mapped", harms=True)
def hidden_memory() -> str:
    each = min(TARGETS["file_size_bytes"], 2**20)
    filled = f"[os.write(os.memfd_create('x'), b'x' * {each}) for _ in range({2 * TARGETS['memory_bytes'] // each})]"
    code = f"import os; {OFFERS_ITSELF}; print(sum({filled}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    if done.returncode == 0:
        return f"{done.stdout.decode().strip()} bytes"
    raise ThwartedError("killed" if done.returncode == -signal.SIGKILL else done.stderr.decode().split()[-1])
