"""Use of GPUs from lines as `nvidia-smi` prints them (an H200, two GPUs, a GPU that is divided), and rates."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.watching.usage import GpuMeter, GpuUsage, Rates, _process_usage, gpu_usage, process_tree_usage

_MIB = 2**20


def test_the_busiest_share_and_all_memory_are_told() -> None:
    assert gpu_usage({"0": " 0, 0\n"}) == GpuUsage(0.0, 0)
    assert gpu_usage({"0": " 17, 2048\n", "1": " 93, 512\n"}) == GpuUsage(93.0, 2560 * _MIB)
    assert gpu_usage({"0": " [N/A], 4096\n"}) == GpuUsage(0.0, 4096 * _MIB)


def test_what_is_no_answer_is_none() -> None:
    assert gpu_usage({}) is None
    assert gpu_usage({"NVIDIA-SMI has failed because it couldn't communicate with the NVIDIA driver.\n": ""}) is None


def test_without_the_tool_nothing_is_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    meter = GpuMeter()
    assert meter.usage is None
    meter.close()


def test_the_children_of_a_process_are_counted_and_one_that_is_not_there_has_no_usage() -> None:
    held_bytes = 2**26
    child = f"data = b'x' * {held_bytes}; print('begun', flush=True); import time; time.sleep(1000)"
    command = ["sh", "-c", '"$0" -c "$1" & wait', sys.executable, child]
    with subprocess.Popen(command, stdout=subprocess.PIPE, process_group=0) as shell:
        try:
            assert shell.stdout is not None
            assert shell.stdout.readline() == b"begun\n"
            alone, together = _process_usage(shell.pid), process_tree_usage(shell.pid)
        finally:
            os.killpg(shell.pid, signal.SIGKILL)
    assert alone is not None
    assert together is not None
    assert alone.memory_bytes < held_bytes < together.memory_bytes
    assert process_tree_usage(shell.pid) is None


@given(st.floats(0.0, 1e4), st.lists(st.floats(0.01, 1.0), min_size=2, max_size=200))
def test_a_steady_pace_is_told_whatever_the_moments(per_s: float, pauses_s: list[float]) -> None:
    rates, now_s = Rates(), 100.0
    assert rates.note(now_s, 0.0) == (0.0,)
    for pause_s in pauses_s:
        now_s += pause_s
        (found,) = rates.note(now_s, per_s * (now_s - 100.0))
    assert found == pytest.approx(per_s, rel=1e-6, abs=1e-6)


def test_what_stands_still_slows_to_nothing_and_what_begins_anew_is_not_negative() -> None:
    rates = Rates(window_s=3.0)
    rates.note(0.0, 0.0)
    assert rates.note(1.0, 10.0) == (10.0,)
    for now_s in range(2, 10):
        (found,) = rates.note(float(now_s), 10.0)
    assert found == 0.0
    assert rates.note(10.0, 1.0) == (0.0,)
    assert rates.note(11.0, 3.0) == (2.0,)
    # The same moment twice, as of something that is sampled once a second.
    assert rates.note(11.0, 3.0) == (2.0,)
