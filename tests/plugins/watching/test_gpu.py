"""What `nvidia-smi` says: lines as an H200 has printed them, one of two GPUs, and one of a GPU that is divided."""

from pathlib import Path

import pytest

from benchbot.plugins.watching.gpu import GpuMeter, GpuUse, use_of

_MIB = 2**20


def test_the_busiest_share_and_all_memory_are_told() -> None:
    assert use_of({"0": " 0, 0\n"}) == GpuUse(0.0, 0)
    assert use_of({"0": " 17, 2048\n", "1": " 93, 512\n"}) == GpuUse(93.0, 2560 * _MIB)
    assert use_of({"0": " [N/A], 4096\n"}) == GpuUse(0.0, 4096 * _MIB)


def test_what_is_no_answer_is_none() -> None:
    assert use_of({}) is None
    assert use_of({"NVIDIA-SMI has failed because it couldn't communicate with the NVIDIA driver.\n": ""}) is None


def test_without_the_tool_nothing_is_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    meter = GpuMeter()
    assert meter.use is None
    meter.close()
