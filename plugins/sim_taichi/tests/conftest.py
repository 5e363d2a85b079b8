"""What the simulator's tests share."""

import subprocess
import sys
from pathlib import Path

import pytest

WARM = "import sys; from pathlib import Path; from benchbot_sim_taichi.warm import warm; warm(Path(sys.argv[1]))"


@pytest.fixture(scope="session")
def kernel_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache folder with all kernels; the runtime stores them when a process ends, hence one of its own."""
    cache = tmp_path_factory.mktemp("kernels")
    subprocess.run([sys.executable, "-c", WARM, str(cache)], check=True)
    return cache
