"""The request of a run: one frozen value that says what is to be run.

The command line, the TUI, a batch, a bundle and the Gymnasium environments describe a run by it, and it crosses to the
supervisor's process. Its canonical bytes are what keys and hashes of a run are made of.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from typing import Any


@dataclass(frozen=True)
class Limits:
    """Limits of an episode over all its attempts, resets included; None is no limit. Times in seconds.

    `restarts` is how often the robot may be put back after it has moved: more are refused, the others end the episode.
    """

    steps: int | None = None
    simulated_time_s: float | None = None
    wall_time_s: float | None = None
    restarts: int | None = None

    def determining(self) -> dict[str, Any]:
        """Return them as plain data; a limit that older versions do not know is there only when it is set."""
        return {name: limit for name, limit in asdict(self).items() if limit is not None or name != "restarts"}


NO_LIMITS = Limits()
AUTO = "auto"
"""The device of a run for which none is asked: what the simulator finds on the machine."""


@dataclass(frozen=True)
class RunRequest:
    """A task on a robot in an environment (`name:variant[:variant…]`), the seed, and what is changed of them.

    `episode` is the number of one, in a task that has a list; None is the first. `settings` (dotted key to value)
    override what the environments declare: see `benchbot.core.overrides`. `method` is the evaluation method, when
    scoring is asked for, and `record` names recorders and the folders that they write into: neither changes a result.
    `secret` (benchbot.core.randomness) is empty for none. `despite` names findings of a real robot's diagnosis that do
    not refuse the run: it goes on with whatever robot there is, and the result says so. `device` is that of a
    simulator: the result names the one that it ran on, and one that is asked for determines it.
    """

    task: str
    robot: str
    environment: str
    seed: int = 0
    episode: int | None = None
    settings: Mapping[str, Any] = field(default_factory=dict, hash=False)
    limits: Limits = NO_LIMITS
    method: str | None = None
    record: Mapping[str, str] = field(default_factory=dict, hash=False)
    secret: str = field(default="", repr=False)
    despite: tuple[str, ...] = ()
    device: str = AUTO

    def determining(self) -> dict[str, Any]:
        """Return what of it determines a result, as plain data; secret and device are there only when given."""
        document = {**asdict(self), "limits": self.limits.determining()}
        given = {"secret": self.secret, "device": self.device != AUTO}
        for name in ("method", "record", "despite", *(name for name in given if not given[name])):
            del document[name]
        return document

    def canonical(self) -> bytes:
        """Return the canonical bytes of what determines a result: the same for equal requests, and for no others."""
        return canonical(self.determining())


def canonical(document: Any) -> bytes:
    """Return a document as JSON (UTF-8) that is the same for equal documents: keys sorted, no spaces."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False).encode()


def digest(document: Any) -> str:
    """Return the SHA-256 of a document's canonical JSON, in hexadecimal digits."""
    return sha256(canonical(document)).hexdigest()
