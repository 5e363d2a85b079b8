"""Machines in a private network, made of namespaces of this one: to kill one is to pull its plug."""

import os
import signal
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Self

from tests.supervisor.harness import alive, children_of, eventually

NETWORK = "10.78.0"
PATIENCE_S = 120.0
# `cat` ends, and everything on the machine with it, when the test's end of the pipe closes, however that happens.
# With SIGCHLD ignored the kernel takes away the dead that this first process inherits.
_HOLD = """\
hostname "$0" && ip link set lo up && mount -t tmpfs none /dev/shm && echo ready && exec env --ignore-signal=CHLD cat
"""
_UNSHARE = ("unshare", "--net", "--mount", "--uts", "--pid", "--fork", "--kill-child", "--mount-proc")


@dataclass(frozen=True)
class Machine:
    """A host name, a network address, and processes of its own; the file system is everybody's."""

    name: str
    address: str
    first_process: int

    @property
    def prefix(self) -> tuple[str, ...]:
        """The words before a command that run it there, in the folder of the caller."""
        spaces = ("--net", "--mount", "--uts", "--pid")
        return ("nsenter", "--target", str(self.first_process), *spaces, f"--wd={Path.cwd()}", "--")

    def run(self, *words: str, timeout_s: float = PATIENCE_S) -> str:
        """Run a command there; return what it says on stdout."""
        command = [*self.prefix, *words]
        return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, timeout=timeout_s).stdout

    def start(
        self, *words: str, log: IO[bytes], environment: Mapping[str, str] | None = None
    ) -> "subprocess.Popen[bytes]":
        """Start a command there that goes on until it ends by itself or the machine dies."""
        return subprocess.Popen(
            [*self.prefix, *words], stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment
        )

    def kill(self) -> None:
        """Pull the plug: every process there is gone at once."""
        os.kill(self.first_process, signal.SIGKILL)
        assert eventually(lambda: not alive(self.first_process), PATIENCE_S)

    @classmethod
    @contextmanager
    def held(cls, name: str, address: str) -> Iterator[Self]:
        """Yield a machine without a cable, alive until the block ends or it is killed."""
        words = [*_UNSHARE, "sh", "-c", _HOLD, name]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
            assert holder.stdout is not None
            assert holder.stdout.readline() == "ready\n"
            (first,) = children_of(holder.pid)
            yield cls(name, address, first)


@contextmanager
def machines(names: Sequence[str]) -> Iterator[tuple[Machine, ...]]:
    """Yield machines that reach one another and nothing else; the switch is in the first one."""
    with ExitStack() as stack:
        made = [stack.enter_context(Machine.held(name, f"{NETWORK}.{number}")) for number, name in enumerate(names, 1)]
        head = made[0]
        head.run("ip", "link", "add", "switch", "type", "bridge")
        head.run("ip", "address", "add", f"{head.address}/24", "dev", "switch")
        head.run("ip", "link", "set", "switch", "up")
        for number, machine in enumerate(made[1:], 1):
            there = ("peer", "name", "cable", "netns", str(machine.first_process))
            port = f"port{number}"
            subprocess.run(
                [
                    "nsenter",
                    "--target",
                    str(head.first_process),
                    "--net",
                    "ip",
                    "link",
                    "add",
                    port,
                    "type",
                    "veth",
                    *there,
                ],
                check=True,
            )
            head.run("ip", "link", "set", port, "master", "switch", "up")
            machine.run("ip", "address", "add", f"{machine.address}/24", "dev", "cable")
            machine.run("ip", "link", "set", "cable", "up")
        yield tuple(made)
