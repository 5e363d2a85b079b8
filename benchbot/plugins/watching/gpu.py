"""What this machine's GPUs do, as NVIDIA's own tool tells it again and again.

https://docs.nvidia.com/deploy/nvidia-smi/index.html
"""

import shutil
import subprocess
import threading
from collections.abc import Mapping
from dataclasses import dataclass

PERIOD_S = 2
_MIB = 2**20
_QUERY = ("--query-gpu=index,utilization.gpu,memory.used", "--format=csv,noheader,nounits")


@dataclass(frozen=True)
class GpuUse:
    """The share of time in which the busiest GPU was in use, and the memory that is in use on all of them."""

    percent: float
    memory_bytes: int


class GpuMeter:
    """Asks `nvidia-smi`, in a process that ends with this one; without that tool, nothing is known (`use` is None)."""

    def __init__(self) -> None:
        self.use: GpuUse | None = None
        self._process: subprocess.Popen[str] | None = None
        tool = shutil.which("nvidia-smi")
        if tool is not None:
            command = [tool, *_QUERY, f"--loop={PERIOD_S}"]
            try:
                self._process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
                )
            except OSError:  # what has its name is not it
                return
            threading.Thread(target=self._read, args=(self._process,), name="benchbot-gpu", daemon=True).start()

    def close(self) -> None:
        """End the tool."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _read(self, process: "subprocess.Popen[str]") -> None:
        told: dict[str, str] = {}
        for line in process.stdout or ():
            index, _, rest = line.partition(",")
            told[index] = rest
            self.use = use_of(told)


def use_of(told: Mapping[str, str]) -> GpuUse | None:
    """Return what was told of each GPU, by its number: `share, MiB`. A GPU that is divided (MIG) tells no share."""
    shares, memory_bytes = [], 0
    for rest in told.values():
        share, _, memory = (part.strip() for part in rest.partition(","))
        if memory.isdecimal():
            memory_bytes += int(memory) * _MIB
            shares.append(float(share) if share.isdecimal() else 0.0)
    return GpuUse(max(shares), memory_bytes) if shares else None
