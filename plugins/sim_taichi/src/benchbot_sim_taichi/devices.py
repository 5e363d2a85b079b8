"""The device that rays are traced on, as the option `device` says: the processor, or a GPU. Starts no runtime."""

import ctypes
import functools
import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError, did_you_mean

AUTO, CPU, CUDA = CHOICES = ("auto", "cpu", "cuda")
NEEDED_BYTES = 2 * 2**30
"""Free memory of a GPU that is chosen by itself: for the runtime, and the largest furnished places."""
ANSWER_S = 30.0


@dataclass(frozen=True)
class Device:
    """A device of a kind, `cpu` or `cuda`; `reason` says why it is not the GPU that is there."""

    kind: str
    name: str = ""
    reason: str = ""

    def __str__(self) -> str:
        """As results keep it: `cpu`, or `cuda: NVIDIA H100`."""
        return f"{self.kind}: {self.name}" if self.name else self.kind


def described(options: Mapping[str, Any]) -> str:
    """Return the device that options choose here, in words; raises BenchbotError as `resolve` does."""
    device = resolve(options)
    return f"{device} ({device.reason})" if device.reason else str(device)


def resolve(options: Mapping[str, Any]) -> Device:
    """Return the device that options choose here: by default a GPU, if there is one and it is free.

    Raises BenchbotError when they name a GPU and there is none, and for what is no device.
    """
    if "arch" in options:
        raise BenchbotError(
            "The ray tracer has no option 'arch' any more.",
            "What rays are traced on is called the device, everywhere.",
            f"Choose it by --device {options['arch']}, or by 'device' instead of 'arch' among the options.",
        )
    asked = str(options.get("device", AUTO))
    if asked not in CHOICES:
        raise BenchbotError(
            f"There is no device called '{asked}'.",
            f"Rays are traced on one of: {', '.join(CHOICES)}.{did_you_mean(asked, list(CHOICES))}",
            "Choose one of them with --device, or leave it out.",
        )
    if asked == CPU:
        return Device(CPU)
    gpu = _gpu()
    if asked == CUDA and (gpu is None or "problem" in gpu):
        why = "CUDA's library (libcuda.so.1) is not here." if gpu is None else f"CUDA says: {gpu['problem']}."
        raise BenchbotError(
            "There is no GPU here to trace rays on.",
            why,
            "Leave --device away to use the processor; benchbot doctor says what a GPU would need.",
        )
    if gpu is None or gpu.get("problem") in ("CUDA_ERROR_NO_DEVICE", "it offers no GPU"):
        return Device(CPU)
    reason = "" if asked == CUDA else _why_not(gpu)
    return Device(CPU, reason=reason) if reason else Device(CUDA, gpu["name"])


def _why_not(gpu: Mapping[str, Any]) -> str:
    if "problem" in gpu:
        return f"CUDA does not start: {gpu['problem']}"
    if gpu["is_taken"]:
        return f"{gpu['name']} belongs to another process alone"
    if gpu["free_bytes"] is not None and gpu["free_bytes"] < NEEDED_BYTES:
        free, needed = gpu["free_bytes"] / 2**30, NEEDED_BYTES / 2**30
        return f"{gpu['name']} has {free:.1f} GiB of memory free, and {needed:g} are needed"
    return ""


@functools.cache
def _gpu() -> dict[str, Any] | None:
    """Return what `gpu_query` says, once for this process; None where CUDA is not installed."""
    try:
        ctypes.CDLL("libcuda.so.1")
    except OSError:
        return None
    command = [sys.executable, "-I", "-S", str(Path(__file__).with_name("gpu_query.py"))]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=ANSWER_S, check=True)
        answer: dict[str, Any] = json.loads(done.stdout)
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        return {"problem": f"{type(error).__name__}: {error}"}
    return answer
