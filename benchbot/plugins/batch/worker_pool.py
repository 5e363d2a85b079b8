"""The crew of a batch: who computes it, noted in its folder for those who come later."""

import json
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Self

from benchbot.core import results
from benchbot.core.records import Resources, WorkOrder
from benchbot.plugins.batch.folder import Folder


@dataclass(frozen=True)
class Crew:
    """Who computes a batch: an executor, how many workers, and what each of them needs."""

    executor: str = "local"
    jobs: int = 1
    resources: Resources = Resources()  # noqa: RUF009 - it is frozen
    options: Mapping[str, str] = field(default_factory=dict)
    detached: bool = False
    """Nobody looks on: who finishes the last episode evaluates the batch, too."""
    archive: bool = False
    """Whether a ZIP archive of the results is wanted at the end."""

    @classmethod
    def read(cls, folder: Folder) -> Self:
        """Return the crew of a batch, that of its last driver; one local worker when it had none."""
        try:
            document = json.loads(folder.crew.read_bytes())
            return cls(**{**document, "resources": Resources(**document["resources"])})
        except (OSError, ValueError, TypeError, KeyError):
            return cls()

    def write(self, folder: Folder) -> None:
        """Write it down for drivers that come later."""
        results.write_json(folder.crew, asdict(self))

    def order(self, folder: Folder, count: int) -> WorkOrder:
        """Return the order for some of the workers."""
        command = (
            sys.executable,
            "-P",  # the folder where the driver runs must not shadow modules
            "-m",
            "benchbot.plugins.batch.worker",
            str(folder.path),
            "--cpus",
            str(self.resources.cpus),
        )
        return WorkOrder(folder.path, command, count, self.resources, dict(self.options))
