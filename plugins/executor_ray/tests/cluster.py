"""A real Ray cluster of three machines, one of them the head."""

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from tests.machines import PATIENCE_S, Machine, machines
from tests.supervisor.harness import eventually

RAY = str(Path(sys.executable).parent / "ray")
PORT = 6379
FILES = "/mnt"
# Nobody is asked for a token, nothing is reported to anyone, a lost node or head is noticed within seconds, and a busy
# machine has its time.
ENVIRONMENT = {
    "RAY_AUTH_MODE": "disabled",
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_worker_register_timeout_seconds": "600",
    "RAY_health_check_initial_delay_ms": "2000",
    "RAY_health_check_period_ms": "1000",
    "RAY_health_check_timeout_ms": "5000",
    "RAY_health_check_failure_threshold": "5",
    "RAY_gcs_rpc_server_reconnect_timeout_s": "10",
}


@dataclass(frozen=True)
class Cluster:
    """Its machines, and how a program on the head finds it."""

    head: Machine
    nodes: tuple[Machine, ...]
    address: str

    def run(self, *words: str, **environment: str) -> "subprocess.CompletedProcess[str]":
        """Run a command on the head, as a user would type it there."""
        return subprocess.run(
            [*self.head.prefix, *words],
            check=False,
            capture_output=True,
            text=True,
            timeout=2 * PATIENCE_S,
            env={**os.environ, **ENVIRONMENT, "RAY_ADDRESS": self.address, **environment},
        )

    def start(
        self, *words: str, log: IO[str] | None = None, on: Machine | None = None, **environment: str
    ) -> "subprocess.Popen[str]":
        """Start a command, on the head unless told otherwise, that is talked with through stdin and stdout.

        `log` gets its stderr.
        """
        return subprocess.Popen(
            [*(on or self.head).prefix, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            env={**os.environ, **ENVIRONMENT, "RAY_ADDRESS": self.address, **environment},
        )


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    """Yield a cluster that is ready for work; what Ray prints goes to an empty folder."""
    with machines(("head", "node1", "node2")) as (head, *nodes):
        made = Cluster(head, tuple(nodes), f"{head.address}:{PORT}")
        starting = [Starting(head, folder, ("--head", f"--port={PORT}", "--include-dashboard=false", "--num-gpus=1"))]
        assert eventually(starting[0].is_over, PATIENCE_S)
        starting = [Starting(node, folder, (f"--address={made.address}",)) for node in nodes]
        assert eventually(lambda: all(node.is_over() for node in starting), PATIENCE_S)
        yield made


class Starting:
    """Starts Ray on a machine: again when it gives up, which it does after 30 s on a machine that is too busy."""

    def __init__(self, machine: Machine, folder: Path, words: Sequence[str]) -> None:
        self._machine = machine
        self._log = folder / f"{machine.name}.log"
        # Its files are its own, and where they are has a short name, since there are sockets among them.
        machine.run("mount", "-t", "tmpfs", "none", FILES)
        place = (f"--temp-dir={FILES}", f"--node-ip-address={machine.address}")
        memory = ("--memory=1000000000", "--object-store-memory=80000000")
        self._command = (RAY, "start", "--block", *place, *memory, "--num-cpus=1", *words)
        self._process = self._start()

    def is_over(self) -> bool:
        """Say whether the machine is part of the cluster now."""
        if self._process.poll() is not None:
            self._process = self._start()
        return "Ray runtime started" in self._log.read_text("utf-8")

    def _start(self) -> "subprocess.Popen[bytes]":
        with self._log.open("ab") as log:
            return self._machine.start(*self._command, log=log, environment={**os.environ, **ENVIRONMENT})
