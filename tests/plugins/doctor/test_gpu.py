from pathlib import Path

import pytest

from benchbot.core.findings import Level
from benchbot.plugins.doctor import gpu

TWO = {"library": True, "cuda": 12080, "devices": [["NVIDIA H200", 139 * 2**30], ["NVIDIA T4", 15 * 2**30]]}


@pytest.mark.parametrize(
    ("answer", "driver", "level", "detail"),
    [
        ({"library": False}, False, Level.OK, "none, and none is needed: the ray tracer runs on the processor"),
        (
            {"library": False},
            True,
            Level.WARNING,
            "NVIDIA's driver is loaded, and CUDA's library (libcuda.so.1) is mis",
        ),
        ({"library": True, "error": "CUDA_ERROR_NO_DEVICE"}, False, Level.OK, "none, and none is needed"),
        (
            {"library": True, "error": "CUDA_ERROR_UNKNOWN"},
            True,
            Level.WARNING,
            "CUDA's library is there and does not st",
        ),
        ({"library": True, "cuda": 12080, "devices": []}, True, Level.OK, "none, and none is needed"),
        (TWO, True, Level.OK, "NVIDIA H200 (139 GiB), NVIDIA T4 (15 GiB), CUDA 12.8, for the ray tracer with --set"),
    ],
)
def test_what_cuda_says_is_told(
    answer: dict[str, object], driver: bool, level: Level, detail: str, tmp_path: Path
) -> None:
    if driver:
        (tmp_path / "version").touch()

    (finding,) = gpu.gpu(tmp_path / "version", f"import json; print(json.dumps({answer!r}))")

    assert (finding.level, finding.subject) == (level, "GPU")
    assert finding.detail.startswith(detail)
    assert bool(finding.fix) == (level is not Level.OK)


def test_gpus_that_are_hidden_are_told_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")

    (finding,) = gpu.gpu(tmp_path, 'print(\'{"library": true, "error": "CUDA_ERROR_NO_DEVICE"}\')')

    assert finding.detail.startswith("none to be seen, since CUDA_VISIBLE_DEVICES is ''.")


def test_a_driver_that_crashes_takes_nothing_with_it(tmp_path: Path) -> None:
    (finding,) = gpu.gpu(tmp_path, "import os; os.abort()")

    assert (finding.level, finding.detail) == (Level.WARNING, "CUDA does not start: signal 6")


def test_this_machine_answers() -> None:
    (finding,) = gpu.gpu()

    assert finding.detail
