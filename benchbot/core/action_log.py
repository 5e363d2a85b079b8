"""The log of actions: what a solution did, observation by observation, so that it can be replayed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

MAX_OBSERVATIONS = 100_000
"""A run that has observed more often is not logged: its log would be larger than anything else of its result."""

BY_HAND = "by_hand"
"""What a row ends with whose action was the host's own, not the solution's."""

Row = tuple[str | None, Mapping[str, Any], bool]
"""The action that an observation followed, None for entering a scene and for a mere look; its arguments; whether it was
taken by hand."""


@dataclass
class SceneLog:
    """The actions taken in one scene, a row for each observation; the first follows from entering it."""

    scene: str
    rows: list[Row] = field(default_factory=list)


class ActionLog:
    """What has been done since the run was last reset, scene by scene."""

    def __init__(self) -> None:
        self._scenes: list[SceneLog] = []
        self._observed = 0

    def entered(self, scene: str) -> None:
        """Note that the robot has been put into a scene, the next one."""
        self._scenes.append(SceneLog(scene))

    def observed(self, action: str | None, arguments: Mapping[str, Any], *, by_hand: bool = False) -> None:
        """Note that the robot has been observed, after an action or without one."""
        self._observed += 1
        if self._observed <= MAX_OBSERVATIONS:
            self._scenes[-1].rows.append((action, dict(arguments), by_hand))

    def as_list(self, marks: Sequence[str]) -> list[dict[str, Any]] | None:
        """Return what a result says of it, with the mark that the digest had at each observation.

        None when there is no mark for each of them: then it cannot be proven, either.
        """
        if self._observed > MAX_OBSERVATIONS or len(marks) != self._observed:
            return None
        left = iter(marks)
        return [{"scene": log.scene, "rows": [_row(next(left), *row) for row in log.rows]} for log in self._scenes]


def _row(mark: str, action: str | None, arguments: Mapping[str, Any], by_hand: bool) -> list[Any]:
    if by_hand:
        return [mark, action, dict(arguments), BY_HAND]
    taken = [] if action is None else [action]
    return [mark, *taken, *([dict(arguments)] if arguments else [])]
