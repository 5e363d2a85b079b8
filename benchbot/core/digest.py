"""A digest of everything that a solution was shown, so that two runs can be proven identical."""

from collections.abc import Mapping
from concurrent.futures import Executor, Future
from hashlib import sha256
from typing import Any

import numpy as np

from benchbot.core.action_log import MAX_OBSERVATIONS

MARK_DIGITS = 16


class ObservationDigest:
    """A running SHA-256 digest of observations: names, shapes, dtypes and bytes, in sorted order of names."""

    def __init__(self) -> None:
        self._hash = sha256()
        self._marks: list[str] = []

    def update(self, observations: Mapping[str, Any]) -> None:
        """Add what a solution was shown at one step."""
        self._add(observations)
        if len(self._marks) < MAX_OBSERVATIONS:
            self._marks.append(self._hash.hexdigest()[:MARK_DIGITS])

    def wait(self) -> None:
        """Return when the arrays of the last update are no longer needed: at once, here."""

    def hexdigest(self) -> str:
        """Return the digest of everything so far."""
        return self._hash.hexdigest()

    def marks(self) -> list[str]:
        """Return how the digest began after each update: where two of them part, what was shown differs first."""
        return list(self._marks)

    def _add(self, value: Any) -> None:
        if isinstance(value, Mapping):
            self._hash.update(b"{")
            for key in sorted(value):
                self._hash.update(f"{key}:".encode())
                self._add(value[key])
            self._hash.update(b"}")
        elif isinstance(value, np.ndarray):
            self._hash.update(f"{value.dtype.str}{value.shape}".encode())
            self._hash.update(np.ascontiguousarray(value).data)
        else:
            self._hash.update(f"{value!r};".encode())


class BackgroundDigest(ObservationDigest):
    """The same digest, computed in a thread, from `begin` on, while whoever was shown the observations thinks.

    The arrays of an update must stay as they are until `wait` has returned.
    """

    def __init__(self, executor: Executor) -> None:
        super().__init__()
        self._executor = executor
        self._noted: Mapping[str, Any] | None = None
        self._begun: Future[None] | None = None

    def update(self, observations: Mapping[str, Any]) -> None:
        """Note what a solution was shown at one step."""
        self.wait()
        self._noted = observations

    def begin(self) -> None:
        """Add what is noted, in the thread: call it when nothing more urgent is left to do."""
        if self._noted is not None and self._begun is None:
            self._begun = self._executor.submit(super().update, self._noted)

    def wait(self) -> None:
        """Return when the arrays of the last update are no longer needed."""
        self.begin()
        begun, self._begun, self._noted = self._begun, None, None
        if begun is not None:
            begun.result()

    def hexdigest(self) -> str:
        """Return the digest of everything so far."""
        self.wait()
        return super().hexdigest()

    def marks(self) -> list[str]:
        """Return how the digest began after each update."""
        self.wait()
        return super().marks()
