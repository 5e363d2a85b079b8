"""A cluster for all tests that do not harm it, and a driver on its head."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from plugins.executor_ray.tests.cluster import Cluster, cluster
from tests.machines import Machine

DRIVER = str(Path(__file__).with_name("driver.py"))


class Driver:
    """What launches and watches workers; it runs on a machine of the cluster, as Ray wants it."""

    def __init__(self, cluster: Cluster, on: Machine | None = None) -> None:
        self.process = cluster.start(sys.executable, DRIVER, on=on)

    def launch(self, folder: Path, command: list[str], count: int = 1, **order: Any) -> str:
        order = {"resources": {}, "options": {}, **order}
        reference: str = self._ask(
            do="launch", order={"folder": str(folder), "command": command, "count": count, **order}
        )
        return reference

    def alive(self, reference: str) -> int:
        count: int = self._ask(do="alive", reference=reference)
        return count

    def stop(self, reference: str) -> None:
        self._ask(do="stop", reference=reference)

    def end(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()

    def _ask(self, **request: Any) -> Any:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        # What is printed beside the answers would be taken for one.
        answer = json.loads(self.process.stdout.readline())
        if "error" in answer:
            raise BenchbotError(*(answer["error"][key] for key in ("title", "why", "fix")))
        return answer["answer"]


@pytest.fixture(scope="package")
def ray_cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with cluster(tmp_path_factory.mktemp("ray")) as made:
        yield made


@pytest.fixture(scope="package")
def driver(ray_cluster: Cluster) -> Iterator[Driver]:
    made = Driver(ray_cluster)
    yield made
    made.end()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a batch."""
    path = tmp_path / "a batch's"
    path.mkdir()
    (path / "plan.json").write_text("{}", "utf-8")
    return path
