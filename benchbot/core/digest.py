"""Proof of a run: a log of the actions taken, to replay them, and a digest of everything the solution was shown."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, Future
from hashlib import sha256
from typing import Any

MARK_DIGITS = 16
MAX_OBSERVATIONS = 100_000
"""A run that has observed more often is not logged: its log would be larger than anything else of its result."""

BY_HAND = "by_hand"
"""The last entry of a row whose action was taken by a person at the host, not by the solution."""


class ActionLog:
    """The actions taken since the run was last reset: in each scene a row for each observation.

    A row holds the action that led to the observation and its arguments, if there are any. The first row of a scene
    follows from entering it.
    """

    def __init__(self) -> None:
        self._scenes: list[tuple[str, list[list[Any]]]] = []
        self._observed = 0

    def entered(self, scene: str) -> None:
        """Note that the robot has been put into a scene, the next one."""
        self._scenes.append((scene, []))

    def observed(self, action: str | None, arguments: Mapping[str, Any], *, by_hand: bool = False) -> None:
        """Note that the robot has been observed, after an action or without one."""
        self._observed += 1
        if self._observed <= MAX_OBSERVATIONS:
            taken = [action, dict(arguments)]
            self._scenes[-1][1].append([*taken, BY_HAND] if by_hand else [part for part in taken if part])

    def as_list(self, marks: Sequence[str]) -> list[dict[str, Any]] | None:
        """Return the log as a result has it, with the mark of the observation digest at the head of each row.

        None when there is no mark for each of them: then it cannot be proven, either.
        """
        if self._observed > MAX_OBSERVATIONS or len(marks) != self._observed:
            return None
        left = iter(marks)
        return [{"scene": scene, "rows": [[next(left), *row] for row in rows]} for scene, rows in self._scenes]


class ObservationDigest:
    """A running SHA-256 digest of observations: names, shapes, dtypes and bytes, in sorted order of names."""

    def __init__(self) -> None:
        self._hash = sha256()
        self._marks: list[str] = []

    def update(self, observations: Mapping[str, object]) -> None:
        """Add the observations of one step."""
        self._add(observations)
        if len(self._marks) < MAX_OBSERVATIONS:
            self._marks.append(self._hash.hexdigest()[:MARK_DIGITS])

    def wait(self) -> None:
        """Return when the arrays of the last update are no longer needed: at once, here."""

    def hexdigest(self) -> str:
        """Return the digest of everything so far."""
        return self._hash.hexdigest()

    def marks(self) -> list[str]:
        """Return the first digits of the digest after each update; two runs first differ where their marks do."""
        return list(self._marks)

    def _add(self, value: Any) -> None:
        import numpy as np  # most processes that import this module digest nothing

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
    """The same digest, computed in a thread, from `begin` on, while the solution works on the observations.

    The arrays of an update must stay as they are until `wait` has returned.
    """

    def __init__(self, executor: Executor) -> None:
        super().__init__()
        self._executor = executor
        self._noted: Mapping[str, object] | None = None
        self._begun: Future[None] | None = None

    def update(self, observations: Mapping[str, object]) -> None:
        """Note the observations of one step."""
        self.wait()
        self._noted = observations

    def begin(self) -> None:
        """Start adding the noted observations in the thread, once nothing more urgent is left to do."""
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
        """Return the first digits of the digest after each update."""
        self.wait()
        return super().marks()
