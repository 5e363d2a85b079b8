"""The workers of a batch: the pool that is wanted, and those that run, both noted in its folder for later drivers."""

import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Self

from benchbot.cli.kit.preflight import Intent
from benchbot.core import plugin_manager, results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.light_records import Executor
from benchbot.core.records import Resources, Workers, WorkOrder
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.journal import EventLog

DRIVER = "driver"
"""The name of the driver's events."""


@dataclass(frozen=True)
class WorkerPool:
    """The workers that are wanted: their executor, how many, and what each of them needs."""

    executor: str = "local"
    jobs: int = 1
    resources: Resources = Resources()  # noqa: RUF009 - it is frozen
    options: Mapping[str, str] = field(default_factory=dict)
    detached: bool = False
    """No person's driver waits for the end: a worker that finds nothing left evaluates the batch, too."""
    archive: bool = False
    """Whether a ZIP archive of the results is wanted at the end."""

    @classmethod
    def read(cls, folder: Folder) -> Self:
        """Return the pool of a batch's last driver; one local worker when it had none."""
        try:
            document = json.loads(folder.worker_pool.read_bytes())
            return cls(**{**document, "resources": Resources(**document["resources"])})
        except (OSError, ValueError, TypeError, KeyError):
            return cls()

    def write(self, folder: Folder) -> None:
        """Write it down for later drivers."""
        results.write_json(folder.worker_pool, asdict(self))


class RunningWorkers:
    """The workers that run or wait to run, those of earlier drivers among them; raises BenchbotError."""

    def __init__(self, folder: Folder, pool: WorkerPool) -> None:
        self._folder = folder
        self._pool = pool
        self._executor: Executor = plugin_manager.load().record("executors", pool.executor)
        self._workers = _attached(folder)

    def alive(self) -> int:
        """Return how many run or wait to run."""
        return sum(workers.alive() for workers in self._workers)

    def launch(self, count: int) -> None:
        """Launch workers, and note their reference before anything else happens; raises BenchbotError."""
        EventLog(self._folder.events, DRIVER).tell("launched", count=count, executor=self._pool.executor)
        # -P: the folder where the driver runs must not shadow modules.
        module = (sys.executable, "-P", "-m", "benchbot.plugins.batch.worker")
        command = (*module, str(self._folder.path), "--cpus", str(self._pool.resources.cpus))
        order = WorkOrder(self._folder.path, command, count, self._pool.resources, dict(self._pool.options))
        launched = self._executor.launch(order)
        self._workers = [*(workers for workers in self._workers if workers.alive()), launched]
        entries = [{"executor": self._pool.executor, "reference": workers.reference} for workers in self._workers]
        try:
            results.write_json(self._folder.executor, {"workers": entries})
        except BenchbotError:
            launched.stop()  # no later driver would find them
            raise

    def stop(self) -> None:
        """End all workers."""
        for workers in self._workers:
            workers.stop()


def check(catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield which executor runs the workers; raises BenchbotError when it is not installed."""
    if intent.executor is not None and intent.order is not None:
        catalog.plugins.record("executors", intent.executor)
        yield Finding(Level.OK, "workers", f"{intent.order.count}, by the executor {intent.executor}")


def count_alive(folder: Folder) -> int:
    """Return how many workers of a batch run or wait to run, or -1 when their executor cannot be asked from here."""
    try:
        return sum(workers.alive() for workers in _attached(folder))
    except BenchbotError:
        return -1


def _attached(folder: Folder) -> list[Workers]:
    """Return the workers that were launched last; raises BenchbotError when they, or their executor, are not known."""
    try:
        noted = json.loads(folder.executor.read_bytes())["workers"]
        references = [(entry["executor"], entry["reference"]) for entry in noted]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise BenchbotError(
            "It is not known which workers run.",
            f"{folder.executor} cannot be read: {error}.",
            f"See that no worker of the batch runs any more, and delete {folder.executor}.",
        ) from error
    executors = plugin_manager.load()
    return [executors.record("executors", name).attach(reference) for name, reference in references]
