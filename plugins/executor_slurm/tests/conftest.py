from collections.abc import Iterator
from pathlib import Path

import pytest

from benchbot_executor_slurm import array_job
from plugins.executor_slurm.tests.cluster import Cluster, cluster


@pytest.fixture(scope="session")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with cluster(tmp_path_factory.mktemp("slurm")) as made:
        yield made


@pytest.fixture
def slurm(running: Cluster, monkeypatch: pytest.MonkeyPatch) -> Cluster:
    """A cluster whose commands this process finds on PATH."""
    monkeypatch.setenv("PATH", str(running.commands), prepend=":")
    for name, value in running.environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(array_job, "ASK_AGAIN_S", 0.2)
    return running


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a batch, with a name that a careless script would stumble over."""
    path = tmp_path / "a 100%A batch's"
    path.mkdir()
    return path
