"""The executor `local`: workers as processes of this machine, each in a session of its own."""

import json
import os
import secrets
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.records import WorkOrder
from benchbot.plugins.batch.machine import ProcessId

GRACE_S = 20.0
POLL_S = 0.05


class LocalWorkers:
    """Processes that outlive their parent."""

    def __init__(self, processes: Sequence[ProcessId], children: "Sequence[subprocess.Popen[bytes]]" = ()) -> None:
        self._processes = tuple(processes)
        self._children = tuple(children)

    @property
    def reference(self) -> str:
        """The processes, as JSON."""
        return json.dumps([process.as_dict() for process in self._processes])

    def alive(self) -> int:
        """Return how many run."""
        for child in self._children:
            child.poll()  # a zombie is not alive
        return sum(not process.is_dead for process in self._processes)

    def stop(self) -> None:
        """End them: by SIGTERM, then by SIGKILL."""
        self._signal(signal.SIGTERM)
        deadline_s = time.monotonic() + GRACE_S
        while self.alive() and time.monotonic() < deadline_s:
            time.sleep(POLL_S)
        self._signal(signal.SIGKILL)
        for child in self._children:
            child.wait()

    def _signal(self, number: signal.Signals) -> None:
        for process in self._processes:
            process.signal_group(number)


def launch(order: WorkOrder) -> LocalWorkers:
    """Start workers; raises BenchbotError for options, of which there are none."""
    if order.options:
        raise BenchbotError(
            f"The executor 'local' has no option '{next(iter(order.options))}'.",
            "It has none.",
            "Leave --executor-option out, or choose another --executor.",
        )
    logs = order.folder / "workers"
    gpus = _gpus()
    if order.resources.gpus * order.count > len(gpus):
        raise BenchbotError(
            "There are not enough GPUs.",
            f"{order.count} workers need {order.resources.gpus} each; {len(gpus)} are here.",
            "Choose fewer with --jobs or --gpus.",
        )
    children = []
    try:
        logs.mkdir(parents=True, exist_ok=True)
        for place in range(order.count):
            name = f"local-{secrets.token_hex(4)}"
            mine = gpus[place * order.resources.gpus : (place + 1) * order.resources.gpus]
            environment = {**os.environ, **({"CUDA_VISIBLE_DEVICES": ",".join(mine)} if mine else {})}
            with (logs / f"{name}.log").open("ab") as log:
                children.append(
                    subprocess.Popen(
                        [*order.command, "--name", name],
                        stdin=subprocess.DEVNULL,
                        stdout=log,
                        stderr=log,
                        env=environment,
                        start_new_session=True,
                    )
                )
    except OSError as error:
        LocalWorkers([ProcessId.of(child.pid) for child in children], children).stop()
        raise BenchbotError(
            "The workers cannot be started.",
            f"{error.filename}: {error.strerror}.",
            "Free some disk space or memory, then run the same command again.",
            exit_code=ExitCode.INTERNAL,
        ) from error
    return LocalWorkers([ProcessId.of(child.pid) for child in children], children)


def attach(reference: str) -> LocalWorkers:
    """Find workers that another process has started."""
    return LocalWorkers([ProcessId.from_dict(entry) for entry in json.loads(reference)])


def _gpus() -> list[str]:
    """Return the GPUs that CUDA would use, as `CUDA_VISIBLE_DEVICES` names them."""
    chosen = os.environ.get("CUDA_VISIBLE_DEVICES")
    if chosen is not None:
        return [name for name in chosen.split(",") if name]
    folder = Path("/proc/driver/nvidia/gpus")
    return [str(number) for number, _ in enumerate(folder.iterdir())] if folder.is_dir() else []
