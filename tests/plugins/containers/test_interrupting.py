"""Ctrl-C while a container runs: nothing of it stays on this machine."""

import os
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import docker
import pytest

from tests.cli.submitted import SELECTION
from tests.plugins.containers import solutions
from tests.supervisor.harness import eventually

pytestmark = pytest.mark.xdist_group("containers")

STUBBORN = """\
import os, signal, sys, time
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN)
if os.fork() == 0:
    os.setsid()
print("it runs")
sys.stdout.flush()
time.sleep(1000.375)
"""


def test_an_interrupted_container_leaves_nothing(engine_variables: dict[str, str], tmp_path: Path) -> None:
    folder = solutions.write(tmp_path / "stubborn", STUBBORN)
    command = [sys.executable, "-m", "benchbot", "submit", *SELECTION, "--containerised", str(folder)]
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    environment = {**os.environ, "BENCHBOT_PLUGINS": "benchbot-sample", "TMPDIR": str(temporary)}
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as submitting:
        assert submitting.stderr is not None
        assert any("it runs" in line for line in submitting.stderr)
        submitting.send_signal(signal.SIGINT)
        said = submitting.stderr.read()
    assert submitting.returncode == 130
    assert "Interrupted" in said
    with closing(docker.APIClient(base_url=engine_variables["DOCKER_HOST"])) as client:
        assert client.containers(all=True) == []
    assert str(temporary) not in Path("/proc/self/mountinfo").read_text("utf-8")
    assert list(temporary.iterdir()) == []
    assert eventually(lambda: not [path for path in Path("/proc").glob("[0-9]*/cmdline") if stubborn(path)])


def stubborn(path: Path) -> bool:
    try:
        return b"/solution/solution.py" in path.read_bytes()
    except OSError:
        return False
