"""Two private networks with one cable between them, and no other way out: for a robot, and for what drives it."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Self

from plugins.robot_ros2.tests.unicycle import until

CABLE_UP = ("ip", "link", "set", "cable", "up")
CABLE_DOWN = ("ip", "link", "set", "cable", "down")
# A network of its own, and shared memory of its own: Fast DDS would go through that one instead of the cable.
_UNSHARE = ("unshare", "--net", "--mount")
_HOLD = "mount -t tmpfs none /dev/shm && ip link set lo up && echo ready && exec cat"
_AS_ROOT = os.geteuid() == 0


@dataclass(frozen=True)
class Network:
    """A network namespace, and one of mounts, held by a process."""

    holder: int

    @property
    def prefix(self) -> tuple[str, ...]:
        """The words before a command that run it in this network, in the root folder."""
        user = () if _AS_ROOT else ("--user", "--preserve-credentials")
        return ("nsenter", "--target", str(self.holder), *user, "--net", "--mount", "--")

    def run(self, *words: str) -> str:
        """Run a command in it; return what it says."""
        return subprocess.run([*self.prefix, *words], check=True, stdout=subprocess.PIPE, text=True).stdout

    def is_running(self) -> bool:
        """Say whether the cable carries what is sent."""
        return "state UP" in self.run("ip", "link", "show", "cable")

    @classmethod
    @contextmanager
    def held(cls, *start: str) -> Iterator[Self]:
        """Yield a new network, made by a process that is started through `start`."""
        words = [*start, *_UNSHARE, "sh", "-c", _HOLD]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
            assert holder.stdout is not None
            assert holder.stdout.readline() == "ready\n"
            yield cls(holder.pid)


@contextmanager
def two_networks() -> Iterator[tuple[Network, Network]]:
    """Yield two networks, `10.77.0.1` and `10.77.0.2`; their ends of the cable are called `cable`."""
    with ExitStack() as stack:
        # Who is not root may do this as the root of a user namespace.
        first = stack.enter_context(Network.held(*(() if _AS_ROOT else ("unshare", "--user", "--map-root-user"))))
        second = stack.enter_context(Network.held(*first.prefix))
        there = ("peer", "name", "cable", "netns", str(second.holder))
        first.run("ip", "link", "add", "name", "cable", "type", "veth", *there)
        for number, network in enumerate((first, second), 1):
            network.run("ip", "address", "add", f"10.77.0.{number}/24", "dev", "cable")
            network.run(*CABLE_UP)
        for network in (first, second):
            # Fast DDS passes over a device that is not running yet, and the kernel takes its time to say so.
            until(network.is_running)
        yield first, second
