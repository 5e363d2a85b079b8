"""What every test that renders starts from: kernels and the light of the miniroom, worked out once for all of them."""

import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

WARM = "import sys; from pathlib import Path; from benchbot_sim_taichi.warm import warm; warm(Path(sys.argv[1]))"
DEMO = (
    *("submit", "--task", "semantic_slam:passive:ground_truth:segmentation", "--robot", "carter_lowres"),
    *("--env", "miniroom:1", "--seed", "7", "--example", "segmentation_mapper", "--evaluate-with", "omq"),
    *("--require", "OMQ>=0.85", "--record", "frames=frames", "--results-location", "result.json"),
)
"""The demo on the robot with the small camera; it writes into the folder in which it runs."""


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the demo's command ran twice with one seed: in `first`, and at once again in `second`.

    The first time nothing is in `cache`, as for somebody new: kernels are compiled, the light is worked out. The worker
    that asks first runs them, in processes of their own: the runtime stores kernels when a process ends. Afterwards the
    cache gets the kernels that warming alone compiles, and nobody writes to it again.
    """
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    demo, done = folder / "demo", folder / "demo.done"
    with (folder / "demo.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            shutil.rmtree(demo, ignore_errors=True)  # of a worker whose demo failed
            for run in (demo / "first", demo / "second"):
                run.mkdir(parents=True)
                benchbot(run, *DEMO, cache=demo / "cache")
            subprocess.run([sys.executable, "-c", WARM, str(demo / "warmed")], check=True)
            shutil.rmtree(demo / "cache" / "kernels")
            (demo / "warmed" / "kernels").rename(demo / "cache" / "kernels")
            done.touch()
    return demo


def benchbot(folder: Path, *words: str, cache: Path) -> str:
    """Run a command that must succeed; return what it printed as data."""
    variables = {"BENCHBOT_STATE_DIR": str(cache.with_name("state")), "BENCHBOT_CACHE_DIR": str(cache)}
    command = [sys.executable, "-m", "benchbot", *words]
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, **variables}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def kernel_cache(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache folder of this worker's own, in which all kernels and the light of `miniroom:1` are."""
    return shutil.copytree(demo / "cache", tmp_path_factory.mktemp("kernels") / "cache")
