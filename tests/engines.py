import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchbot.plugins.containers.engine import podman_service
from tests.plugins.containers import base_image

CONTAINERS_CONF = """\
[containers]
default_ulimits = ["nofile=4096:4096", "nproc=512:512"]
netns = "none"
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
events_logger = "file"
lock_type = "file"
"""
"""The settings of an engine in the machines that tests run on; its last table is `engine`."""
STORAGE_CONF = """\
[storage]
driver = "overlay"
graphroot = "{folder}/graph"
runroot = "{folder}/run"
[storage.options.overlay]
skip_mount_home = "true"
"""


@pytest.fixture(scope="session")
def podman(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The variables of a podman with a storage of its own, where an image with BenchBot's client is."""
    folder = tmp_path_factory.mktemp("podman")
    (folder / "tmp").mkdir()
    (folder / "containers.conf").write_text(f'{CONTAINERS_CONF}tmp_dir = "{folder}/tmp"\n')
    (folder / "storage.conf").write_text(STORAGE_CONF.format(folder=folder))
    variables = {
        "CONTAINERS_CONF": str(folder / "containers.conf"),
        "CONTAINERS_STORAGE_CONF": str(folder / "storage.conf"),
        "PATH": f"{os.environ['PATH']}:/usr/sbin",
    }
    with pytest.MonkeyPatch.context() as changed:
        for name, value in variables.items():
            changed.setenv(name, value)
        program = shutil.which("podman")
        assert program is not None
        with podman_service(program) as socket:
            base_image.build(f"unix://{socket}", folder / "base")
            yield {**variables, "DOCKER_HOST": f"unix://{socket}"}
    shutil.rmtree(folder)


@pytest.fixture
def engine_variables(podman: dict[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, str]:
    """The same, set for a test: the engine that BenchBot finds is that podman."""
    for name, value in podman.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    for name in ("BENCHBOT_URL", "BENCHBOT_SOCKET", "BENCHBOT_TOKEN", "BENCHBOT_RESULT"):
        monkeypatch.delenv(name, raising=False)
    return podman
